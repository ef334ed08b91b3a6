#pragma once

#include "base/parameters.hpp"

namespace cumulet::render {

/// What a picture shall show, of the block: the rest follows from what it is made of, and from how.
struct PictureParameters {
  core::CmView view{};
  core::CmSpace space{};
  core::CmGrid grid{};
  core::CmGlow glow{};
  core::CmMedium medium{};
  core::CmLights lights{};
  core::CmEnvironment environment{};
  core::CmGround ground{};
  core::CmIntegrator integrator{};
  core::CmShutter shutter{};
  bool equiangular = false;  // lamps are looked for from points that flights have passed, too
  bool operator==(const PictureParameters&) const = default;
};

}  // namespace cumulet::render
