// Functions of eight lanes against those of numbers, with every instruction set of the processor.
#include <bit>
#include <numeric>

#include "instruction_sets.h"
#include "lanes_probe.h"
#include "peridem/bond_block.h"

using namespace peridem;
using namespace peridem::test;

namespace {

ProbeLanes probeFor(const std::string& instruction_set) {
#ifdef PERIDEM_X86
  if (instruction_set == "avx512") return avx512::probeLanes;
  if (instruction_set == "avx2") return avx2::probeLanes;
#endif
  REQUIRE(instruction_set == "baseline");
  return baseline::probeLanes;
}

// `per_result` numbers for each result.
std::vector<double> probe(const std::string& instruction_set, LanesFunction function,
                          const std::vector<double>& in, std::size_t per_result = 1) {
  const std::size_t n = in.size() / per_result;
  REQUIRE(n % lanes == 0);
  AlignedArray from(in.size());
  AlignedArray to(n);
  std::copy(in.begin(), in.end(), from.data());
  probeFor(instruction_set)(function, from.data(), to.data(), n);
  return {to.data(), to.data() + n};
}

// Distance in units of the last place of `exact`, a positive normal number.
double unitsOff(double value, double exact) {
  const double unit = std::nextafter(exact, std::numeric_limits<double>::infinity()) - exact;
  return std::abs(value - exact) / unit;
}

// Values of a function of one number and the worst distance from another one.
template <class Function>
double worstUnitsOff(const std::string& set, LanesFunction function, const std::vector<double>& in,
                     Function exact) {
  const std::vector<double> values = probe(set, function, in);
  double worst = 0;
  for (std::size_t k = 0; k < in.size(); ++k)
    worst = std::max(worst, unitsOff(values[k], exact(in[k])));
  return worst;
}

template <class Check>
void forEachInstructionSet(Check check) {
  for (const std::string& set : availableInstructionSets()) {
    CAPTURE(set);
    check(set);
  }
}

constexpr std::size_t many = 1 << 17;

std::vector<double> randomNumbers(std::size_t n, std::uint32_t seed) {
  Random random(seed);
  std::vector<double> values(n);
  for (double& value : values) value = random();
  return values;
}

// The order of the sum of eight numbers, for every instruction set.
double fixedOrder(const double* a) {
  return ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7]));
}

}  // namespace

TEST_CASE("lanes: exponential is within two units of the last place from -700 to 0") {
  // Evenly over the range, then near zero where most bonds are, then at halves of multiples of
  // ln 2, where the reduced argument is largest.
  std::vector<double> in;
  for (const double r : randomNumbers(many, 3)) in.push_back(-350 * (r + 1));
  for (const double r : randomNumbers(many, 5)) in.push_back(-std::pow(2.0, 40 * r - 35));
  for (int n = 0; n < 2 * 1009; ++n)
    for (const double shift : {-1e-9, 0.0, 1e-9, -1e-14})
      in.push_back(-std::abs(n * std::log(2.0) / 2 + shift));
  in.insert(in.end(), {0.0, -0.0, -700.0, -1e-300, -1e-320});
  in.resize(in.size() / lanes * lanes + lanes, -1);
  forEachInstructionSet([&](const std::string& set) {
    CHECK(worstUnitsOff(set, LanesFunction::exponential, in, [](double a) {
            return static_cast<double>(std::exp(static_cast<long double>(a)));
          }) <= 2);
    CHECK(probe(set, LanesFunction::exponential, std::vector<double>(lanes, 0.0))[0] == 1);
  });
}

TEST_CASE("lanes: exponential of small arguments has the same bits beside large ones") {
  std::vector<double> alone, beside;
  for (const double r : randomNumbers(many, 13)) {
    alone.push_back(-0.17 * (r + 1));  // to -0.34
    beside.push_back(alone.back());
  }
  for (std::size_t k = 0; k < beside.size(); k += lanes) beside[k] = -2;
  forEachInstructionSet([&](const std::string& set) {
    const std::vector<double> a = probe(set, LanesFunction::exponential, alone);
    const std::vector<double> b = probe(set, LanesFunction::exponential, beside);
    std::size_t differ = 0;
    for (std::size_t k = 0; k < a.size(); ++k) differ += k % lanes != 0 && a[k] != b[k];
    CHECK(differ == 0);
  });
}

TEST_CASE("lanes: exponential below -700 is that of -700, and not a number stays one") {
  const double infinity = std::numeric_limits<double>::infinity();
  const std::vector<double> in = {-700.5, -710,      -745,      -1e4,
                                  -1e300, -infinity, not_given, -not_given};
  forEachInstructionSet([&](const std::string& set) {
    const std::vector<double> values = probe(set, LanesFunction::exponential, in);
    for (std::size_t k = 0; k < 6; ++k) CHECK(unitsOff(values[k], std::exp(-700.0)) <= 2);
    CHECK(std::isnan(values[6]));
    CHECK(std::isnan(values[7]));
  });
}

