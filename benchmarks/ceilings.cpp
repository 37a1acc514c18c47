// What this machine can do at most: fused multiply-adds a second, and bytes a second from the
// caches and from memory. Prints one JSON object.
//
//   ceilings THREADS L2_BYTES L3_BYTES SECONDS
//
// Compiled and run by machine.py for the processor at hand. Rates are the best of several tries of
// SECONDS each: a ceiling is what the machine reaches undisturbed.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// Keeps a value alive, so that the compiler cannot drop the work behind it.
template <class T>
void use(const T& value) {
  asm volatile("" : : "m"(value) : "memory");
}

constexpr int chains = 12;  // independent sums: latency times throughput of every processor here
constexpr int rounds = 4096;

// Each runs chains * rounds operations on whole registers and returns the flops.
using Burst = double (*)();

double burstBaseline() {
  // Two doubles: the registers of plain x86-64 and of ARM. Without fused instructions the
  // compiler makes a multiplication and an addition of each; both count.
  typedef double Pair __attribute__((vector_size(16)));
  Pair sum[chains];
  for (auto& s : sum) s = Pair{1.0, 1.0};
  Pair a{0.999999, 0.999999}, b{1e-7, 1e-7};
  use(a), use(b);
  for (int k = 0; k < rounds; ++k) {
#pragma GCC unroll 12
    for (int c = 0; c < chains; ++c) sum[c] = sum[c] * a + b;
  }
  use(sum);
  return 2.0 * 2 * chains * rounds;
}

#if defined(__x86_64__)
__attribute__((target("avx2,fma"))) double burstAvx2() {
  __m256d sum[chains];
  for (auto& s : sum) s = _mm256_set1_pd(1.0);
  const __m256d a = _mm256_set1_pd(0.999999), b = _mm256_set1_pd(1e-7);
  for (int k = 0; k < rounds; ++k) {
#pragma GCC unroll 12
    for (int c = 0; c < chains; ++c) sum[c] = _mm256_fmadd_pd(sum[c], a, b);
  }
  use(sum);
  return 2.0 * 4 * chains * rounds;
}

__attribute__((target("avx512f"))) double burstAvx512() {
  __m512d sum[chains];
  for (auto& s : sum) s = _mm512_set1_pd(1.0);
  const __m512d a = _mm512_set1_pd(0.999999), b = _mm512_set1_pd(1e-7);
  for (int k = 0; k < rounds; ++k) {
#pragma GCC unroll 12
    for (int c = 0; c < chains; ++c) sum[c] = _mm512_fmadd_pd(sum[c], a, b);
  }
  use(sum);
  return 2.0 * 8 * chains * rounds;
}
#endif

// Flops a second of one thread, best of several tries.
double flopRate(Burst burst, double seconds) {
  double best = 0;
  for (int attempt = 0; attempt < 5; ++attempt) {
    double flops = 0;
    const auto begin = Clock::now();
    do flops += burst();
    while (secondsSince(begin) < seconds);
    best = std::max(best, flops / secondsSince(begin));
  }
  return best;
}

// Whatever registers the compiler was told of; 64 bytes a time keep the load units busy.
typedef double Eight __attribute__((vector_size(64), aligned(64)));

double readAll(const double* data, std::size_t n) {
  const auto* p = reinterpret_cast<const Eight*>(data);
  Eight s0{}, s1{}, s2{}, s3{};
  for (std::size_t k = 0; k < n / 8; k += 4) {
    s0 += p[k];
    s1 += p[k + 1];
    s2 += p[k + 2];
    s3 += p[k + 3];
  }
  const Eight sum = (s0 + s1) + (s2 + s3);
  use(sum);
  return 8.0 * static_cast<double>(n);
}

