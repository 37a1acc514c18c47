// A body of the model: a particle or a wall, with its range of nodes.
#pragma once

#include <Eigen/Core>

#include "material.h"
#include "types.h"

namespace peridem {

struct Particle {
  Index id = 0;
  Index zone = 0;
  bool is_wall = false;
  bool constrained = false;  // never moved; no internal forces
  Index start = 0;           // nodes [start, stop)
  Index stop = 0;
  Index center_node = 0;  // mesh node nearest to the centre of the shape
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // of the reference mesh
  Real bounding_radius = 0;                                // R of the shape [m]
  Real mesh_size = 0;  // h, smallest distance between two nodes [m]
  Real horizon = 0;    // eps [m]
  Real volume = 0;     // sum of the nodal volumes
  Real density = 0;
  Real bulk_modulus = 0;         // K of the deck, for the contact damping [Pa]
  Real self_contact_radius = 0;  // 0.95 h
  Real self_contact_kn = 0;      // 18 K / (pi eps^5)
  Law law;

  Index nodes() const { return stop - start; }
};

}  // namespace peridem
