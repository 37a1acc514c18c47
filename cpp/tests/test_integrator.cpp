#include "peridem/integrator.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

constexpr Real no_limit = std::numeric_limits<Real>::infinity();

State oneNode(Real density = 1) {
  State state(1);
  state.density[0] = density;
  return state;
}

const std::vector<std::uint8_t> nothing_locked = {0};

// v += k f / rho, then u and x += dt v, of all nodes.
Kick kickAndDrift(State& state, const std::vector<std::uint8_t>& locked, Real k, Real dt,
                  Real speed_limit, int dimension) {
  KickAndDrift motion;
  motion.k = k;
  motion.dt = dt;
  motion.speed_limit = speed_limit;
  motion.locked = &locked;
  return motion.move(state, 0, static_cast<Index>(state.size()), dimension);
}

void stepCentral(State& state, Real dt) {
  REQUIRE(kickAndDrift(state, nothing_locked, dt, dt, no_limit, 2).within_limit);
}

template <class Force>
void stepVerlet(State& state, Real dt, const Force& force) {
  REQUIRE(kickAndDrift(state, nothing_locked, dt / 2, dt, no_limit, 2).within_limit);
  force(state);
  REQUIRE(kick(state, nothing_locked, dt / 2, no_limit, 2, 1).within_limit);
}

}  // namespace

// In both: dt and the acceleration are powers of two, so that no operation rounds.

TEST_CASE("central difference: free fall is exact for its scheme") {
  State state = oneNode(4);
  state.x_ref[0] = state.x[0] = Vec3(0, 100, 0);
  state.f[0] = Vec3(0, -32, 0);  // acceleration -8
  constexpr Real dt = 1.0 / 64;
  for (int n = 1; n <= 50; ++n) {
    stepCentral(state, dt);
    CHECK(state.v[0] == Vec3(0, -8 * n * dt, 0));
    CHECK(state.u[0] == Vec3(0, -8 * dt * dt * n * (n + 1) / 2, 0));  // sum of dt v_k
    CHECK(state.x[0] == state.x_ref[0] + state.u[0]);
  }
}

TEST_CASE("velocity Verlet: free fall is exact") {
  State state = oneNode(4);
  const auto force = [](State& s) { s.f[0] = Vec3(0, -32, 0); };
  force(state);
  constexpr Real dt = 1.0 / 64;
  for (int n = 1; n <= 50; ++n) {
    stepVerlet(state, dt, force);
    CHECK(state.v[0] == Vec3(0, -8 * n * dt, 0));
    CHECK(state.u[0] == Vec3(0, -4 * (n * dt) * (n * dt), 0));
  }
}

// A harmonic oscillator, omega dt = 0.3. Both schemes obey u_(n+1) - 2 u_n + u_(n-1) = -(omega
// dt)^2 u_n, so u turns by phi each step with cos(phi) = 1 - (omega dt)^2 / 2. Round-off grows with
// n^2 at worst: 1000 steps leave 1e-10.

TEST_CASE("velocity Verlet: a harmonic oscillator follows the solution of the scheme") {
  const auto force = [](State& s) { s.f[0] = -9 * s.density[0] * s.u[0]; };
  State state = oneNode(2);
  state.u[0] = Vec3(1, -2, 0);
  force(state);
  const Real dt = 0.1;
  const Real phi = std::acos(1 - 0.045);
  for (int n = 1; n <= 1000; ++n) {
    stepVerlet(state, dt, force);
    CHECK((state.u[0] - std::cos(n * phi) * Vec3(1, -2, 0)).norm() < 1e-10);
  }
}

TEST_CASE("central difference: a harmonic oscillator follows the solution of the scheme") {
  // The first step takes the whole force: u_1 = (1 - (omega dt)^2) u_0.
  State state = oneNode(2);
  state.u[0] = Vec3(1, 0, 0);
  const Real dt = 0.1;
  const Real phi = std::acos(1 - 0.045);
  for (int n = 1; n <= 1000; ++n) {
    state.f[0] = -9 * state.density[0] * state.u[0];
    stepCentral(state, dt);
    const Real expected = std::cos(n * phi) - std::tan(phi / 2) * std::sin(n * phi);
    CHECK(std::abs(state.u[0][0] - expected) < 1e-10);
  }
}

