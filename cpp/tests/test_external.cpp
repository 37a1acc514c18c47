#include "peridem/errors.h"
#include "peridem/external.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

TimeFunction timeFunction(TimeFunctionType type, std::vector<Real> parameters) {
  return {type, std::move(parameters)};
}

DisplacementSet displacement(TimeFunctionType type, std::vector<Real> parameters, Real amplitude,
                             std::uint8_t directions = direction_x) {
  DisplacementSet set;
  set.nodes = {1};
  set.amplitude = {amplitude};
  set.directions = directions;
  set.time_function = timeFunction(type, std::move(parameters));
  return set;
}

// Displacement and velocity of node 1 at time t; node 1 rests at X.
std::pair<Vec3, Vec3> motion(const DisplacementSet& set, Real t, const Vec3& X = Vec3(2, 0, 0),
                             Compatibility mode = Compatibility::corrected) {
  State state(3);
  state.x_ref[1] = X;
  prescribeDisplacements(state, std::span(&set, 1), t, mode);
  CHECK(state.x[1] == state.x_ref[1] + state.u[1]);
  for (const std::size_t i : {0u, 2u}) {
    CHECK(state.u[i] == Vec3::Zero());
    CHECK(state.v[i] == Vec3::Zero());
  }
  return {state.u[1], state.v[1]};
}

}  // namespace

TEST_CASE("force in time: constant, linear and sine") {
  CHECK(forceTimeFactor(timeFunction(TimeFunctionType::constant, {5}), 3) == 1);
  CHECK(forceTimeFactor(timeFunction(TimeFunctionType::linear, {5}), 3) == 3);
  const auto sine = timeFunction(TimeFunctionType::sin, {5, 2});
  CHECK(relativeError(forceTimeFactor(sine, 0.25), 1) < 4 * epsilon);  // sin(pi / 2)
  CHECK(relativeError(forceTimeFactor(sine, 0.75), -1) < 4 * epsilon);
}

TEST_CASE("force in time: linear step rises and rests and rises again") {
  const auto step = timeFunction(TimeFunctionType::linear_step, {5, 2, 3});
  for (const auto& [t, value] : {std::pair(0.0, 0.0),
                                 {1.5, 1.5},
                                 {2.0, 2.0},
                                 {4.5, 2.0},
                                 {5.0, 2.0},
                                 {6.5, 3.5},
                                 {9.0, 4.0},
                                 {12.0, 6.0}})
    CHECK(forceTimeFactor(step, t) == value);
}

TEST_CASE("force in time: slow then fast, changing fuzzily after T1") {
  const auto f = timeFunction(TimeFunctionType::linear_slow_fast, {5, 2, 3, 7});
  CHECK(forceTimeFactor(f, 1) == 3);
  CHECK(forceTimeFactor(f, 2) == 6);
  CHECK(forceTimeFactor(f, 2 * (1 + 0.9e-5)) < 6.1);
  CHECK(forceTimeFactor(f, 2 * (1 + 1.1e-5)) > 14);
  CHECK(forceTimeFactor(f, 4) == 28);
}

TEST_CASE("gravity: every node gets rho g on top of what is there") {
  State state(2);
  state.density = {2, 3};
  state.f[1] = Vec3(1, 1, 1);
  addExternalForces(state, Vec3(0.5, -10, 0), {}, 0, 1);
  CHECK(state.f[0] == Vec3(1, -20, 0));
  CHECK(state.f[1] == Vec3(2.5, -29, 1));
}

TEST_CASE("force set: adds amplitude times time factor in its directions") {
  State state(3);
  ForceSet set;
  set.nodes = {2, 0};
  set.amplitude = {4, -1};
  set.directions = direction_x | direction_z;
  set.time_function = timeFunction(TimeFunctionType::linear, {1});
  const std::vector<ForceSet> sets = {set, set};  // two sets add up
  addExternalForces(state, Vec3::Zero(), sets, 0.5, 1);
  CHECK(state.f[0] == Vec3(-1, 0, -1));
  CHECK(state.f[1] == Vec3(0, 0, 0));
  CHECK(state.f[2] == Vec3(4, 0, 4));
}

