#include "surface/ggx_albedo.hpp"

#include <glm/gtc/packing.hpp>

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "surface/ggx.glsl"
}  // namespace cumulet::core

namespace cumulet::surface {

namespace {

constexpr int size = core::CM_GGX_ALBEDO_SIZE;

glm::vec2 reflected(float roughness, float cosine) {
  constexpr int strata = 24;
  cosine = std::max(cosine, 1e-4F);
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

std::size_t index(int column, int row) {
  return static_cast<std::size_t>(row) * (size + 1) + static_cast<std::size_t>(column);
}

}  // namespace

int GgxAlbedo::width() { return size + 1; }
int GgxAlbedo::height() { return size; }

const GgxAlbedo& GgxAlbedo::table() {
  static const GgxAlbedo made;
  return made;
}

GgxAlbedo::GgxAlbedo() : texels_(static_cast<std::size_t>(width() * height())) {
  for (int row = 0; row < size; ++row) {
    const float roughness = static_cast<float>(row) / (size - 1);
    for (int column = 0; column < size; ++column) {
      const float root = static_cast<float>(column) / (size - 1);
      // Rounded to half precision, because shaders read halves.
      texels_[index(column, row)] = glm::unpackHalf2x16(glm::packHalf2x16(reflected(roughness, root * root)));
    }
    // The integral of 2 c E(c) over the cosine c = x^2, with E linear in x: 4 x^3 E per cell.
    glm::dvec2 sum(0.0);
    for (int column = 0; column + 1 < size; ++column) {
      const double a = static_cast<double>(column) / (size - 1);
      const double b = static_cast<double>(column + 1) / (size - 1);
      const double all = std::pow(b, 4.0) - std::pow(a, 4.0);             // integral of 4 x^3
      const double moment = 0.8 * (std::pow(b, 5.0) - std::pow(a, 5.0));  // integral of 4 x^4
      const double second = (moment - a * all) / (b - a);                 // weight of the cell's end
      sum += (all - second) * glm::dvec2(texels_[index(column, row)]) +
             second * glm::dvec2(texels_[index(column + 1, row)]);
    }
    texels_[index(size, row)] = glm::vec2(sum);
  }
}

glm::vec2 GgxAlbedo::towards(float roughness, float cosine) const {
  const glm::vec2 position = core::cm_ggx_albedo_position(roughness, cosine);
  const glm::ivec2 cell = glm::min(glm::ivec2(position), size - 2);
  const glm::vec2 f = position - glm::vec2(cell);
  const glm::vec2 low = glm::mix(texels_[index(cell.x, cell.y)], texels_[index(cell.x + 1, cell.y)], f.x);
  const glm::vec2 high = glm::mix(texels_[index(cell.x, cell.y + 1)], texels_[index(cell.x + 1, cell.y + 1)], f.x);
  return glm::mix(low, high, f.y);
}

glm::vec2 GgxAlbedo::average(float roughness) const {
  const float position = core::cm_ggx_albedo_position(roughness, 0.0F).y;
  const int row = std::min(static_cast<int>(position), size - 2);
  return glm::mix(texels_[index(size, row)], texels_[index(size, row + 1)], position - static_cast<float>(row));
}

std::vector<glm::uvec4> GgxAlbedo::cells() const {
  const auto word = [&](int column, int row) { return glm::packHalf2x16(texels_[index(column, row)]); };
  std::vector<glm::uvec4> words;
  for (int row = 0; row + 1 < size; ++row) {
    for (int column = 0; column + 1 < size; ++column) {
      words.emplace_back(word(column, row), word(column + 1, row), word(column, row + 1), word(column + 1, row + 1));
    }
  }
  return words;
}

std::vector<glm::uvec4> GgxAlbedo::average_cells() const {
  std::vector<glm::uvec4> words;
  for (int row = 0; row + 1 < size; ++row) {
    words.emplace_back(glm::packHalf2x16(texels_[index(size, row)]), glm::packHalf2x16(texels_[index(size, row + 1)]),
                       0U, 0U);
  }
  return words;
}

}  // namespace cumulet::surface
