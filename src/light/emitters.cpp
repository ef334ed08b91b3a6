#include "light/emitters.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/luminance.hpp"
#include "base/progress_part.hpp"
#include "base/srgb.hpp"
#include "light/alias_table.hpp"

namespace cumulet::light {

namespace {

using glm::dvec3;
using glm::vec2;
using glm::vec3;
using surface::Image;
using surface::Material;
using surface::Scene;
using surface::Wrap;

// The texture of a triangle is sampled at this many points. Because these may miss bright texels, the result is at
// least this fraction of the image's mean.
constexpr int looks = 16;
constexpr float min_share = 0.05F;

using FromSrgb = std::array<float, 256>;

vec3 texel(const FromSrgb& linear, const Image& image, std::size_t i) {
  return {linear[image.rgba[4 * i]], linear[image.rgba[4 * i + 1]], linear[image.rgba[4 * i + 2]]};
}

dvec3 mean_color(const FromSrgb& linear, const Image& image, const Progress* progress) {
  const std::size_t texels = std::size_t{image.width} * image.height;
  const dvec3 sum = tbb::parallel_deterministic_reduce(
      tbb::blocked_range<std::size_t>(0, texels, 1U << 16U), dvec3(0.0),
      [&](const auto& range, dvec3 part) {
        check(progress);
        for (std::size_t i = range.begin(); i != range.end(); ++i) part += dvec3(texel(linear, image, i));
        return part;
      },
      [](const dvec3& a, const dvec3& b) { return a + b; });
  return sum / std::max(1.0, static_cast<double>(texels));
}

std::uint32_t wrapped(float at, std::uint32_t size, Wrap wrap) {
  float turns = at;
  if (wrap == Wrap::repeat) turns = at - std::floor(at);
  if (wrap == Wrap::mirrored) turns = 1.0F - std::abs(1.0F - (at - 2.0F * std::floor(0.5F * at)));
  if (!(turns > 0.0F)) return 0;  // also catches NaN from a degenerate transform
  const float texel = std::min(turns, 1.0F) * static_cast<float>(size);
  return std::min(size - 1U, static_cast<std::uint32_t>(texel));
}

// The emission of a material, averaged over triangles.
class Emission {
 public:
  Emission(const FromSrgb& linear, const Scene& scene, const Material& material, const Progress* progress)
      : linear_(&linear), scene_(&scene), material_(&material) {
    const surface::TextureUse& use = material.emission_texture;
    if (material.unlit || !(luminance(material.emission) > 0.0F)) return;
    vec3 mean(1.0F);
    if (use.texture >= 0) {
      texture_ = &scene.textures[static_cast<std::size_t>(use.texture)];
      image_ = &scene.images[texture_->image];
      mean = vec3(mean_color(linear, *image_, progress));
    }
    mean_ = luminance(material.emission * mean);
  }

  /// Returns the mean luminance; 0 if the material does not emit.
  [[nodiscard]] float mean() const { return mean_; }

  [[nodiscard]] float over(std::uint32_t triangle) const {
    if (image_ == nullptr) return mean_;
    const surface::TextureUse& use = material_->emission_texture;
    std::array<vec2, 3> uv;
    for (std::size_t i = 0; i < 3; ++i) {
      const surface::VertexAttributes& vertex = scene_->attributes[scene_->indices[3 * std::size_t{triangle} + i]];
      uv[i] = use.transform * vec3(vertex.uv[use.uv_set == 1 ? 1 : 0], 1.0F);
    }
    vec3 sum(0.0F);
    for (int i = 0; i < looks; ++i) {
      // Points of the R2 sequence, folded into the triangle.
      vec2 b = glm::fract(vec2(0.5F) + static_cast<float>(i) * vec2(0.7548777F, 0.5698403F));
      if (b.x + b.y > 1.0F) b = vec2(1.0F) - b;
      const vec2 at = uv[0] + b.x * (uv[1] - uv[0]) + b.y * (uv[2] - uv[0]);
      const std::size_t x = wrapped(at.x, image_->width, texture_->sampler.wrap_s);
      const std::size_t y = wrapped(at.y, image_->height, texture_->sampler.wrap_t);
      sum += texel(*linear_, *image_, y * image_->width + x);
    }
    return std::max(luminance(material_->emission * sum) / static_cast<float>(looks), min_share * mean_);
  }

