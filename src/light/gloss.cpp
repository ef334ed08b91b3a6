#include "light/gloss.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "ggx.glsl"
#include "gloss.glsl"
}  // namespace cumulet::core

namespace cumulet::light {

namespace {

using glm::vec3;

constexpr int width = core::CM_GLOSS_WIDTH;
constexpr int height = core::CM_GLOSS_HEIGHT;

vec3 direction(int x, int y, int columns, int rows) {
  const double azimuth = 2.0 * std::numbers::pi * (0.5 - (x + 0.5) / columns);
  const double down = std::numbers::pi * (y + 0.5) / rows;
  return {std::sin(down) * std::sin(azimuth), std::cos(down), std::sin(down) * std::cos(azimuth)};
}

/// A lobe that is looked at from above, over the sine of half the angle to its middle.
class Lobe {
 public:
  explicit Lobe(float roughness) {
    const float alpha = core::cm_alpha(roughness);
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      const float half_sine = static_cast<float>(i) / (entries - 1);
      const float cosine = 1.0F - 2.0F * half_sine * half_sine;
      if (cosine <= 0.0F) continue;
      const vec3 h(half_sine, 0.0F, std::sqrt(1.0F - half_sine * half_sine));
      const vec3 wi(std::sqrt(1.0F - cosine * cosine), 0.0F, cosine);
      weights_.at(i) = core::cm_ggx(alpha, vec3(0.0F, 0.0F, 1.0F), wi, h);
    }
  }
  [[nodiscard]] float operator()(float cosine) const {
    const float place = std::sqrt(std::max(0.0F, 0.5F - 0.5F * cosine)) * (entries - 1);
    const auto low = std::min(static_cast<std::size_t>(place), weights_.size() - 2);
    return glm::mix(weights_[low], weights_[low + 1], place - static_cast<float>(low));
  }

 private:
  static constexpr int entries = 4096;
  std::array<float, entries> weights_{};
};

/// Directions with what comes from there, and the solid angle of each.
struct Source {
  std::vector<vec3> w;
  std::vector<vec3> light;
  std::vector<float> area;
};

Source source_of(const PixelsOf& pixels, int columns, int rows) {
  Source source;
  source.light = pixels(static_cast<std::uint32_t>(columns), static_cast<std::uint32_t>(rows));
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      source.w.push_back(direction(x, y, columns, rows));
      source.area.push_back(static_cast<float>(std::sin(std::numbers::pi * (y + 0.5) / rows)));
    }
  }
  return source;
}

vec3 seen(const Source& source, const Lobe& lobe, const vec3& middle) {
  vec3 sum(0.0F);
  float all = 0.0F;
  for (std::size_t i = 0; i < source.w.size(); ++i) {
    const float cosine = glm::dot(source.w[i], middle);
    if (cosine <= 0.0F) continue;
    const float weight = source.area[i] * lobe(cosine);
    sum += weight * source.light[i];
    all += weight;
  }
  return sum / all;
}

}  // namespace

GlossPtr make_gloss(const PixelsOf& pixels, const glm::dvec3& mean) {
  constexpr std::size_t texels = std::size_t{width} * height;
  auto gloss = std::make_shared<Gloss>();
  gloss->reserve(core::CM_GLOSS_LEVELS * texels);
  // The smoothest sees a texel; the next is little wider than one; the others are wider than those of a coarse picture.
  const Source fine = source_of(pixels, width, height);
  const Source coarse = source_of(pixels, width / 2, height / 2);
  for (const vec3& light : fine.light) gloss->emplace_back(light - vec3(mean), 0.0F);
  for (int level = 1; level < core::CM_GLOSS_LEVELS; ++level) {
    const Lobe lobe(static_cast<float>(level) / (core::CM_GLOSS_LEVELS - 1));
    const std::size_t first = gloss->size();
    gloss->resize(first + texels);
    tbb::parallel_for(0, height, [&](int y) {
      for (int x = 0; x < width; ++x) {
        const vec3 light = seen(level == 1 ? fine : coarse, lobe, direction(x, y, width, height));
        (*gloss)[first + static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] =
            glm::vec4(light - vec3(mean), 0.0F);
      }
    });
  }
  return gloss;
}

}  // namespace cumulet::light
