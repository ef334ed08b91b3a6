#pragma once

#include "base/parameters.hpp"

namespace cumulet::render {

/// The part of the parameter block that the caller sets. The rest follows from the data and settings of the picture.
struct PictureParameters {
  core::CmView view{};
  core::CmSpace space{};
  core::CmGrid grid{};
  core::CmEmissive emissive{};
  core::CmMedium medium{};
  core::CmLights lights{};
  core::CmEnvironment environment{};
  core::CmGround ground{};
  core::CmIntegrator integrator{};
  core::CmShutter shutter{};
  bool equiangular = false;  // NEE samples lights from points on the ray, too (equiangular sampling)
  bool operator==(const PictureParameters&) const = default;
};

}  // namespace cumulet::render
