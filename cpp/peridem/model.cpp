#include "model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "errors.h"
#include "integrator.h"
#include "memory.h"
#include "mesh.h"

namespace peridem {

namespace {

// Adds the seconds of its own life to a counter.
class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds), start_(Clock::now()) {}
  ~Stopwatch() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  double& seconds_;
  Clock::time_point start_;
};

void validateDuration(Real final_time, Offset time_steps) {
  if (!(final_time > 0) || time_steps < 1)
    throw InputError("Model: Final_Time and Time_Steps must be positive");
}

void validate(const ModelDeck& deck) {
  if (deck.dimension < 1 || deck.dimension > 3) throw InputError("Model.Dimension: 1, 2 or 3");
  validateDuration(deck.final_time, deck.time_steps);
  for (const BodyDeck& body : deck.bodies) {
    if (body.zone < 0 || static_cast<std::size_t>(body.zone) >= deck.zones.size())
      throw InputError("body of zone " + std::to_string(body.zone) + ": no such zone");
    if (!(body.scale > 0)) throw InputError("body: the scale must be positive");
  }
  for (const ZoneDeck& zone : deck.zones) {
    if (zone.mesh < 0 || static_cast<std::size_t>(zone.mesh) >= deck.meshes.size())
      throw InputError(zone.name + ": no such mesh");
    if (!(zone.material.density > 0)) throw InputError(zone.name + ": density must be positive");
  }
  for (const Mesh& mesh : deck.meshes)
    if (!mesh.volumes.empty() && mesh.volumes.size() != mesh.points.size())
      throw InputError("mesh: " + std::to_string(mesh.volumes.size()) + " nodal volumes for " +
                       std::to_string(mesh.points.size()) + " nodes; give one for each node");
  if (deck.bodies.empty()) throw InputError("the model has no bodies");
}

std::size_t countNodes(const ModelDeck& deck) {
  std::size_t n = 0;
  for (const BodyDeck& body : deck.bodies)
    n += deck.meshes[static_cast<std::size_t>(deck.zones[static_cast<std::size_t>(body.zone)].mesh)]
             .points.size();
  return n;
}

}  // namespace

DEMModel::DEMModel(ModelDeck deck, int threads) : deck_(std::move(deck)), threads_(threads) {
  const Stopwatch watch(timings_.setup);
  if (threads < 1) throw InputError("threads must be at least 1");
  validate(deck_);
  std::vector<std::vector<Real>> volumes;
  for (const Mesh& mesh : deck_.meshes)
    volumes.push_back(mesh.volumes.empty() ? nodalVolumes(mesh) : mesh.volumes);
  const std::size_t n = countNodes(deck_);
  if (n > static_cast<std::size_t>(std::numeric_limits<Index>::max()))
    throw InputError("more nodes than a 32-bit index can count");
  state_ = State(n);
  particles_.reserve(deck_.bodies.size());
  for (const BodyDeck& body : deck_.bodies) {
    const ZoneDeck& zone = deck_.zones[static_cast<std::size_t>(body.zone)];
    placeBody(body, static_cast<Index>(particles_.size()),
              volumes[static_cast<std::size_t>(zone.mesh)]);
  }
}

// X = site + scale R(angle) X_mesh, V = V_mesh scale^d
void DEMModel::placeBody(const BodyDeck& body, Index id, const std::vector<Real>& mesh_volumes) {
  const ZoneDeck& zone = deck_.zones[static_cast<std::size_t>(body.zone)];
  const Mesh& mesh = deck_.meshes[static_cast<std::size_t>(zone.mesh)];
  const bool fuzzy = deck_.compatibility == Compatibility::original;
  Particle p;
  p.id = id;
  p.zone = body.zone;
  p.is_wall = zone.is_wall;
  p.constrained = zone.all_dofs_constrained || body.constrained;
  p.start = particles_.empty() ? 0 : particles_.back().stop;
  p.stop = p.start + static_cast<Index>(mesh.points.size());
  p.bounding_radius = body.scale * zone.bounding_radius;
  p.density = zone.material.density;
  p.center_node = p.start + centerNode(mesh.points, zone.center, zone.bounding_radius, fuzzy);

  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(body.angle, body.axis.normalized()).toRotationMatrix();
  p.rotation = rotation;
  const Real volume_scale = std::pow(body.scale, deck_.dimension);
  for (std::size_t k = 0; k < mesh.points.size(); ++k) {
    const std::size_t i = static_cast<std::size_t>(p.start) + k;
    state_.x_ref[i] = body.site + body.scale * (rotation * mesh.points[k]);
    state_.x[i] = state_.x_ref[i];
    state_.volume[i] = mesh_volumes[k] * volume_scale;
    state_.density[i] = p.density;
    state_.particle_id[i] = id;
    state_.zone_id[i] = body.zone;
    p.volume += state_.volume[i];
  }
  const std::span<const Vec3> points(state_.x_ref.data() + p.start, mesh.points.size());
  p.mesh_size = meshSize(points, fuzzy, threads_);
  p.horizon = isGiven(zone.material.horizon_mesh_ratio)
                  ? zone.material.horizon_mesh_ratio * p.mesh_size
                  : zone.material.horizon;
  if (!(p.horizon > 0)) throw InputError(zone.name + ": the horizon must be positive");
  particles_.push_back(std::move(p));
}

