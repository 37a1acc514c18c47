#include "external.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "errors.h"
#include "fuzzy.h"

namespace peridem {

namespace {

constexpr std::size_t nodes_worth_threads = 20000;

bool hasDirection(std::uint8_t directions, int d) {
  return (directions >> d) & 1;
}

// Grows with slope 1 for `rise`, rests for `rest`, and so on.
Real steps(Real t, Real rise, Real rest) {
  const Real period = rise + rest;
  const Real n = std::floor(t / period);
  return n * rise + std::min(t - n * period, rise);
}

}  // namespace

Real forceTimeFactor(const TimeFunction& function, Real t) {
  const auto& p = function.parameters;
  switch (function.type) {
    case TimeFunctionType::linear:
      return t;
    case TimeFunctionType::linear_step:
      return steps(t, p[1], p[2]);
    case TimeFunctionType::linear_slow_fast:
      return fuzzyGreater(t, p[1]) ? p[3] * t : p[2] * t;
    case TimeFunctionType::sin:
      return std::sin(pi * p[1] * t);
    case TimeFunctionType::constant:
    case TimeFunctionType::quadratic:
    case TimeFunctionType::rotation:
      break;
  }
  return 1;
}

namespace {

void evaluate(NodeFunction& function, std::size_t n_nodes, Real t) {
  if (!function.isGiven()) return;
  function.values.resize(n_nodes);
  function.evaluate(t, function.values);
}

}  // namespace

void evaluateFunctions(std::span<DisplacementSet> sets, Real t) {
  for (DisplacementSet& set : sets) {
    evaluate(set.displacement, set.nodes.size(), t);
    evaluate(set.velocity, set.nodes.size(), t);
  }
}

void evaluateFunctions(std::span<ForceSet> sets, Real t) {
  for (ForceSet& set : sets) evaluate(set.density, set.nodes.size(), t);
}

void addForceSets(std::vector<Vec3>& f, std::span<const ForceSet> sets, Real t) {
  for (const ForceSet& set : sets) {
    const bool outside = set.density.isGiven();
    const Vec3 factor = Vec3::Constant(outside ? 0 : forceTimeFactor(set.time_function, t));
    for (std::size_t k = 0; k < set.nodes.size(); ++k) {
      const Vec3& value = outside ? set.density.values[k] : factor;
      for (int d = 0; d < 3; ++d)
        if (hasDirection(set.directions, d))
          f[static_cast<std::size_t>(set.nodes[k])][d] += set.amplitude[k] * value[d];
    }
  }
}

void addExternalForces(State& state, const Vec3& gravity, std::span<const ForceSet> sets, Real t,
                       int threads) {
  if (gravity != Vec3::Zero()) {
    const std::size_t n = state.size();
#pragma omp parallel for num_threads(threads) schedule(static) if (n > nodes_worth_threads)
    for (std::size_t i = 0; i < n; ++i) state.f[i] += state.density[i] * gravity;
  }
  addForceSets(state.f, sets, t);
}

namespace {

struct Motion {
  Vec3 u, v;
};

// Rotation by T0 t about the point (T1, T2, T3): u = R dX - dX, v = T0 R' dX
class Rotation {
 public:
  Rotation(const DisplacementSet& set, Real t)
      : rate_(set.time_function.parameters[0]),
        point_(set.time_function.parameters[1], set.time_function.parameters[2],
               set.time_function.parameters[3]),
        axis_(set.rotation_axis.normalized()),
        rotation_(Eigen::AngleAxisd(rate_ * t, axis_).toRotationMatrix()) {}

  Motion at(const Vec3& x_ref) const {
    const Vec3 dx = x_ref - point_;
    const Vec3 rotated = rotation_ * dx;
    return {rotated - dx, rate_ * axis_.cross(rotated)};
  }

