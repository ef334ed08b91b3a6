#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace cumulet::surface {

/// What share of constant radiance from above a GGX lobe of glsl/bsdf.glsl reflects, f0 x + f90 y, by the two sums of
/// Karis, "Real Shading in Unreal Engine 4", SIGGRAPH 2013. size rows of size entries; entry (i, j) is for the cosine
/// (i + 0.5) / size of the view and the roughness j / (size - 1). The same on every call. O(size^2).
std::vector<glm::vec2> make_ggx_albedo_table(int size);

}  // namespace cumulet::surface
