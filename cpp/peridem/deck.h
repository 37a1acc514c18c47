// What a model is made of: plain structs, already read and checked for form.
// Values that the user may leave out are NaN (see isGiven). SI units; in 2D per unit thickness.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "types.h"

namespace peridem {

enum class Compatibility { corrected, original };
enum class TimeScheme { central_difference, velocity_verlet };
enum class MaterialType { pd_state, pmb_bond, rnp_bond, pd_elastic_bond };
enum class BondBreaking { both, tension };  // break in tension and compression, or tension only
enum class InfluenceType { constant, linear, gaussian };
enum class CellType { none, line, triangle, quad, tetra };
enum class DampingCriterion { centers, nodes };
// Friction from the direction of the slip alone, or with a tangential spring (Cundall, Strack 1979)
enum class FrictionModel { slip, history };

// Reference mesh of a zone.
struct Mesh {
  std::vector<Vec3> points;
  CellType cell_type = CellType::none;
  std::vector<Index> cells;   // node numbers, nodesPerCell(cell_type) per cell
  std::vector<Real> volumes;  // nodal volumes; empty: computed from the cells
};

struct InfluenceDeck {
  InfluenceType type = InfluenceType::constant;
  std::vector<Real> parameters;
};

struct MaterialDeck {
  MaterialType type = MaterialType::pd_state;
  Real density = not_given;
  Real horizon = not_given;
  Real horizon_mesh_ratio = not_given;
  Real youngs_modulus = not_given;
  Real bulk_modulus = not_given;
  Real shear_modulus = not_given;
  Real poisson_ratio = not_given;
  Real fracture_energy = not_given;         // Gc [J/m^2]
  Real critical_stress_factor = not_given;  // KIc [Pa m^0.5]
  std::vector<Real> law_parameters;         // constants of the law, when given directly
  BondBreaking bond_breaking = BondBreaking::both;
  bool irreversible_fracture = true;  // RNPBond: bonds break at all
  Real check_sc_factor = 1.0;         // RNPBond: breaks at this multiple of sc
  InfluenceDeck influence;
};

struct ZoneDeck {
  std::string name;
  bool is_wall = false;
  bool all_dofs_constrained = false;
  Index mesh = 0;
  Vec3 center = Vec3::Zero();  // centre of the shape, on the reference mesh
  Real bounding_radius = 0;    // of the shape, on the reference mesh
  MaterialDeck material;
};

// X = site + scale R(angle about axis) X_mesh
struct BodyDeck {
  Index zone = 0;
  Vec3 site = Vec3::Zero();
  Vec3 axis = Vec3(0, 0, 1);
  Real angle = 0;
  Real scale = 1;
  bool constrained = false;  // never moved, in addition to the zone's all_dofs_constrained
};

// Contact between the bodies of two zones.
struct ContactDeck {
  Real contact_radius = not_given;         // Rc, or
  Real contact_radius_factor = not_given;  // Rc = factor * h_min; neither: 0.95 h_min
  Real kn = not_given;                     // not given: 18 kappa_eff / (pi eps^5)
  Real kn_factor = 1.0;
  bool damping_on = true;
  Real epsilon = 1.0;
  Real beta_n_factor = 1.0;
  bool friction_on = true;
  Real friction_coeff = 0.0;
  DampingCriterion center_damping_criterion = DampingCriterion::centers;
  bool node_damping = false;
  FrictionModel friction_model = FrictionModel::slip;
  Real tangential_stiffness_ratio = 2.0 / 7.0;  // kt / Kn of the friction with history
  bool self_contact = false;  // pair (i, i): also between nodes of one body never bonded together
};

enum class TimeFunctionType {
  constant,
  linear,
  quadratic,
  sin,
  rotation,
  linear_step,
  linear_slow_fast
};

struct TimeFunction {
  TimeFunctionType type = TimeFunctionType::constant;
  std::vector<Real> parameters;
};

enum DirectionBits : std::uint8_t { direction_x = 1, direction_y = 2, direction_z = 4 };

// A function of time from outside the core: `evaluate` sets one value for each node of a load set.
// The model calls it once per step, before the step changes anything; it may throw.
struct NodeFunction {
  std::function<void(Real t, std::span<Vec3> values)> evaluate;
  std::vector<Vec3> values;  // at the time it was evaluated last

  bool isGiven() const { return static_cast<bool>(evaluate); }
};

// Prescribed motion of some nodes. amplitude[k] multiplies the time function at nodes[k].
struct DisplacementSet {
  std::vector<Index> nodes;
  std::vector<Real> amplitude;
  std::uint8_t directions = 0;
  TimeFunction time_function;
  Vec3 rotation_axis = Vec3(0, 0, 1);
  bool zero_displacement = false;  // only fix the directions
  // Instead of the time function. The one that is left out follows from the other step by step.
  NodeFunction displacement, velocity;
};

// Force density [N/m^3] on some nodes.
struct ForceSet {
  std::vector<Index> nodes;
  std::vector<Real> amplitude;
  std::uint8_t directions = 0;
  TimeFunction time_function;
  NodeFunction density;  // instead of the time function
};

// v = velocity + spin x (X - X_c) with the centre of mass X_c of each body.
struct InitialVelocity {
  std::vector<Index> bodies;
  Vec3 velocity = Vec3::Zero();
  Vec3 spin = Vec3::Zero();  // [rad/s]
};

struct ModelDeck {
  int dimension = 2;
  Real final_time = 0;
  Offset time_steps = 0;
  TimeScheme time_scheme = TimeScheme::central_difference;
  Compatibility compatibility = Compatibility::corrected;
  Vec3 gravity = Vec3::Zero();
  std::vector<Mesh> meshes;
  std::vector<ZoneDeck> zones;
  std::vector<BodyDeck> bodies;
  std::vector<ContactDeck> contacts;  // zones * zones, symmetric; empty when bodies never meet

  Real timeStep() const { return final_time / static_cast<Real>(time_steps); }
  const ContactDeck& contact(Index zone_i, Index zone_j) const {
    return contacts[static_cast<std::size_t>(zone_i) * zones.size() +
                    static_cast<std::size_t>(zone_j)];
  }
};

}  // namespace peridem
