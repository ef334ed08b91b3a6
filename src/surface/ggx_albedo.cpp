#include "surface/ggx_albedo.hpp"

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "bsdf.glsl"
}  // namespace cumulet::core

namespace cumulet::surface {

namespace {

glm::vec2 ggx_albedo(float roughness, float cosine) {
  constexpr int strata = 16;
  const float alpha = core::cm_alpha(roughness);
  const glm::vec3 wo(std::sqrt(1.0F - cosine * cosine), 0.0F, cosine);
  const float masking = 1.0F + core::cm_ggx_lambda(alpha, wo);
  glm::vec2 sum(0.0F);
  for (int i = 0; i < strata; ++i) {
    for (int j = 0; j < strata; ++j) {
      const float u0 = (static_cast<float>(i) + 0.5F) / strata;
      const float u1 = (static_cast<float>(j) + 0.5F) / strata;
      const glm::vec3 h = core::cm_ggx_visible_normal(alpha, wo, u0, u1);
      const glm::vec3 wi = h * (2.0F * glm::dot(wo, h)) - wo;
      if (wi.z <= 0.0F) continue;
      const float weight = masking / (masking + core::cm_ggx_lambda(alpha, wi));
      const float schlick = core::cm_schlick(glm::dot(wo, h));
      sum += glm::vec2(weight * (1.0F - schlick), weight * schlick);
    }
  }
  return sum * (1.0F / (strata * strata));
}

}  // namespace

std::vector<glm::vec2> make_ggx_albedo_table(int size) {
  std::vector<glm::vec2> table;
  table.reserve(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  for (int j = 0; j < size; ++j) {
    for (int i = 0; i < size; ++i) {
      const float roughness = size > 1 ? static_cast<float>(j) / static_cast<float>(size - 1) : 0.5F;
      table.push_back(ggx_albedo(roughness, (static_cast<float>(i) + 0.5F) / static_cast<float>(size)));
    }
  }
  return table;
}

}  // namespace cumulet::surface
