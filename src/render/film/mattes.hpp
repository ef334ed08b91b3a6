#pragma once

#include <cstdint>
#include <vector>

namespace cumulet::render {

/// Rays per pixel for Cryptomatte, and its maximum number of ranks.
constexpr std::uint32_t matte_rays = 64;
constexpr std::uint32_t max_matte_ranks = 16;

/// Cryptomatte IDs (cryptomatte_id) of the visible objects; 0: in no matte. Volumes are in the order of Picked::volume,
/// and models in their own.
struct MatteIds {
  std::uint32_t ground = 0;
  std::vector<std::uint32_t> volumes;
  std::vector<std::uint32_t> models;
};

}  // namespace cumulet::render
