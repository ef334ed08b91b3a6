#include "surface/sheen_albedo.hpp"

#include <cmath>
#include <numbers>

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "surface/sheen.glsl"
}  // namespace cumulet::core

namespace cumulet::surface {

namespace {

constexpr int size = core::CM_GGX_ALBEDO_SIZE;

float reflected(float roughness, float cosine) {
  constexpr int rings = 48;
  constexpr int sectors = 24;  // per half turn
  const float z = std::max(cosine, 1e-4F);
  const glm::vec3 wo(std::sqrt(1.0F - z * z), 0.0F, z);
  double sum = 0.0;
  for (int i = 0; i < rings; ++i) {
    // Stratified in the cosine's square root, because sheen is strongest at grazing angles.
    const float root = (static_cast<float>(i) + 0.5F) / rings;
    const float wi_z = root * root;
    const float sine = std::sqrt(1.0F - wi_z * wi_z);
    double ring = 0.0;
    for (int j = 0; j < sectors; ++j) {
      const float angle = std::numbers::pi_v<float> * (static_cast<float>(j) + 0.5F) / sectors;
      const glm::vec3 wi(sine * std::cos(angle), sine * std::sin(angle), wi_z);
      ring += double{core::cm_sheen(roughness, wo, wi, glm::normalize(wo + wi))};
    }
    sum += ring * 2.0 * double{root};
  }
  return static_cast<float>(sum * 2.0 * std::numbers::pi / (rings * sectors));
}

}  // namespace

const SheenAlbedo& SheenAlbedo::table() {
  static const SheenAlbedo made;
  return made;
}

SheenAlbedo::SheenAlbedo() {
  for (int row = 0; row < size; ++row) {
    const float roughness = static_cast<float>(row) / (size - 1);
    double average = 0.0;
    for (int column = 0; column < size; ++column) {
      const double root = static_cast<double>(column) / (size - 1);
      const float share = reflected(roughness, static_cast<float>(root * root));
      towards_.push_back(share);
      // 2 c E(c) over c = x^2: 4 x^3 E(x), by the trapezoid rule.
      average += 4.0 * root * root * root * double{share} * (column + 1 == size ? 0.5 : 1.0) / (size - 1);
    }
    averages_.push_back(static_cast<float>(average));
  }
}

float SheenAlbedo::at(int column, int row) const {
  return towards_[static_cast<std::size_t>(row) * size + static_cast<std::size_t>(column)];
}

float SheenAlbedo::towards(float roughness, float cosine) const {
  const glm::vec2 position = core::cm_ggx_albedo_position(roughness, cosine);
  const glm::ivec2 cell = glm::min(glm::ivec2(position), size - 2);
  const glm::vec2 f = position - glm::vec2(cell);
  const float low = glm::mix(at(cell.x, cell.y), at(cell.x + 1, cell.y), f.x);
  const float high = glm::mix(at(cell.x, cell.y + 1), at(cell.x + 1, cell.y + 1), f.x);
  return glm::mix(low, high, f.y);
}

float SheenAlbedo::average(float roughness) const {
  const float position = core::cm_ggx_albedo_position(roughness, 0.0F).y;
  const auto row = static_cast<std::size_t>(std::min(static_cast<int>(position), size - 2));
  return glm::mix(averages_[row], averages_[row + 1], position - static_cast<float>(row));
}

std::vector<glm::uvec4> SheenAlbedo::words() const {
  std::vector<glm::uvec4> words;
  for (int row = 0; row + 1 < size; ++row) {
    for (int column = 0; column + 1 < size; ++column) {
      words.push_back(glm::floatBitsToUint(
          glm::vec4(at(column, row), at(column + 1, row), at(column, row + 1), at(column + 1, row + 1))));
    }
  }
  for (std::size_t row = 0; row + 1 < averages_.size(); ++row) {
    words.push_back(glm::floatBitsToUint(glm::vec4(averages_[row], averages_[row + 1], 0.0F, 0.0F)));
  }
  return words;
}

}  // namespace cumulet::surface
