// What ContactForce tells about the contacts of a state: forces between nodes, and their energy.
#include "contact.h"
#include "contact_pair.h"
#include "fuzzy.h"

namespace peridem {

template <class Visit>
void ContactForce::forEachContact(const State& state, const std::vector<Particle>& bodies,
                                  Visit visit) const {
  const auto& nodes = search_.nodes();
  const auto& candidates = search_.candidates();
  const auto body_of = [&](std::size_t i) -> const Particle& {
    return bodies[static_cast<std::size_t>(state.particle_id[i])];
  };
  for (std::size_t row = 0; row < nodes.size(); ++row) {
    const auto i = static_cast<std::size_t>(nodes[row]);
    for (auto k = static_cast<std::size_t>(candidates.offsets[row]);
         k < static_cast<std::size_t>(candidates.offsets[row + 1]); ++k) {
      const auto j = static_cast<std::size_t>(candidates.indices[k]);
      const ContactLaw& law = this->law(body_of(i), body_of(j));
      const Vec3 dx = state.x[j] - state.x[i];
      const Real distance = dx.norm();
      if (fuzzyLess(distance, law.radius)) visit(i, j, k, law, dx, distance);
    }
  }
}

std::vector<NodeContact> ContactForce::nodeContacts(const State& state,
                                                    const std::vector<Particle>& bodies) const {
  std::vector<NodeContact> contacts;
  forEachContact(
      state, bodies,
      [&](std::size_t i, std::size_t j, std::size_t k, const ContactLaw& law, const Vec3& dx,
          Real distance) {
        if (j < i) return;
        Vec3 elongation = any_history_ ? slips_[k] : Vec3::Zero();
        const PairForces pair = pairForces(law, state, i, j, dx, distance, 0, elongation);
        const Real volume = state.volume[i];
        contacts.push_back({static_cast<Index>(i), static_cast<Index>(j), volume * pair.normal,
                            volume * pair.friction, volume * pair.damping});
      });
  return contacts;
}

// U = 1/2 Kn V V' (Rc - d)^2 of the normal forces (17), 1/2 kt V V' |xi|^2 of the tangential
// springs, which either end of a pair has: half of each.
ContactEnergy ContactForce::energy(const State& state, const std::vector<Particle>& bodies) const {
  ContactEnergy energy;
  forEachContact(state, bodies,
                 [&](std::size_t i, std::size_t j, std::size_t k, const ContactLaw& law,
                     const Vec3&, Real distance) {
                   const Real volumes = state.volume[i] * state.volume[j];
                   const Real gap = law.radius - distance;
                   energy.normal += 0.25 * law.kn * volumes * gap * gap;
                   if (law.friction_history)
                     energy.tangential += 0.25 * law.kt * volumes * slips_[k].squaredNorm();
                 });
  return energy;
}

}  // namespace peridem