 private:
  Real rate_;
  Vec3 point_, axis_;
  Eigen::Matrix3d rotation_;
};

// Displacement and velocity of one direction for the amplitude a.
std::pair<Real, Real> translation(const TimeFunction& function, Real a, Real t,
                                  Compatibility mode) {
  const auto& p = function.parameters;
  switch (function.type) {
    case TimeFunctionType::linear:
      return {a * t, a};
    case TimeFunctionType::quadratic:
      // The original returns a + T1 t, which is not the derivative.
      return {a * t + p[1] * t * t, a + (mode == Compatibility::original ? 1 : 2) * p[1] * t};
    case TimeFunctionType::sin:
      return {a * std::sin(pi * p[1] * t), a * pi * p[1] * std::cos(pi * p[1] * t)};
    case TimeFunctionType::constant:
    case TimeFunctionType::rotation:
    case TimeFunctionType::linear_step:
    case TimeFunctionType::linear_slow_fast:
      break;
  }
  return {a, 0};
}

// Displacement and velocity from functions from outside, for the amplitude a. From the displacement
// alone follows v = (u - u_before) / dt, from the velocity alone u = u_before + dt v.
std::pair<Real, Real> fromOutside(const DisplacementSet& set, std::size_t k, int d, Real u_before,
                                  Real dt) {
  const Real a = set.amplitude[k];
  const bool has_u = set.displacement.isGiven(), has_v = set.velocity.isGiven();
  const Real given_u = has_u ? a * set.displacement.values[k][d] : 0;
  const Real given_v = has_v ? a * set.velocity.values[k][d] : 0;
  const Real u = has_u ? given_u : u_before + dt * given_v;
  const Real v = has_v ? given_v : dt > 0 ? (given_u - u_before) / dt : 0;
  return {u, v};
}

Real setDirection(State& state, std::size_t i, int d, Real u, Real v) {
  const Real before = state.x[i][d];
  state.u[i][d] = u;
  state.v[i][d] = v;
  state.x[i][d] = state.x_ref[i][d] + u;
  return std::abs(state.x[i][d] - before);
}

}  // namespace

Real prescribeDisplacements(State& state, std::span<const DisplacementSet> sets, Real t,
                            Compatibility mode, Real dt) {
  Real longest = 0;
  const auto set_direction = [&](std::size_t node, int d, Real u, Real v) {
    longest = std::max(longest, setDirection(state, node, d, u, v));
  };
  for (const DisplacementSet& set : sets) {
    if (set.zero_displacement) {
      for (const Index node : set.nodes)
        for (int d = 0; d < 3; ++d)
          if (hasDirection(set.directions, d))
            set_direction(static_cast<std::size_t>(node), d, 0, 0);
    } else if (set.displacement.isGiven() || set.velocity.isGiven()) {
      for (std::size_t k = 0; k < set.nodes.size(); ++k) {
        const auto i = static_cast<std::size_t>(set.nodes[k]);
        for (int d = 0; d < 3; ++d) {
          if (!hasDirection(set.directions, d)) continue;
          const auto [u, v] = fromOutside(set, k, d, state.u[i][d], dt);
          set_direction(i, d, u, v);
        }
      }
    } else if (set.time_function.type == TimeFunctionType::rotation) {
      const Rotation rotation(set, t);
      for (const Index node : set.nodes) {
        const auto i = static_cast<std::size_t>(node);
        const Motion motion = rotation.at(state.x_ref[i]);
        for (int d = 0; d < 3; ++d)
          if (hasDirection(set.directions, d)) set_direction(i, d, motion.u[d], motion.v[d]);
      }
    } else {
      for (std::size_t k = 0; k < set.nodes.size(); ++k) {
        const auto [u, v] = translation(set.time_function, set.amplitude[k], t, mode);
        for (int d = 0; d < 3; ++d)
          if (hasDirection(set.directions, d))
            set_direction(static_cast<std::size_t>(set.nodes[k]), d, u, v);
      }
    }
  }
  return longest;
}

namespace {

Vec3 centerOfMass(const State& state, const Particle& body) {
  Vec3 sum = Vec3::Zero();
  Real volume = 0;
  for (auto i = static_cast<std::size_t>(body.start); i < static_cast<std::size_t>(body.stop);
       ++i) {
    sum += state.volume[i] * state.x_ref[i];
    volume += state.volume[i];
  }
  return sum / volume;
}

}  // namespace

void applyInitialVelocity(State& state, const std::vector<Particle>& bodies,
                          std::span<const InitialVelocity> velocities) {
  for (const InitialVelocity& initial : velocities)
    for (const Index id : initial.bodies) {
      const Particle& body = bodies.at(static_cast<std::size_t>(id));
      const bool turns = initial.spin != Vec3::Zero();
      const Vec3 center = turns ? centerOfMass(state, body) : Vec3::Zero();
      for (auto i = static_cast<std::size_t>(body.start); i < static_cast<std::size_t>(body.stop);
           ++i) {
        state.v[i] = initial.velocity;
        if (turns) state.v[i] += initial.spin.cross(state.x_ref[i] - center);
      }
    }
}

namespace {

std::size_t parametersNeeded(TimeFunctionType type) {
  switch (type) {
    case TimeFunctionType::quadratic:
    case TimeFunctionType::sin:
      return 2;
    case TimeFunctionType::linear_step:
      return 3;
    case TimeFunctionType::rotation:
    case TimeFunctionType::linear_slow_fast:
      return 4;
    case TimeFunctionType::constant:
    case TimeFunctionType::linear:
      break;
  }
  return 1;
}

template <class Set>
void validateSet(const Set& set, std::size_t n_nodes, const char* name) {
  const std::string where = name;
  if (set.amplitude.size() != set.nodes.size())
    throw InputError(where + ": one amplitude per node is needed");
  for (const Index node : set.nodes)
    if (node < 0 || static_cast<std::size_t>(node) >= n_nodes)
      throw InputError(where + ": node " + std::to_string(node) + " does not exist");
  const std::size_t needed = parametersNeeded(set.time_function.type);
  if (set.time_function.parameters.size() < needed)
    throw InputError(where + ": the time function needs " + std::to_string(needed) + " parameters");
  const auto& p = set.time_function.parameters;
  if (set.time_function.type == TimeFunctionType::linear_step &&
      !(p[1] >= 0 && p[2] >= 0 && p[1] + p[2] > 0))
    throw InputError(where + ": linear_step needs times T1, T2 >= 0 with T1 + T2 > 0");
  if (set.directions == 0 || set.directions > 7)
    throw InputError(where + ": the directions are a set of x, y, z");
}

}  // namespace

void validate(const DisplacementSet& set, std::size_t n_nodes) {
  validateSet(set, n_nodes, "Displacement_BC");
  if (!(set.rotation_axis.norm() > 0))
    throw InputError("Displacement_BC: the rotation axis has no direction");
}

void validate(const ForceSet& set, std::size_t n_nodes) {
  validateSet(set, n_nodes, "Force_BC");
}

}  // namespace peridem