 private:
  const FromSrgb* linear_;
  const Scene* scene_;
  const Material* material_;
  const surface::Texture* texture_ = nullptr;
  const Image* image_ = nullptr;
  float mean_ = 0.0F;
};

}  // namespace

std::vector<EmissiveTriangle> emissive_triangles(const Scene& scene, const surface::Pose& pose,
                                                 const Progress* progress) {
  const FromSrgb linear = srgb_decoding();
  std::vector<Emission> emissions;
  emissions.reserve(scene.materials.size());
  for (const Material& material : surface::materials_of(scene, pose))
    emissions.emplace_back(linear, scene, material, progress);
  std::vector<EmissiveTriangle> triangles;
  for (std::size_t i = 0; i < scene.draws.size(); ++i) {
    const surface::Draw& draw = scene.draws[i];
    if (surface::is_hidden(pose, i) || !(emissions[material_of(scene, pose, i)].mean() > 0.0F)) continue;
    const std::uint32_t first = draw.first_index / 3;
    for (std::uint32_t j = 0; j < draw.index_count / 3; ++j) {
      triangles.push_back({first + j, static_cast<std::uint32_t>(i), 0.0F});
    }
  }
  std::ranges::sort(triangles, {}, &EmissiveTriangle::triangle);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, triangles.size(), 1024), [&](const auto& range) {
    check(progress);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      EmissiveTriangle& t = triangles[i];
      t.luminance = emissions[material_of(scene, pose, t.draw)].over(t.triangle);
    }
  });
  return triangles;
}

EmitterTable emitter_table(std::span<const EmissiveTriangle> triangles, const Scene& scene, const surface::Pose& pose,
                           const Progress* progress, std::uint32_t first_triangle) {
  EmitterTable table;
  std::vector<double> areas;
  std::vector<double> power;
  double sum = 0.0;
  const std::vector<Material>& materials = surface::materials_of(scene, pose);
  for (const EmissiveTriangle& t : triangles) {
    if (areas.size() % 4096 == 0) check(progress);
    const std::size_t first = 3 * std::size_t{t.triangle};
    const dvec3 a = pose.vertices[scene.indices[first]].position;
    const dvec3 b = pose.vertices[scene.indices[first + 1]].position;
    const dvec3 c = pose.vertices[scene.indices[first + 2]].position;
    const double area = 0.5 * glm::length(glm::cross(b - a, c - a));
    const double sides = pose.double_sided || materials[material_of(scene, pose, t.draw)].double_sided ? 2.0 : 1.0;
    const double emitted = area * t.luminance * sides;
    if (!(emitted > 0.0) || !std::isfinite(emitted)) continue;
    table.entries.emplace_back(t.triangle - first_triangle, 0U, 0U, pose.flipped[t.draw] != 0 ? 1U : 0U);
    areas.push_back(area);
    power.push_back(emitted);
    sum += emitted;
  }
  table.flux = std::numbers::pi * sum;
  check(progress);

  const std::size_t n = power.size();
  const std::vector<Alias> aliases = alias_table(std::move(power), sum, progress);
  for (std::size_t i = 0; i < n; ++i) {
    table.entries[i].y = aliases[i].stays;
    table.entries[i].z = aliases[i].other;
  }
  // Computed from the quantized alias words, as shaders use them.
  std::vector<double> probability(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    const double stays = (static_cast<double>(table.entries[i].y) + 1.0) / 4294967296.0;
    probability[i] += stays;
    probability[table.entries[i].z] += 1.0 - stays;
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double density = probability[i] / static_cast<double>(n) / areas[i];
    glm::uvec4& entry = table.entries[i];
    entry.w = glm::floatBitsToUint(static_cast<float>(entry.w != 0U ? -density : density));
  }
  return table;
}

}  // namespace cumulet::light
