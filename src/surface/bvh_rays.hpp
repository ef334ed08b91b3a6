#pragma once

// Compiles glsl/surface/bvh.glsl as C++, so that CPU code traces the same rays over the same tree.

#include <cstring>

#include "base/shared_code.hpp"
#include "surface/bvh.hpp"

namespace cumulet::core {

/// cm_bvh_closest() and related functions over a tree, which must outlive this object. Triangles flagged `ask` are hit
/// like any other.
struct BvhRays {
  const surface::Bvh* bvh = nullptr;

  [[nodiscard]] uvec4 cm_bvh_node(uint texel) const { return texel_of(bvh->nodes().data(), texel); }
  [[nodiscard]] uvec4 cm_bvh_triangle(uint texel) const { return texel_of(bvh->records().data(), texel); }
  [[nodiscard]] static uvec4 texel_of(const void* texels, uint texel) {
    uvec4 words;
    std::memcpy(&words, static_cast<const unsigned char*>(texels) + std::size_t{texel} * sizeof words, sizeof words);
    return words;
  }
#include "surface/bvh.glsl"

  static_assert(CM_BVH_STACK == surface::Bvh::max_depth && CM_BVH_LEAF == surface::Bvh::leaf_bit);
  static_assert(CM_TRIANGLE_ASK == surface::TriangleFlags::ask &&
                CM_TRIANGLE_ONE_SIDED == surface::TriangleFlags::one_sided &&
                CM_TRIANGLE_CLOCKWISE == surface::TriangleFlags::clockwise &&
                CM_TRIANGLE_LEFT_OUT == surface::TriangleFlags::left_out &&
                CM_TRIANGLE_USER == surface::TriangleFlags::user);
};

}  // namespace cumulet::core