void DEMModel::addDisplacementSet(DisplacementSet set) {
  if (started_) throw InputError("displacement sets must be added before the first step");
  peridem::validate(set, state_.size());
  for (const Index node : set.nodes)
    state_.fixity[static_cast<std::size_t>(node)] |= set.directions;
  displacement_sets_.push_back(std::move(set));
}

void DEMModel::addForceSet(ForceSet set) {
  if (started_) throw InputError("force sets must be added before the first step");
  peridem::validate(set, state_.size());
  for (const Index node : set.nodes)
    state_.force_fixity[static_cast<std::size_t>(node)] |= set.directions;
  force_sets_.push_back(std::move(set));
}

void DEMModel::addInitialVelocity(InitialVelocity velocity) {
  if (started_) throw InputError("initial velocities must be added before the first step");
  for (const Index id : velocity.bodies)
    if (id < 0 || static_cast<std::size_t>(id) >= particles_.size())
      throw InputError("IC.Constant_Velocity: body " + std::to_string(id) + " does not exist");
  initial_velocities_.push_back(std::move(velocity));
}

void DEMModel::init() {
  if (initialized_) return;
  const Stopwatch watch(timings_.setup);
  const bool original = deck_.compatibility == Compatibility::original;
  for (Particle& body : particles_) {
    const ZoneDeck& zone = deck_.zones[static_cast<std::size_t>(body.zone)];
    // The original keeps one influence function for the whole run, that of the first zone.
    const ZoneDeck& influence_zone = original ? deck_.zones.front() : zone;
    const Influence influence(influence_zone.material.influence, deck_.dimension);
    body.law = makeLaw(zone.material, influence, body.horizon, deck_.dimension);
    const Real law_modulus = bulkModulusOfLaw(body.law, influence, body.horizon, deck_.dimension);
    body.bulk_modulus = bulkModulusOfDeck(zone.material, law_modulus);
    influences_.push_back(influence);
    body.self_contact_radius = 0.95 * body.mesh_size;
    body.self_contact_kn = 18 * law_modulus / (pi * std::pow(body.horizon, 5));
  }
  appendBonds(bonds_, state_, particles_, influences_, threads_);
  peridynamic_ = PeridynamicForce(state_, bonds_, particles_, influences_, deck_.dimension,
                                  deck_.compatibility, BlockSizes{}, threads_);
  contact_ = ContactForce(deck_, particles_);
  speed_limit_ = speedLimit();
  initialized_ = true;
}

void DEMModel::lockDirections() {
  locked_ = state_.fixity;
  for (const Particle& body : particles_)
    if (body.constrained)
      std::fill(locked_.begin() + body.start, locked_.begin() + body.stop, std::uint8_t{7});
  locked_bodies_.clear();
  for (const Particle& body : particles_)
    locked_bodies_.push_back(std::any_of(locked_.begin() + body.start, locked_.begin() + body.stop,
                                         [](std::uint8_t bits) { return bits != 0; }));
}

void DEMModel::start() {
  if (started_) return;
  init();
  lockDirections();
  applyInitialVelocity(state_, particles_, initial_velocities_);
  computeExternalDisplacementBC();
  computeForces();
  computeDamage();
  started_ = true;
  if (tracks_energy_) beginEnergy();
}

void DEMModel::run(const StepObserver& observer) {
  init();
  integrate(deck_.time_steps - n_, observer);
}

