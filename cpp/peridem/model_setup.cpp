// How DEMModel is built: its bodies, loads and laws.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "errors.h"
#include "mesh.h"
#include "model.h"
#include "stopwatch.h"

namespace peridem {

namespace {

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

}  // namespace peridem
