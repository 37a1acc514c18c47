// Nodal volumes, mesh size and centre node of a reference mesh or of a body.
#pragma once

#include <span>
#include <vector>

#include "deck.h"

namespace peridem {

int nodesPerCell(CellType type);

// V_i = sum over cells e containing i of the integral of phi_i over e   (Jha et al. 2021, eq. 31)
// with |signed volume|. Throws InputError when a cell index is out of range.
std::vector<Real> nodalVolumes(const Mesh& mesh);

// Smallest distance between two points, h (35). With `fuzzy`, the running fuzzy minimum of the
// original in node order, up to 1e-5 above. Throws InputError when two points coincide.
Real meshSize(std::span<const Vec3> points, bool fuzzy, int threads = 1);

// Smallest of the mesh sizes of the bodies, with the same meaning of `fuzzy`.
Real smallestMeshSize(std::span<const Real> sizes, bool fuzzy);

// Mesh node nearest to `center`, at most `bounding_radius` away (else node 0).
Index centerNode(std::span<const Vec3> points, const Vec3& center, Real bounding_radius,
                 bool fuzzy);

}  // namespace peridem