TEST_CASE("prescribed motion: constant, linear and sine by hand") {
  auto [u, v] = motion(displacement(TimeFunctionType::constant, {1}, 3), 0.5);
  CHECK(u == Vec3(3, 0, 0));
  CHECK(v == Vec3(0, 0, 0));
  std::tie(u, v) = motion(displacement(TimeFunctionType::linear, {1}, 3), 0.5);
  CHECK(u == Vec3(1.5, 0, 0));
  CHECK(v == Vec3(3, 0, 0));
  std::tie(u, v) = motion(displacement(TimeFunctionType::sin, {1, 2}, 3), 0.25);
  CHECK(relativeError(u, Vec3(3, 0, 0)) < 4 * epsilon);  // sin(pi / 2)
  CHECK(v.norm() < 6 * pi * epsilon);                    // cos(pi / 2)
}

TEST_CASE("prescribed motion: quadratic with the velocity of either mode") {
  const auto set = displacement(TimeFunctionType::quadratic, {1, 4}, 3);
  auto [u, v] = motion(set, 0.5);
  CHECK(u == Vec3(2.5, 0, 0));  // 3 t + 4 t^2
  CHECK(v == Vec3(7, 0, 0));    // 3 + 8 t
  std::tie(u, v) = motion(set, 0.5, Vec3(2, 0, 0), Compatibility::original);
  CHECK(u == Vec3(2.5, 0, 0));
  CHECK(v == Vec3(5, 0, 0));  // 3 + 4 t
}

TEST_CASE("prescribed motion: a quarter turn about a point") {
  // Rate pi/2 about (1, 0): the node at (2, 0) goes to (1, 1), moving towards -x.
  const auto set = displacement(TimeFunctionType::rotation, {pi / 2, 1, 0, 0}, 1, 3);
  const auto [u, v] = motion(set, 1);
  CHECK((u - Vec3(-1, 1, 0)).norm() < 4 * epsilon);
  CHECK((v - Vec3(-pi / 2, 0, 0)).norm() < 8 * epsilon);
}

TEST_CASE("prescribed motion: a turn about an axis in space") {
  // Half a turn about the diagonal of x and y through (0, 0, 1) swaps x and y and turns z over.
  auto set = displacement(TimeFunctionType::rotation, {pi, 0, 0, 1}, 1, 7);
  set.rotation_axis = Vec3(2, 2, 0);
  const auto [u, v] = motion(set, 1, Vec3(3, 1, 2));
  CHECK((Vec3(3, 1, 2) + u - Vec3(1, 3, 0)).norm() < 40 * epsilon);
  CHECK((v - pi * Vec3(1, 1, 0).normalized().cross(Vec3(1, 3, -1))).norm() < 80 * epsilon);
}

TEST_CASE("prescribed motion: velocities are the derivatives of the displacements") {
  const DisplacementSet sets[] = {
      displacement(TimeFunctionType::constant, {1}, 3),
      displacement(TimeFunctionType::linear, {1}, 3),
      displacement(TimeFunctionType::quadratic, {1, 4}, 3),
      displacement(TimeFunctionType::sin, {1, 2}, 3),
      displacement(TimeFunctionType::rotation, {1.3, 0.5, -1, 0}, 1, 7),
  };
  for (const DisplacementSet& set : sets)
    for (const Real t : {0.1, 0.7}) {
      constexpr Real dt = 1e-5;
      const Vec3 slope = (motion(set, t + dt).first - motion(set, t - dt).first) / (2 * dt);
      // dt^2 / 6 times a third derivative of up to 3 (2 pi)^3, and round-off by dt.
      CHECK((slope - motion(set, t).second).norm() < 1e-7);
    }
}

