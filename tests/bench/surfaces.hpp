#pragma once

#include "viewer/viewer.hpp"

namespace cumulet::bench {

/// Surfaces inside of these bounds, so that a camera fitted to them sees them all: hills under the volume and a sphere
/// in its middle, about 200,000 triangles, half diffuse and half glossy.
scene::ModelSourcePtr surfaces_in(const viewer::Bounds& bounds);

}  // namespace cumulet::bench
