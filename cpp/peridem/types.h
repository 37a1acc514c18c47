// Basic types shared by the whole core.
#pragma once

#include <Eigen/Core>

#include "real.h"

namespace peridem {

using Vec3 = Eigen::Vector3d;

}  // namespace peridem