Offset DEMModel::integrate(Offset n, const StepObserver& observer) {
  start();
  contact_.noteAnyTravel();  // the arrays may have been written since the last step
  Offset taken = 0;
  while (taken < n) {
    advance();
    ++taken;
    if (observer && observer()) break;
  }
  computeDamage();
  return taken;
}

void DEMModel::step() {
  start();
  contact_.noteAnyTravel();
  advance();
}

void DEMModel::advance() {
  evaluateLoads(time_ + timeStep());  // may throw: nothing of the step has happened yet
  if (tracks_energy_) energy_.beforeStep(energyScene());
  if (deck_.time_scheme == TimeScheme::velocity_verlet)
    integrateVerlet();
  else
    integrateCD();
  if (tracks_energy_) energy_.afterStep(energyScene());
}

// v += k f / rho, u += dt v, x += dt v, t += dt, the prescribed motion, then the forces. The bodies
// move one by one, in the loop over the forces inside of them.
void DEMModel::moveAndComputeForces(Real k, Real dt) {
  ++n_;
  time_ += dt;
  const Real prescribed = computeExternalDisplacementBC(dt);
  Kick kicked;
  {
    const Stopwatch watch(timings_.peridynamic);
    kicked = peridynamic_.moveAndCompute({k, dt, speed_limit_, &locked_, &locked_bodies_}, state_,
                                         bonds_, particles_, deck_.gravity, threads_);
  }
  if (!kicked.within_limit || !(prescribed < speed_limit_ * dt)) reportRunaway(n_, time_);
  contact_.noteTravel(std::sqrt(deck_.dimension) * dt * kicked.fastest +
                      std::sqrt(3.0) * prescribed);
  computeContactForces(dt);
  addForceSets();
}

void DEMModel::integrateCD() {
  moveAndComputeForces(timeStep(), timeStep());
}

void DEMModel::integrateVerlet() {
  const Real dt = timeStep();
  moveAndComputeForces(dt / 2, dt);
  const Stopwatch watch(timings_.integration);
  if (!kick(state_, locked_, dt / 2, speed_limit_, deck_.dimension, threads_).within_limit)
    reportRunaway(n_, time_);
}

void DEMModel::computeForces() {
  init();
  evaluateLoads(time_);
  {
    const Stopwatch watch(timings_.peridynamic);
    peridynamic_.compute(state_, bonds_, particles_, deck_.gravity, threads_);
  }
  computeContactForces();
  addForceSets();
}

void DEMModel::computePeridynamicForces() {
  init();
  const Stopwatch watch(timings_.peridynamic);
  peridynamic_.compute(state_, bonds_, particles_, Vec3::Zero(), threads_);
  peridynamic_.computeDamage(state_, threads_);
}

void DEMModel::computeContactForces(Real slip_time) {
  {
    const Stopwatch watch(timings_.contact_search);
    contact_.updateSearch(state_, bonds_, particles_, threads_);
  }
  const Stopwatch watch(timings_.contact);
  ContactParts* parts = tracks_energy_ && slip_time > 0 ? &energy_.contactParts() : nullptr;
  contact_.compute(state_, particles_, slip_time, state_.f, threads_, parts);
}

std::vector<Vec3> DEMModel::contactForces() {
  init();
  contact_.updateSearch(state_, bonds_, particles_, threads_);
  std::vector<Vec3> f(state_.size(), Vec3::Zero());
  contact_.compute(state_, particles_, 0, f, threads_);
  return f;
}

void DEMModel::computeDamage() {
  const Stopwatch watch(timings_.peridynamic);
  peridynamic_.computeDamage(state_, threads_);
}

void DEMModel::setIntact(std::span<const std::uint8_t> intact) {
  init();
  if (intact.size() != bonds_.size())
    throw InputError("intact: " + std::to_string(intact.size()) + " flags for " +
                     std::to_string(bonds_.size()) + " bonds");
  for (Index i = 0; i < static_cast<Index>(state_.size()); ++i)
    for (std::size_t k = bonds_.begin(i); k < bonds_.end(i); ++k)
      if (intact[k] != intact[bonds_.find(bonds_.neighbors[k], i)])
        throw InputError("intact: the two directions of bond (" + std::to_string(i) + ", " +
                         std::to_string(bonds_.neighbors[k]) + ") differ");
  std::copy(intact.begin(), intact.end(), bonds_.intact.begin());
  peridynamic_.importFlags(bonds_, particles_);
}