// a = b + 3 c; counts what the program names, not the lines that a store reads before it writes.
double triad(double* data, std::size_t n) {
  const std::size_t third = n / 24 * 8;
  auto* a = reinterpret_cast<Eight*>(data);
  const auto* b = reinterpret_cast<const Eight*>(data + third);
  const auto* c = reinterpret_cast<const Eight*>(data + 2 * third);
  for (std::size_t k = 0; k < third / 8; ++k) a[k] = b[k] + 3.0 * c[k];
  use(*a);
  return 3 * 8.0 * static_cast<double>(third);
}

struct Freer {
  void operator()(double* p) const { std::free(p); }
};

// Bytes a second of `pass` on arrays of n doubles, one for each thread; best of several tries.
double byteRate(const std::function<double(double*, std::size_t)>& pass, std::size_t n, int threads,
                double seconds) {
  n = n / 96 * 96;
  std::vector<double> best(static_cast<std::size_t>(threads) * 5, 0.0);
  std::atomic<int> ready{0};
  const auto work = [&](int thread) {
    std::unique_ptr<double, Freer> data(
        static_cast<double*>(std::aligned_alloc(4096, (n * 8 + 4095) / 4096 * 4096)));
    std::fill_n(data.get(), n, 1.0);  // touched by the thread that reads it
    pass(data.get(), n);
    ++ready;
    while (ready < threads) std::this_thread::yield();
    for (int attempt = 0; attempt < 5; ++attempt) {
      double bytes = 0;
      const auto begin = Clock::now();
      do bytes += pass(data.get(), n);
      while (secondsSince(begin) < seconds);
      best[static_cast<std::size_t>(thread * 5 + attempt)] = bytes / secondsSince(begin);
    }
  };
  std::vector<std::thread> pool;
  for (int thread = 0; thread < threads; ++thread) pool.emplace_back(work, thread);
  for (auto& thread : pool) thread.join();
  double rate = 0;
  for (std::size_t attempt = 0; attempt < 5; ++attempt) {
    double sum = 0;
    for (std::size_t thread = 0; thread < static_cast<std::size_t>(threads); ++thread)
      sum += best[thread * 5 + attempt];
    rate = std::max(rate, sum);
  }
  return rate;
}

}  // namespace

int main(int argc, char** argv) {
  const int threads = argc > 1 ? std::max(1, std::atoi(argv[1])) : 1;
  const std::size_t l2 = argc > 2 ? static_cast<std::size_t>(std::atoll(argv[2])) : 1 << 19;
  const std::size_t l3 = argc > 3 ? static_cast<std::size_t>(std::atoll(argv[3])) : 1 << 23;
  const double seconds = argc > 4 ? std::atof(argv[4]) : 0.1;
  const std::size_t in_l2 = l2 / 2 / 8;  // half of it: the rest is for everything else
  const std::size_t in_l3 = l3 / 4 / 8;  // other machines may share it
  const std::size_t in_memory = std::size_t{1} << 25;  // 256 MiB a thread: beyond any cache

  std::string fma = "\"baseline\": " + std::to_string(flopRate(burstBaseline, seconds) / 1e9);
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    fma += ", \"avx2\": " + std::to_string(flopRate(burstAvx2, seconds) / 1e9);
  if (__builtin_cpu_supports("avx512f"))
    fma += ", \"avx512\": " + std::to_string(flopRate(burstAvx512, seconds) / 1e9);
#endif
  std::printf("{\"fma_gflop_s\": {%s}", fma.c_str());
  const auto read = [](double* data, std::size_t n) { return readAll(data, n); };
  const auto print = [&](const char* name, std::size_t n, int count) {
    std::printf(", \"%s\": {\"read\": %.3f, \"triad\": %.3f}", name,
                byteRate(read, n, count, seconds) / 1e9, byteRate(triad, n, count, seconds) / 1e9);
  };
  print("l2_gb_s", in_l2, 1);
  print("l3_gb_s", in_l3, 1);
  print("memory_gb_s", in_memory, 1);
  print("memory_all_gb_s", in_memory, threads);
  std::printf(", \"threads\": %d}\n", threads);
  return 0;
}
