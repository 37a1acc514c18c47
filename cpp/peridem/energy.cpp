#include "energy.h"

#include <cstring>

#include "bond_energy.h"
#include "external.h"
#include "node_sums.h"

namespace peridem {

namespace {

// How the directions of a node move.
class Motion {
 public:
  explicit Motion(const EnergyScene& scene)
      : scene_(scene), verlet_(scene.deck.time_scheme == TimeScheme::velocity_verlet) {}

  bool isFree(std::size_t i, int d) const {
    return d < scene_.deck.dimension && !((scene_.locked[i] >> d) & 1);
  }
  bool isDriven(std::size_t i, int d) const { return (scene_.state.fixity[i] >> d) & 1; }

  // v_{n-1/2} v_{n+1/2} of one direction: v is v_n with velocity Verlet, else v_{n-1/2}.
  Real squaredSpeed(std::size_t i, int d) const {
    const Real v = scene_.state.v[i][d];
    if (!isFree(i, d)) return isDriven(i, d) ? v * v : 0;
    const Real gain = scene_.deck.timeStep() * scene_.state.f[i][d] / scene_.state.density[i];
    return verlet_ ? v * v - gain * gain / 4 : v * (v + gain);
  }

  // v_{n+1/2}, by which the next step moves the node unless it is driven.
  Vec3 nextVelocity(std::size_t i) const {
    Vec3 next = Vec3::Zero();
    const Real k = scene_.deck.timeStep() * (verlet_ ? 0.5 : 1);
    for (int d = 0; d < 3; ++d) {
      if (isFree(i, d))
        next[d] = scene_.state.v[i][d] + k * scene_.state.f[i][d] / scene_.state.density[i];
      else if (isDriven(i, d))
        next[d] = scene_.state.v[i][d];
    }
    return next;
  }

