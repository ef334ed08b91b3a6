#pragma once

// Samples with known noise, as in a film, and their errors after filtering.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/luminance.hpp"
#include "gl/state_guard.hpp"
#include "render/passes/wavelet.hpp"
#include "support/fake_gl.hpp"
#include "support/gl_state.hpp"

namespace cumulet::test {

inline constexpr float infinite = std::numeric_limits<float>::infinity();

/// Describes the distribution of a pixel's samples.
struct Pixel {
  glm::vec3 front{1.0F};  // radiance of the surface or volume that covers it
  float cover = 1.0F;     // probability of that
  glm::vec3 behind{0.0F};
  float spread = 0.5F;     // a sample's radiance is uniform between 1 - spread and 1 + spread times `front`
  glm::vec3 normal{0.0F};  // of a surface that covers it; 0: the volume does
  glm::vec3 albedo{0.0F};
  float z = infinite;        // of that surface, or where the volume's opacity is one half
  glm::vec3 emission{0.0F};  // directly visible emission, in every sample
  glm::vec3 sunlit{0.0F};    // the part of `front` that is in the noise-free sunlight
};

using Scene = std::function<Pixel(int x, int y)>;

inline float luminance_of(const glm::vec3& color) { return static_cast<float>(cumulet::luminance(glm::dvec3(color))); }

// A pixel's side at depth 1.
inline constexpr float pixel_at_1 = 0.01F;

/// The view of an image of this size from (x, 0, 0) along -z.
inline render::PictureView view_at(double x, glm::ivec2 size) {
  render::PictureView view;
  view.eye = {x, 0.0, 0.0};
  view.right = {0.5 * pixel_at_1 * size.x, 0.0, 0.0};
  view.up = {0.0, 0.5 * pixel_at_1 * size.y, 0.0};
  return view;
}

/// Samples of a scene as in a film, with the noise-free feature buffers.
class Samples {
 public:
  Samples(const gl::FunctionsPtr& gl, glm::ivec2 size, unsigned count, const Scene& scene, unsigned seed = 1)
      : gl_(gl), size_(size) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0.0F, 1.0F);
    for (int i = 0; i < size.x * size.y; ++i) {
      const Pixel pixel = scene(i % size.x, i / size.x);
      const bool surface = pixel.normal != glm::vec3(0.0F);
      glm::vec4 sum(0.0F);
      glm::vec3 behind(0.0F);
      float square = 0.0F;
      for (unsigned s = 0; s < count; ++s) {
        const bool covered = unit(random) < pixel.cover;
        const glm::vec3 light =
            covered ? (1.0F + pixel.spread * (2.0F * unit(random) - 1.0F)) * pixel.front : pixel.behind;
        const double luminance = cumulet::luminance(glm::dvec3(light + pixel.emission));
        square += static_cast<float>(luminance * luminance) / static_cast<float>(count);
        sum += glm::vec4(pixel.emission, 0.0F);
        if (covered) {
          sum += glm::vec4(light, 1.0F);
        } else {
          behind += light / static_cast<float>(count);
        }
      }
      sum_.push_back(sum);
      background_.emplace_back(behind, 0.0F);
      squares_.push_back(square);
      counts_.emplace_back(count, 0U);
      albedo_.emplace_back(pixel.albedo, surface ? infinite : pixel.z);
      normal_.emplace_back(pixel.normal, surface ? pixel.z : infinite);
      transmittance_.emplace_back(surface ? 1.0F : 1.0F - pixel.cover, surface ? pixel.cover : 0.0F);
      surface_z_.push_back(surface ? pixel.z : infinite);
      volume_z_.emplace_back(surface ? infinite : pixel.z, 0.0F);
      const glm::vec3 known = pixel.emission + pixel.cover * pixel.sunlit;
      emission_.emplace_back(
          known, known == pixel.emission ? 0.0F : 1.0F - luminance_of(pixel.emission) / luminance_of(known));
      truth_.emplace_back(pixel.cover * pixel.front + pixel.emission, pixel.cover);
    }
  }

  std::vector<glm::vec4>& sums() { return sum_; }
  /// Adds a firefly of this brightness to one of a pixel's samples.
  void add_speck(glm::ivec2 at, float light) {
    const auto i = static_cast<std::size_t>(at.y * size_.x + at.x);
    sum_[i] += glm::vec4(glm::vec3(light), 0.0F);
    squares_[i] += light * light / static_cast<float>(counts_[i].x);
  }
  [[nodiscard]] const std::vector<glm::vec4>& truth() const { return truth_; }
  /// Means without the background, before filtering.
  [[nodiscard]] std::vector<glm::vec4> raw() const {
    std::vector<glm::vec4> means;
    for (std::size_t i = 0; i < sum_.size(); ++i) means.push_back(sum_[i] / static_cast<float>(counts_[i].x));
    return means;
  }
  std::vector<glm::vec4> filtered(const gl::ProgramsPtr& programs,
                                  render::MeansBackground background = render::MeansBackground::left_out) const {
    const gl::StateGuard guard(*gl_);
    render::Wavelet wavelet(gl_, programs);
    std::vector<glm::vec4> values = filtered_by(wavelet, std::nullopt, background);
    EXPECT_EQ(wavelet.bytes(), 112U * static_cast<unsigned>(size_.x * size_.y));
    return values;
  }
  /// Filters with a render::Wavelet that may have a history; with a view, this image becomes history. error: receives
  /// that of begin().
  std::vector<glm::vec4> filtered_by(render::Wavelet& wavelet, const std::optional<render::PictureView>& view,
                                     render::MeansBackground background = render::MeansBackground::left_out,
                                     std::optional<cumulet::Error>* error = nullptr) const {
    const gl::StateGuard guard(*gl_);
    const std::vector<gl::Object> textures = upload();
    render::PictureTextures picture;
    picture.sum = textures[0].name();
    picture.background = textures[1].name();
    picture.counts = textures[2].name();
    picture.moments = textures[3].name();
    picture.size = glm::uvec2(size_);
    picture.picture = picture.request = number_;
    picture.view = view;
    picture.guides = cumulet::render::PictureGuides{textures[4].name(),
                                                    textures[5].name(),
                                                    textures[6].name(),
                                                    textures[7].name(),
                                                    textures[8].name(),
                                                    textures[9].name(),
                                                    true,
                                                    glm::vec2(0.0F, pixel_at_1)};
    const gl::Object means = gl::make_texture_2d(gl_, GL_RGBA32F, size_.x, size_.y, "means");
    const gl::Object behind = gl::make_texture_2d(gl_, GL_RGBA32F, size_.x, size_.y, "background");
    EXPECT_TRUE(wavelet.able(picture, background, true));
    auto why = wavelet.begin(picture);
    if (error != nullptr) *error = std::move(why);
    // In the smallest possible steps.
    while (!wavelet.work(picture, std::chrono::steady_clock::now())) {
    }
    wavelet.give(picture, background, means.name(), behind.name());
    std::vector<glm::vec4> values(sum_.size());
    gl_->GetTextureImage(means.name(), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(values.size() * sizeof(glm::vec4)),
                         values.data());
    return values;
  }

 private:
  template <class Texel>
  gl::Object texture(GLenum internal, GLenum format, GLenum type, const std::vector<Texel>& texels) const {
    gl::Object made = gl::make_texture_2d(gl_, internal, size_.x, size_.y, "a layer");
    gl_->TextureSubImage2D(made.name(), 0, 0, 0, size_.x, size_.y, format, type, texels.data());
    return made;
  }
  static std::uint64_t next_number() {
    static std::uint64_t last = 0;
    return ++last;
  }
  [[nodiscard]] std::vector<gl::Object> upload() const {
    std::vector<gl::Object> textures;
    textures.push_back(texture(GL_RGBA32F, GL_RGBA, GL_FLOAT, sum_));
    textures.push_back(texture(GL_RGBA32F, GL_RGBA, GL_FLOAT, background_));
    textures.push_back(texture(GL_RG32UI, GL_RG_INTEGER, GL_UNSIGNED_INT, counts_));
    textures.push_back(texture(GL_R32F, GL_RED, GL_FLOAT, squares_));
    textures.push_back(texture(GL_RGBA32F, GL_RGBA, GL_FLOAT, albedo_));
    textures.push_back(texture(GL_RGBA32F, GL_RGBA, GL_FLOAT, normal_));
    textures.push_back(texture(GL_RG32F, GL_RG, GL_FLOAT, transmittance_));
    textures.push_back(texture(GL_R32F, GL_RED, GL_FLOAT, surface_z_));
    textures.push_back(texture(GL_RG32F, GL_RG, GL_FLOAT, volume_z_));
    textures.push_back(texture(GL_RGBA32F, GL_RGBA, GL_FLOAT, emission_));
    return textures;
  }

  gl::FunctionsPtr gl_;
  glm::ivec2 size_;
  std::vector<glm::vec4> sum_, background_, albedo_, normal_, emission_, truth_;
  std::vector<glm::uvec2> counts_;
  std::vector<glm::vec2> transmittance_, volume_z_;
  std::vector<float> squares_, surface_z_;
  std::uint64_t number_ = next_number();
};

struct Moments {
  double mean = 0.0;
  double variance = 0.0;
};

inline Moments moments_of(const std::vector<glm::vec4>& values, int channel = 0) {
  Moments m;
  for (const glm::vec4& v : values) m.mean += v[channel] / double(values.size());
  for (const glm::vec4& v : values) m.variance += std::pow(v[channel] - m.mean, 2.0) / double(values.size());
  return m;
}

inline double error_of(const std::vector<glm::vec4>& values, const std::vector<glm::vec4>& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const glm::dvec4 d = glm::dvec4(values[i]) - glm::dvec4(truth[i]);
    sum += glm::dot(d, d) / double(values.size());
  }
  return sum;
}

}  // namespace cumulet::test