TEST_CASE("prescribed motion: tells the longest way of a node in one direction") {
  State state(3);
  DisplacementSet set = displacement(TimeFunctionType::linear, {1}, 3, 3);
  set.nodes = {0, 2};
  set.amplitude = {1, -4};
  const auto way = [&](Real t) {
    return prescribeDisplacements(state, std::span(&set, 1), t, Compatibility::corrected);
  };
  CHECK(way(0) == 0);
  CHECK(way(0.5) == 2);   // node 2 to -2
  CHECK(way(0.25) == 1);  // and back to -1
  CHECK(way(0.25) == 0);
}

TEST_CASE("prescribed motion: only the listed directions change") {
  State state(2);
  state.u[1] = state.v[1] = Vec3(7, 8, 9);
  state.x[1] = Vec3(7, 8, 9);
  const auto set = displacement(TimeFunctionType::linear, {1}, 3, direction_y);
  prescribeDisplacements(state, std::span(&set, 1), 2, Compatibility::corrected);
  CHECK(state.u[1] == Vec3(7, 6, 9));
  CHECK(state.v[1] == Vec3(7, 3, 9));
  CHECK(state.x[1] == Vec3(7, 6, 9));
}

TEST_CASE("prescribed motion: zero displacement holds a node whatever the time function") {
  auto set = displacement(TimeFunctionType::linear, {1}, 3, 3);
  set.zero_displacement = true;
  const auto [u, v] = motion(set, 2);
  CHECK(u == Vec3(0, 0, 0));
  CHECK(v == Vec3(0, 0, 0));
}

namespace {

// Counts its calls and gives (t, 2 t, 3 t) plus the number of the node.
NodeFunction growing(int* calls = nullptr) {
  NodeFunction function;
  function.evaluate = [calls](Real t, std::span<Vec3> values) {
    if (calls != nullptr) ++*calls;
    for (std::size_t k = 0; k < values.size(); ++k)
      values[k] = Vec3(t, 2 * t, 3 * t) + Vec3::Constant(static_cast<Real>(k));
  };
  return function;
}

}  // namespace

TEST_CASE("functions from outside: a force set takes their values times its amplitude") {
  State state(3);
  ForceSet set;
  set.nodes = {2, 0};
  set.amplitude = {4, -1};
  set.directions = direction_x | direction_z;
  set.density = growing();
  std::vector<ForceSet> sets = {set};
  evaluateFunctions(std::span<ForceSet>(sets), 0.5);
  addExternalForces(state, Vec3::Zero(), sets, 7, 1);  // the time of the values is that above
  CHECK(state.f[2] == Vec3(2, 0, 6));                  // 4 (0.5, -, 1.5)
  CHECK(state.f[1] == Vec3(0, 0, 0));
  CHECK(state.f[0] == Vec3(-1.5, 0, -2.5));  // -(0.5 + 1, -, 1.5 + 1)
}

TEST_CASE("functions from outside: displacement, velocity, and the one from the other") {
  auto set = displacement(TimeFunctionType::constant, {1}, 2, direction_x | direction_y);
  State state(3);
  const auto prescribe = [&](Real t, Real dt) {
    std::vector<DisplacementSet> sets = {set};
    evaluateFunctions(std::span<DisplacementSet>(sets), t);
    return prescribeDisplacements(state, sets, t, Compatibility::corrected, dt);
  };
  set.displacement = growing();
  prescribe(0.5, 0);
  CHECK(state.u[1] == Vec3(1, 2, 0));  // 2 (t, 2 t)
  CHECK(state.v[1] == Vec3(0, 0, 0));  // not known yet
  CHECK(prescribe(0.75, 0.25) == 1);
  CHECK(state.v[1] == Vec3(2, 4, 0));  // (1.5 - 1) / 0.25, (3 - 2) / 0.25
  set.velocity = growing();
  prescribe(1, 0.25);
  CHECK(state.u[1] == Vec3(2, 4, 0));
  CHECK(state.v[1] == Vec3(2, 4, 0));  // 2 (t, 2 t)
  set.displacement = {};
  prescribe(1.5, 0.5);
  CHECK(state.v[1] == Vec3(3, 6, 0));
  CHECK(state.u[1] == Vec3(3.5, 7, 0));  // 2 + 0.5 * 3, 4 + 0.5 * 6
  CHECK(state.x[1] == state.x_ref[1] + state.u[1]);
}