TEST_CASE("lanes: 1 / sqrt is within two units of the last place over single precision") {
  std::vector<double> in;
  for (const double r : randomNumbers(many, 7)) in.push_back(std::pow(2.0, 126 * r));
  for (const double r : randomNumbers(many, 11)) in.push_back(2.5 + 1.5 * r);  // two binades
  for (const double exact : {1.0, 4.0, 0.25, 1.5, 0x1p-126, 0x1.fffffcp127, 2.0, 3.0})
    in.push_back(exact);
  forEachInstructionSet([&](const std::string& set) {
    CHECK(worstUnitsOff(set, LanesFunction::inverse_square_root, in, [](double a) {
            return static_cast<double>(1 / std::sqrt(static_cast<long double>(a)));
          }) <= 2);
  });
}

TEST_CASE("lanes: 1 / sqrt of what is not a number is none, and of coinciding ends no number") {
  const std::vector<double> in = {not_given, -not_given, -1, -0x1p-100, 0, 0, 1, 1};
  forEachInstructionSet([&](const std::string& set) {
    const std::vector<double> values = probe(set, LanesFunction::inverse_square_root, in);
    for (std::size_t k = 0; k < 4; ++k) CHECK(std::isnan(values[k]));
    for (std::size_t k = 4; k < 6; ++k) CHECK_FALSE(std::isfinite(values[k]));
  });
}

TEST_CASE("lanes: sums over the lanes have the same order everywhere, one row or eight at once") {
  std::vector<double> in = randomNumbers(64 * 64, 13);
  for (std::size_t k = 0; k < in.size(); k += 3) in[k] *= 1e8;  // so that the order matters
  std::size_t order_matters = 0;
  for (std::size_t k = 0; k < in.size(); k += lanes)
    order_matters += fixedOrder(&in[k]) != std::accumulate(&in[k], &in[k] + lanes, 0.0);
  REQUIRE(order_matters > in.size() / lanes / 4);
  forEachInstructionSet([&](const std::string& set) {
    for (const auto function : {LanesFunction::sum_of_lanes, LanesFunction::sums_of_rows}) {
      const std::vector<double> sums = probe(set, function, in, lanes);
      std::size_t wrong = 0;
      for (std::size_t k = 0; k < sums.size(); ++k) wrong += sums[k] != fixedOrder(&in[lanes * k]);
      CHECK(wrong == 0);
    }
  });
}

TEST_CASE("lanes: magnitude clears the sign alone, also of zero and of what is not a number") {
  const std::vector<double> in = {-1.5, 1.5, -0.0, 0.0, not_given, -not_given, -1e-320, 1e300};
  forEachInstructionSet([&](const std::string& set) {
    const std::vector<double> values = probe(set, LanesFunction::magnitude, in);
    for (std::size_t k = 0; k < in.size(); ++k)
      CHECK(std::bit_cast<std::uint64_t>(values[k]) ==
            std::bit_cast<std::uint64_t>(std::abs(in[k])));
  });
}

TEST_CASE("lanes: the larger of two, the first where it is not a number") {
  const std::vector<double> a = {1, 2, -3, 0, not_given, 5, -1, 7};
  const std::vector<double> b = {2, 1, -4, 0, 1, 5, 0, 6};
  std::vector<double> in = a;
  in.insert(in.end(), b.begin(), b.end());
  forEachInstructionSet([&](const std::string& set) {
    const std::vector<double> values = probe(set, LanesFunction::larger, in, 2);
    for (std::size_t k = 0; k < lanes; ++k)
      if (k == 4)
        CHECK(std::isnan(values[k]));
      else
        CHECK(values[k] == std::max(a[k], b[k]));
  });
}

TEST_CASE("lanes: comparison sets the bits of larger lanes, none where one is not a number") {
  const std::vector<double> in = {1, 2, not_given, 4, 5, 6, 1,         8,   // a
                                  0, 2, 0,         3, 9, 5, not_given, 7};  // b
  forEachInstructionSet([&](const std::string& set) {
    CHECK(probe(set, LanesFunction::greater_bits, in, 2)[0] == 0b10101001);
  });
}

TEST_CASE("lanes: a product is kept where its bit is set, and zero elsewhere whatever it is") {
  std::vector<double> in(2 * lanes, 3);
  for (const std::size_t k : {1, 3, 5, 6}) in[k] = not_given;
  forEachInstructionSet([&](const std::string& set) {
    CHECK(probe(set, LanesFunction::product_kept, in, 2) ==
          std::vector<double>{9, 0, 9, 0, 9, 0, 0, 9});
  });
}