 private:
  const EnergyScene& scene_;
  bool verlet_;
};

// In the original the material of body 0 decides whether state-based bonds dilate.
bool dilates(const EnergyScene& scene) {
  return scene.deck.compatibility != Compatibility::original ||
         std::holds_alternative<Lps>(scene.bodies.front().law);
}

std::vector<BondEnergy> bondEnergies(const EnergyScene& scene) {
  std::vector<BondEnergy> of_bodies;
  of_bodies.reserve(scene.bodies.size());
  for (const Particle& body : scene.bodies)
    of_bodies.emplace_back(scene.state, scene.bonds, body,
                           scene.influences[static_cast<std::size_t>(body.id)], dilates(scene));
  return of_bodies;
}

const Particle& bodyOf(const EnergyScene& scene, std::size_t i) {
  return scene.bodies[static_cast<std::size_t>(scene.state.particle_id[i])];
}

}  // namespace

Energies energies(const EnergyScene& scene) {
  const State& s = scene.state;
  const Motion motion(scene);
  const auto of_bodies = bondEnergies(scene);
  const auto u = [&](Index i) -> const Vec3& { return s.u[static_cast<std::size_t>(i)]; };
  const auto sums = sumOverNodes<4>(s.size(), scene.threads, [&](std::size_t i, auto& sum) {
    const Real mass = s.density[i] * s.volume[i];
    for (int d = 0; d < 3; ++d) sum[0] += 0.5 * mass * motion.squaredSpeed(i, d);
    sum[1] -= mass * scene.deck.gravity.dot(s.u[i]);
    const Particle& body = bodyOf(scene, i);
    if (body.constrained) return;  // no internal forces
    const NodeEnergy node = of_bodies[static_cast<std::size_t>(body.id)].at(
        static_cast<Index>(i), scene.bonds.intact.data(), u);
    sum[2] += node.bonds;
    sum[3] += node.self_contact;
  });
  const ContactEnergy contact = scene.contact.energy(s, scene.bodies);
  return {sums[0], sums[2], sums[3], contact.normal, contact.tangential, sums[1]};
}

std::vector<Eigen::Matrix3d> bondVirials(const EnergyScene& scene) {
  const auto of_bodies = bondEnergies(scene);
  std::vector<Eigen::Matrix3d> virials(scene.state.size(), Eigen::Matrix3d::Zero());
  std::vector<Real> theta;
  for (const Particle& body : scene.bodies) {
    if (body.constrained) continue;
    const BondEnergy& of_body = of_bodies[static_cast<std::size_t>(body.id)];
    theta.resize(static_cast<std::size_t>(body.nodes()));
#pragma omp parallel for num_threads(scene.threads) if (body.nodes() > 1000)
    for (Index i = body.start; i < body.stop; ++i)
      theta[static_cast<std::size_t>(i - body.start)] = of_body.dilatation(i);
#pragma omp parallel for num_threads(scene.threads) if (body.nodes() > 1000)
    for (Index i = body.start; i < body.stop; ++i)
      virials[static_cast<std::size_t>(i)] = of_body.virial(i, theta);
  }
  return virials;
}

void EnergyTracker::begin(const EnergyScene& scene, ContactParts contact) {
  flows_ = {};
  const Energies now = energies(scene);
  flows_.start = now.sum();
  flows_.tangential_start = now.tangential;
  prescribed_works_.assign(scene.bodies.size(), 0);
  forces_.contact = std::move(contact);
  setForceSets(scene);
  noteFlags(scene);
}

void EnergyTracker::restore(const EnergyScene& scene, const EnergyFlows& flows, Forces forces,
                            std::vector<Real> prescribed_works) {
  flows_ = flows;
  forces_ = std::move(forces);
  prescribed_works_ = std::move(prescribed_works);
  noteFlags(scene);
}

void EnergyTracker::noteFlags(const EnergyScene& scene) {
  intact_ = scene.bonds.intact;
  driven_.clear();
  driven_ranges_.clear();
  for (const Particle& body : scene.bodies) {
    const std::size_t begin = driven_.size();
    for (Index i = body.start; i < body.stop; ++i)
      if (scene.state.fixity[static_cast<std::size_t>(i)] != 0) driven_.push_back(i);
    if (driven_.size() > begin)
      driven_ranges_.push_back({static_cast<std::size_t>(body.id), begin, driven_.size()});
  }
}

void EnergyTracker::setForceSets(const EnergyScene& scene) {
  forces_.sets.assign(scene.state.size(), Vec3::Zero());
  addForceSets(forces_.sets, scene.force_sets, scene.time);
}

void EnergyTracker::beforeStep(const EnergyScene& scene) {
  const State& s = scene.state;
  u_before_ = s.u;
  v_before_.clear();
  f_before_.clear();
  for (const Index i : driven_) {
    v_before_.push_back(s.v[static_cast<std::size_t>(i)]);
    f_before_.push_back(s.f[static_cast<std::size_t>(i)]);
  }
  std::swap(forces_, forces_before_);
  forces_.contact.friction.assign(s.size(), Vec3::Zero());
  forces_.contact.damping.assign(s.size(), Vec3::Zero());
}

void EnergyTracker::afterStep(const EnergyScene& scene) {
  setForceSets(scene);
  addWork(scene);
  addPrescribedWork(scene);
  addFracture(scene);
}

// sum of 1/2 V (f_n + f_{n+1}) . dx of one kind of force
void EnergyTracker::addWork(const EnergyScene& scene) {
  const State& s = scene.state;
  const auto sums = sumOverNodes<3>(s.size(), scene.threads, [&](std::size_t i, auto& sum) {
    const Vec3 way = 0.5 * s.volume[i] * (s.u[i] - u_before_[i]);
    sum[0] += way.dot(forces_before_.contact.friction[i] + forces_.contact.friction[i]);
    sum[1] += way.dot(forces_before_.contact.damping[i] + forces_.contact.damping[i]);
    sum[2] += way.dot(forces_before_.sets[i] + forces_.sets[i]);
  });
  flows_.friction -= sums[0];
  flows_.damping -= sums[1];
  flows_.work_forces += sums[2];
}

// The same of what drives a node: the force that its mass times acceleration wants besides f.
void EnergyTracker::addPrescribedWork(const EnergyScene& scene) {
  const State& s = scene.state;
  for (const DrivenRange& range : driven_ranges_) {
    const auto add = [&](std::size_t row, auto& sum) {
      const std::size_t k = range.begin + row;
      const auto i = static_cast<std::size_t>(driven_[k]);
      const Vec3 way = s.u[i] - u_before_[i];
      for (int d = 0; d < 3; ++d) {
        if (!((s.fixity[i] >> d) & 1)) continue;
        const Real v = s.v[i][d], before = v_before_[k][d];
        sum[0] +=
            0.5 * s.volume[i] *
            (s.density[i] * (v * v - before * before) - (f_before_[k][d] + s.f[i][d]) * way[d]);
      }
    };
    const Real work = sumOverNodes<1>(range.end - range.begin, scene.threads, add)[0];
    prescribed_works_[range.body] += work;
    flows_.work_prescribed += work;
  }
}

// The nodes whose bonds broke in this step, with their old and new flags in the middle of it. The
// springs of broken bonds act from this evaluation on in state-based bodies, from the next one on
// in the others: they begin in the middle of this step or the next.
void EnergyTracker::addFracture(const EnergyScene& scene) {
  const State& s = scene.state;
  const auto of_bodies = bondEnergies(scene);
  const Motion motion(scene);
  const auto middle = [&](Index i) -> Vec3 {
    const auto node = static_cast<std::size_t>(i);
    return s.u[node] - 0.5 * (s.u[node] - u_before_[node]);
  };
  const auto next = [&](Index i) -> Vec3 {
    const auto node = static_cast<std::size_t>(i);
    return s.u[node] + 0.5 * scene.deck.timeStep() * motion.nextVelocity(node);
  };
  const std::uint8_t* now = scene.bonds.intact.data();
  const auto sums = sumOverNodes<2>(s.size(), scene.threads, [&](std::size_t node, auto& sum) {
    const auto i = static_cast<Index>(node);
    const std::size_t begin = scene.bonds.begin(i), end = scene.bonds.end(i);
    if (begin == end || std::memcmp(now + begin, intact_.data() + begin, end - begin) == 0) return;
    const Particle& body = bodyOf(scene, node);
    if (body.constrained) return;
    const BondEnergy& of_body = of_bodies[static_cast<std::size_t>(body.id)];
    sum[0] += of_body.at(i, intact_.data(), middle).bonds - of_body.at(i, now, middle).bonds;
    const bool at_once = std::holds_alternative<Lps>(body.law);
    const auto springs = [&](const std::uint8_t* flags) {
      return (at_once ? of_body.at(i, flags, middle) : of_body.at(i, flags, next)).self_contact;
    };
    sum[1] += springs(now) - springs(intact_.data());
  });
  flows_.fracture += sums[0];
  flows_.created += sums[1];
  intact_ = scene.bonds.intact;
}

}  // namespace peridem