TEST_CASE("initial velocity: every node of the listed bodies") {
  std::vector<Particle> bodies(3);
  for (Index id = 0; id < 3; ++id) {
    auto& body = bodies[static_cast<std::size_t>(id)];
    body.id = id;
    body.start = 2 * id;
    body.stop = body.start + 2;
  }
  State state(6);
  const InitialVelocity velocity{{0, 2}, Vec3(1, 2, 3)};
  applyInitialVelocity(state, bodies, std::span(&velocity, 1));
  for (std::size_t i = 0; i < 6; ++i)
    CHECK(state.v[i] == (i / 2 == 1 ? Vec3(0, 0, 0) : Vec3(1, 2, 3)));
}

TEST_CASE("initial velocity: a spin is about the centre of mass") {
  std::vector<Particle> bodies(1);
  bodies[0].stop = 3;
  State state(3);
  state.x_ref = {Vec3(1, 0, 0), Vec3(3, 0, 0), Vec3(2, 6, 0)};
  state.volume = {1, 1, 2};  // centre (2, 3, 0)
  const InitialVelocity velocity{{0}, Vec3(10, 0, 0), Vec3(0, 0, 2)};
  applyInitialVelocity(state, bodies, std::span(&velocity, 1));
  CHECK(state.v[0] == Vec3(16, -2, 0));  // 2 e_z x (-1, -3, 0) = (6, -2, 0)
  CHECK(state.v[1] == Vec3(16, 2, 0));
  CHECK(state.v[2] == Vec3(4, 0, 0));
}

TEST_CASE("load sets: nodes that do not exist and missing parameters are refused") {
  const auto good = displacement(TimeFunctionType::quadratic, {1, 2}, 1);
  CHECK_NOTHROW(validate(good, 2));
  CHECK(contains(messageOf([&] { validate(good, 1); }), "node 1"));
  auto bad = good;
  bad.nodes = {-1};
  CHECK_THROWS_AS(validate(bad, 2), InputError);
  bad = good;
  bad.amplitude = {1, 2};
  CHECK(contains(messageOf([&] { validate(bad, 2); }), "amplitude"));
  bad = good;
  bad.time_function.parameters = {1};
  CHECK(contains(messageOf([&] { validate(bad, 2); }), "2 parameters"));
  for (const std::uint8_t directions : {std::uint8_t{0}, std::uint8_t{8}}) {
    bad = good;
    bad.directions = directions;
    CHECK_THROWS_AS(validate(bad, 2), InputError);
  }
  bad = good;
  bad.rotation_axis = Vec3::Zero();
  CHECK(contains(messageOf([&] { validate(bad, 2); }), "axis"));
}

TEST_CASE("load sets: every time function asks for its parameters") {
  for (const auto& [type, needed] : {std::pair(TimeFunctionType::constant, 1),
                                     {TimeFunctionType::linear, 1},
                                     {TimeFunctionType::sin, 2},
                                     {TimeFunctionType::linear_step, 3},
                                     {TimeFunctionType::linear_slow_fast, 4}}) {
    ForceSet set;
    set.nodes = {0};
    set.amplitude = {1};
    set.directions = direction_x;
    set.time_function = timeFunction(type, std::vector<Real>(static_cast<std::size_t>(needed), 1));
    CHECK_NOTHROW(validate(set, 1));
    set.time_function.parameters.pop_back();
    CHECK_THROWS_AS(validate(set, 1), InputError);
  }
}
