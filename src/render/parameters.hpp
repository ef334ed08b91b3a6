#pragma once

// glsl/parameters.glsl as C++: the uniform block of every kernel that makes pictures.

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "parameters.glsl"
}  // namespace cumulet::core

namespace cumulet::render {

/// What a picture shall show, of the block: the rest follows from what it is made of, and from how.
struct PictureParameters {
  core::CmView view{};
  core::CmMedium medium{};
  core::CmLights lights{};
  core::CmIntegrator integrator{};
  bool operator==(const PictureParameters&) const = default;
};

}  // namespace cumulet::render