TEST_CASE("integrators: locked directions and the third dimension stay as they are") {
  State state(3);
  state.density.assign(3, 1);
  state.v.assign(3, Vec3(1, 1, 1));
  state.f.assign(3, Vec3(1, 1, 1));
  const std::vector<std::uint8_t> locked = {0, direction_x, direction_x | direction_y};
  REQUIRE(kickAndDrift(state, locked, 1, 0.5, no_limit, 2).within_limit);
  CHECK(state.v == std::vector<Vec3>{{2, 2, 1}, {1, 2, 1}, {1, 1, 1}});
  CHECK(state.u == std::vector<Vec3>{{1, 1, 0}, {0, 1, 0}, {0, 0, 0}});
  CHECK(state.x == state.u);
  REQUIRE(kick(state, locked, 1, no_limit, 3, 1).within_limit);
  CHECK(state.v == std::vector<Vec3>{{3, 3, 2}, {1, 3, 2}, {1, 1, 2}});
}

TEST_CASE("integrators: report a velocity that is not a number or beyond the limit") {
  for (const Real f : {not_given, no_limit, 11.0, -11.0}) {
    State state(2);
    state.density.assign(2, 1);
    state.f[1][1] = f;
    State other = state;
    const std::vector<std::uint8_t> locked = {0, 0};
    CHECK_FALSE(kick(state, locked, 1, 10, 2, 1).within_limit);
    CHECK_FALSE(kickAndDrift(other, locked, 1, 1, 10, 2).within_limit);
  }
}

TEST_CASE("integrators: forces on locked directions do not matter") {
  State state(1);
  state.density[0] = 1;
  state.f[0] = Vec3(not_given, 0, not_given);
  CHECK(kick(state, {direction_x}, 1, 10, 2, 1).within_limit);
  CHECK(state.v[0] == Vec3(0, 0, 0));
}

TEST_CASE("integrators: move the nodes of their range alone and report the fastest of them") {
  State state(4);
  state.density.assign(4, 2);
  for (std::size_t i = 0; i < 4; ++i) state.f[i] = Vec3(0, -4.0 * static_cast<Real>(i + 1), 0);
  const std::vector<std::uint8_t> locked(4, 0);
  KickAndDrift motion;
  motion.k = 0.5;
  motion.dt = 0.25;
  motion.speed_limit = 3.5;
  motion.locked = &locked;
  const Kick kicked = motion.move(state, 1, 3, 2);
  CHECK(kicked.fastest == 3);
  CHECK(kicked.within_limit);
  CHECK(state.v == std::vector<Vec3>{{0, 0, 0}, {0, -2, 0}, {0, -3, 0}, {0, 0, 0}});
  CHECK(state.u == std::vector<Vec3>{{0, 0, 0}, {0, -0.5, 0}, {0, -0.75, 0}, {0, 0, 0}});
}

TEST_CASE("integrators: the number of threads of a kick changes nothing") {
  constexpr std::size_t n = 25000;  // enough that threads are used
  const auto move = [](int threads) {
    State state(n);
    Random random(61);
    for (std::size_t i = 0; i < n; ++i) {
      state.density[i] = 2 + random();
      state.f[i] = random.vector(3);
    }
    const std::vector<std::uint8_t> locked(n, 0);
    const Kick kicked = kick(state, locked, 0.1, no_limit, 3, threads);
    REQUIRE(kicked.within_limit);
    return std::pair(state.v, kicked.fastest);
  };
  const auto one = move(1);
  for (const int threads : {2, 4}) {
    const auto many = move(threads);
    CHECK(many.first == one.first);
    CHECK(many.second == one.second);
  }
}
