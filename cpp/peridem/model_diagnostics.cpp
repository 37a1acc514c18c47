// What a model tells about its state besides the arrays: contacts, energies.
#include <string>

#include "errors.h"
#include "model.h"

namespace peridem {

// The arrays may have been written since the last look.
void DEMModel::lookAtContacts() {
  init();
  contact_.noteAnyTravel();
  contact_.updateSearch(state_, bonds_, particles_, threads_);
}

std::vector<std::pair<Index, Index>> DEMModel::touchingNodes() {
  lookAtContacts();
  return contact_.touching(state_, particles_);
}

std::vector<NodeContact> DEMModel::nodeContacts() {
  lookAtContacts();
  return contact_.nodeContacts(state_, particles_);
}

std::vector<BodyDamping> DEMModel::bodyDampings() {
  lookAtContacts();
  return contact_.bodyDampings(state_, particles_);
}

EnergyScene DEMModel::energyScene() const {
  return {deck_,    state_,      bonds_,  particles_, influences_,
          contact_, force_sets_, locked_, time_,      threads_};
}

void DEMModel::trackEnergy(bool on) {
  const bool begins = on && !tracks_energy_;
  tracks_energy_ = on;
  if (begins && started_) beginEnergy();
}

void DEMModel::beginEnergy() {
  lookAtContacts();
  const std::vector<Vec3> none(state_.size(), Vec3::Zero());
  ContactParts parts{none, none};
  std::vector<Vec3> f = none;
  contact_.compute(state_, particles_, 0, f, threads_, &parts);
  energy_.begin(energyScene(), std::move(parts));
}

void DEMModel::restoreEnergy(const EnergyFlows& flows, EnergyTracker::Forces forces,
                             std::vector<Real> prescribed_works) {
  for (const auto* part : {&forces.contact.friction, &forces.contact.damping, &forces.sets})
    if (part->size() != state_.size())
      throw InputError("restoreEnergy: " + std::to_string(part->size()) + " forces for " +
                       std::to_string(state_.size()) + " nodes");
  if (prescribed_works.size() != particles_.size())
    throw InputError("restoreEnergy: " + std::to_string(prescribed_works.size()) + " works for " +
                     std::to_string(particles_.size()) + " bodies");
  if (!started_) throw InputError("restoreEnergy: the model has not started; call restore first");
  energy_.restore(energyScene(), flows, std::move(forces), std::move(prescribed_works));
  tracks_energy_ = true;
}

Energies DEMModel::energies() {
  start();
  lookAtContacts();
  return peridem::energies(energyScene());
}

std::vector<Eigen::Matrix3d> DEMModel::bondVirials() {
  init();
  return peridem::bondVirials(energyScene());
}

}  // namespace peridem
