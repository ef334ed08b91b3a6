#pragma once

#include "viewer/viewer.hpp"

namespace cumulet::bench {

/// Surfaces inside these bounds, so that a camera fitted to the bounds sees all of them: hills below the volume and a
/// sphere in its center, about 200,000 triangles, half diffuse and half glossy.
scene::ModelSourcePtr surfaces_in(const viewer::Bounds& bounds);

}  // namespace cumulet::bench