std::vector<BondConstants> DEMModel::bondConstants() const {
  std::vector<BondConstants> constants;
  if (!initialized_) return constants;
  constants.reserve(bonds_.size());
  for (const Particle& body : particles_) {
    const Influence& influence = influences_[static_cast<std::size_t>(body.id)];
    for (Index i = body.start; i < body.stop; ++i)
      for (std::size_t k = bonds_.begin(i); k < bonds_.end(i); ++k)
        constants.push_back(
            peridem::bondConstants(state_, body, influence, i, bonds_.neighbors[k]));
  }
  return constants;
}

void DEMModel::restore(Offset n, Real time, const std::vector<SlipRecord>& slips) {
  init();
  lockDirections();
  contact_.updateSearch(state_, bonds_, particles_, threads_);
  contact_.setSlips(slips);
  n_ = n;
  time_ = time;
  started_ = true;
  if (tracks_energy_) beginEnergy();
}

void DEMModel::computeExternalForces() {
  evaluateLoads(time_);
  const Stopwatch watch(timings_.external);
  addExternalForces(state_, deck_.gravity, force_sets_, time_, threads_);
}

// Of the functions evaluated before anything changed.
void DEMModel::addForceSets() {
  const Stopwatch watch(timings_.external);
  addExternalForces(state_, Vec3::Zero(), force_sets_, time_, threads_);
}

Real DEMModel::computeExternalDisplacementBC(Real dt) {
  evaluateLoads(time_);
  const Stopwatch watch(timings_.external);
  return prescribeDisplacements(state_, displacement_sets_, time_, deck_.compatibility, dt);
}

// Once for each time, so once per step. A function that throws leaves the state as it is.
void DEMModel::evaluateLoads(Real t) {
  if (t == loads_time_) return;
  const Stopwatch watch(timings_.external);
  loads_time_ = -std::numeric_limits<Real>::infinity();
  evaluateFunctions(std::span<DisplacementSet>(displacement_sets_), t);
  evaluateFunctions(std::span<ForceSet>(force_sets_), t);
  loads_time_ = t;
}

void DEMModel::setDuration(Real final_time, Offset time_steps) {
  if (started_) throw InputError("the time step cannot change after the first step");
  validateDuration(final_time, time_steps);
  deck_.final_time = final_time;
  deck_.time_steps = time_steps;
  if (initialized_) speed_limit_ = speedLimit();
}

// A node that crosses its horizon within one step has left the physics: sound, the fastest motion,
// takes several steps for that in a stable run.
Real DEMModel::speedLimit() const {
  Real smallest = std::numeric_limits<Real>::infinity();
  for (const Particle& body : particles_) smallest = std::min(smallest, body.horizon);
  return smallest / timeStep();
}

void DEMModel::reportRunaway(Offset step, Real time) const {
  enum class Look { free_directions, all_directions };
  const auto first_beyond = [&](Look look) {
    std::size_t i = 0;
    for (; i < state_.size(); ++i)
      for (int d = 0; d < deck_.dimension; ++d) {
        const bool looked_at = look == Look::all_directions || !((locked_[i] >> d) & 1);
        if (looked_at && !(std::abs(state_.v[i][d]) < speed_limit_)) return i;
      }
    return i;
  };
  // A fast prescribed node is named only when no free one is beyond the limit.
  std::size_t i = first_beyond(Look::free_directions);
  if (i == state_.size()) i = first_beyond(Look::all_directions);
  i = std::min(i, state_.size() - 1);
  const Particle& body = particles_[static_cast<std::size_t>(state_.particle_id[i])];
  std::ostringstream text;
  text << "step " << step << " (t = " << time << " s): body " << body.id << ", node "
       << static_cast<Index>(i) - body.start << ": speed = " << state_.v[i].norm()
       << " m/s: must be finite and below " << speed_limit_
       << " m/s (one horizon in a step); use a smaller time step (dt = " << timeStep()
       << " s), or check loads, stiffnesses and overlapping bodies";
  throw NumericalError(text.str());
}

StableTimeStep DEMModel::stableTimeStep() const {
  if (!initialized_) throw InputError("stable time step: call init() first");
  return peridem::stableTimeStep(state_, bonds_, influences_, particles_, contact_, threads_);
}

std::size_t DEMModel::memoryBytes() const {
  const MemoryCosts costs;
  return state_.size() * costs.node + bonds_.size() * costs.bond + peridynamic_.bytes();
}

}  // namespace peridem
