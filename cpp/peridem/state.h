// Arrays over all nodes of the model. Bodies own contiguous node ranges. The arrays are sized once,
// when the model is built, and never resized: views of them stay valid as long as the state lives.
#pragma once

#include <vector>

#include "huge_pages.h"
#include "types.h"

namespace peridem {

struct State {
  std::vector<Vec3> x_ref;            // X, reference position [m]
  std::vector<Vec3> x;                // current position [m]
  std::vector<Vec3> u;                // displacement [m]
  std::vector<Vec3> v;                // velocity [m/s]
  std::vector<Vec3> f;                // force density [N/m^3]
  std::vector<Real> volume;           // V, nodal volume [m^3], per unit thickness in 2D
  std::vector<Real> density;          // rho [kg/m^3]
  std::vector<Real> theta;            // dilatation
  std::vector<Real> weighted_volume;  // m = sum of r^2 J V_j [m^5], [m^4] in 2D
  std::vector<Real> damage_z;         // Z = max over bonds of |s| / s0
  std::vector<Index> particle_id;
  std::vector<Index> zone_id;
  std::vector<std::uint8_t> fixity;        // bit d set: direction d has a prescribed displacement
  std::vector<std::uint8_t> force_fixity;  // bit d set: direction d carries a force set

  explicit State(std::size_t n = 0)
      : x_ref(arrayInHugePages<Vec3>(n, Vec3::Zero())),
        x(arrayInHugePages<Vec3>(n, Vec3::Zero())),
        u(arrayInHugePages<Vec3>(n, Vec3::Zero())),
        v(arrayInHugePages<Vec3>(n, Vec3::Zero())),
        f(arrayInHugePages<Vec3>(n, Vec3::Zero())),
        volume(arrayInHugePages<Real>(n, 0)),
        density(n, 0),
        theta(arrayInHugePages<Real>(n, 0)),
        weighted_volume(n, 0),
        damage_z(n, 0),
        particle_id(n, 0),
        zone_id(n, 0),
        fixity(n, 0),
        force_fixity(n, 0) {}

  std::size_t size() const { return x.size(); }
};

}  // namespace peridem
