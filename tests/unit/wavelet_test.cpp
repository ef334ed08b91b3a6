// Pictures of known noise, filtered: what is known of them is still so, and there is less of it.

#include "render/wavelet.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "base/luminance.hpp"
#include "gl/state_guard.hpp"
#include "support/gl_state.hpp"

namespace {

using cumulet::gl::Object;
using cumulet::gl::StateGuard;
using cumulet::render::MeansBackground;
using cumulet::render::PictureTextures;
using cumulet::render::Wavelet;
namespace gl = cumulet::gl;

constexpr float infinite = std::numeric_limits<float>::infinity();

/// What a pixel is of, by which its samples are drawn.
struct Pixel {
  glm::vec3 front{1.0F};  // of what covers it
  float cover = 1.0F;     // the chance of that
  glm::vec3 behind{0.0F};
  float spread = 0.5F;     // of a sample's light, which is even between 1 - spread and 1 + spread of it
  glm::vec3 normal{0.0F};  // of a surface that covers it, else the volume does
  glm::vec3 albedo{0.0F};
  float z = infinite;  // of that surface, or where the volume is half opaque
};

using Scene = std::function<Pixel(int x, int y)>;

/// Samples of a scene, as a film has them, and what is known of it without noise.
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
        const double luminance = cumulet::luminance(glm::dvec3(light));
        square += static_cast<float>(luminance * luminance) / static_cast<float>(count);
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
      albedo_.emplace_back(pixel.albedo, 0.0F);
      normal_.emplace_back(pixel.normal, 0.0F);
      transmittance_.push_back(surface ? 1.0F : 1.0F - pixel.cover);
      surface_z_.push_back(surface ? pixel.z : infinite);
      volume_z_.push_back(surface ? infinite : pixel.z);
      truth_.emplace_back(pixel.cover * pixel.front, pixel.cover);
    }
  }

  std::vector<glm::vec4>& sums() { return sum_; }
  /// Makes one of a pixel's samples that bright.
  void add_speck(glm::ivec2 at, float light) {
    const auto i = static_cast<std::size_t>(at.y * size_.x + at.x);
    sum_[i] += glm::vec4(glm::vec3(light), 0.0F);
    squares_[i] += light * light / static_cast<float>(counts_[i].x);
  }
  [[nodiscard]] const std::vector<glm::vec4>& truth() const { return truth_; }
  /// In front of the background, before the filter and after it.
  [[nodiscard]] std::vector<glm::vec4> raw() const {
    std::vector<glm::vec4> means;
    for (std::size_t i = 0; i < sum_.size(); ++i) means.push_back(sum_[i] / static_cast<float>(counts_[i].x));
    return means;
  }
  std::vector<glm::vec4> filtered(const gl::ProgramsPtr& programs,
                                  MeansBackground background = MeansBackground::left_out) const {
    const StateGuard guard(*gl_);
    const std::vector<Object> textures = upload();
    PictureTextures picture;
    picture.sum = textures[0].name();
    picture.background = textures[1].name();
    picture.counts = textures[2].name();
    picture.moments = textures[3].name();
    picture.size = glm::uvec2(size_);
    picture.guides = cumulet::render::PictureGuides{textures[4].name(),
                                                    textures[5].name(),
                                                    textures[6].name(),
                                                    textures[7].name(),
                                                    textures[8].name(),
                                                    true,
                                                    true,
                                                    glm::vec2(0.0F, 0.01F)};
    const Object means = gl::make_texture_2d(gl_, GL_RGBA32F, size_.x, size_.y, "means");
    const Object behind = gl::make_texture_2d(gl_, GL_RGBA32F, size_.x, size_.y, "background");
    Wavelet wavelet(gl_, programs);
    EXPECT_TRUE(wavelet.able(picture, background, true));
    wavelet.begin(picture);
    EXPECT_EQ(wavelet.bytes(), 96U * static_cast<unsigned>(size_.x * size_.y));
    // By steps as small as there are.
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
  Object texture(GLenum internal, GLenum format, GLenum type, const std::vector<Texel>& texels) const {
    Object made = gl::make_texture_2d(gl_, internal, size_.x, size_.y, "a layer");
    gl_->TextureSubImage2D(made.name(), 0, 0, 0, size_.x, size_.y, format, type, texels.data());
    return made;
  }
  [[nodiscard]] std::vector<Object> upload() const {
    std::vector<Object> textures;
    textures.push_back(texture(GL_RGBA32F, GL_RGBA, GL_FLOAT, sum_));
    textures.push_back(texture(GL_RGBA32F, GL_RGBA, GL_FLOAT, background_));
    textures.push_back(texture(GL_RG32UI, GL_RG_INTEGER, GL_UNSIGNED_INT, counts_));
    textures.push_back(texture(GL_R32F, GL_RED, GL_FLOAT, squares_));
    textures.push_back(texture(GL_RGBA32F, GL_RGBA, GL_FLOAT, albedo_));
    textures.push_back(texture(GL_RGBA32F, GL_RGBA, GL_FLOAT, normal_));
    textures.push_back(texture(GL_R32F, GL_RED, GL_FLOAT, transmittance_));
    textures.push_back(texture(GL_R32F, GL_RED, GL_FLOAT, surface_z_));
    textures.push_back(texture(GL_R32F, GL_RED, GL_FLOAT, volume_z_));
    return textures;
  }

  gl::FunctionsPtr gl_;
  glm::ivec2 size_;
  std::vector<glm::vec4> sum_, background_, albedo_, normal_, truth_;
  std::vector<glm::uvec2> counts_;
  std::vector<float> squares_, transmittance_, surface_z_, volume_z_;
};

struct Moments {
  double mean = 0.0;
  double variance = 0.0;
};

Moments moments_of(const std::vector<glm::vec4>& values, int channel = 0) {
  Moments m;
  for (const glm::vec4& v : values) m.mean += v[channel] / double(values.size());
  for (const glm::vec4& v : values) m.variance += std::pow(v[channel] - m.mean, 2.0) / double(values.size());
  return m;
}

double error_of(const std::vector<glm::vec4>& values, const std::vector<glm::vec4>& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const glm::dvec4 d = glm::dvec4(values[i]) - glm::dvec4(truth[i]);
    sum += glm::dot(d, d) / double(values.size());
  }
  return sum;
}

class Wavelets : public cumulet::test::GlTest {};

TEST_P(Wavelets, AConstantKeepsItsMeanAndLosesItsNoise) {
  for (const unsigned count : {1U, 4U, 64U}) {
    const Samples samples(gl_, {61, 47}, count, [](int, int) { return Pixel{.z = 5.0F}; });
    const Moments raw = moments_of(samples.raw());
    const Moments clean = moments_of(samples.filtered(programs_));
    EXPECT_NEAR(clean.mean, raw.mean, 0.01 * raw.mean) << count;
    EXPECT_LT(clean.variance, 0.05 * raw.variance) << count;
  }
}

TEST_P(Wavelets, WhatIsHalfOpenKeepsItsMeansToo) {
  const glm::vec3 sky(0.4F, 0.6F, 2.0F);
  const Samples samples(gl_, {64, 64}, 2, [&](int, int) { return Pixel{.cover = 0.4F, .behind = sky}; });
  const auto clean = samples.filtered(programs_);
  // What is less than half of the samples counts a little less: 3 %.
  EXPECT_NEAR(moments_of(clean).mean, moments_of(samples.raw()).mean, 0.02);
  EXPECT_NEAR(moments_of(clean, 3).mean, moments_of(samples.raw(), 3).mean, 0.02);
  EXPECT_LT(moments_of(clean, 3).variance, 0.05 * moments_of(samples.raw(), 3).variance);
  // With what is behind: where nothing of it was seen, too.
  const auto whole = samples.filtered(programs_, MeansBackground::added);
  EXPECT_NEAR(moments_of(whole, 2).mean, 0.4 * 1.0 + 0.6 * 2.0, 0.03);
}

// On one side of a straight edge there is light, none on the other: what crosses it is smear.
TEST_P(Wavelets, ASurfacesSilhouetteStays) {
  const auto scene = [](int x, int) {
    Pixel pixel{.front = glm::vec3(x < 24 ? 1.0F : 0.2F), .normal = {0.0F, 0.0F, 1.0F}, .albedo = glm::vec3(0.5F)};
    pixel.z = x < 24 ? 2.0F : 8.0F;
    return pixel;
  };
  const Samples samples(gl_, {48, 48}, 2, scene);
  const auto clean = samples.filtered(programs_);
  double near = 0.0;
  double far = 0.0;
  for (std::size_t y = 0; y < 48; ++y) {
    near += clean[48 * y + 23].x / 48.0;
    far += clean[48 * y + 24].x / 48.0;
  }
  EXPECT_NEAR(near, 1.0, 0.03);
  EXPECT_NEAR(far, 0.2, 0.03);
  EXPECT_LT(error_of(clean, samples.truth()), 0.05 * error_of(samples.raw(), samples.truth()));
}

// The volume covers more and more of the pixels over a few of them, up to all.
TEST_P(Wavelets, ACloudsEdgeStays) {
  const auto scene = [](int x, int) {
    const float cover = std::clamp((float(x) - 20.0F) / 6.0F, 0.0F, 1.0F);
    return Pixel{
        .front = glm::vec3(1.5F), .cover = cover, .behind = glm::vec3(0.3F), .z = cover >= 0.5F ? 4.0F : infinite};
  };
  const Samples samples(gl_, {48, 48}, 2, scene);
  const auto clean = samples.filtered(programs_);
  for (std::size_t x = 16; x < 30; ++x) {
    glm::dvec4 mean(0.0);
    for (std::size_t y = 0; y < 48; ++y) mean += glm::dvec4(clean[48 * y + x]) / 48.0;
    EXPECT_NEAR(mean.x, samples.truth()[x].x, 0.15) << x;
    EXPECT_NEAR(mean.w, samples.truth()[x].w, 0.1) << x;
  }
  EXPECT_LT(error_of(clean, samples.truth()), 0.1 * error_of(samples.raw(), samples.truth()));
}

// An edge that only light has, so that nothing but samples tells of it.
TEST_P(Wavelets, ConvergesToTheMeanOfSamples) {
  const auto scene = [](int x, int y) {
    return Pixel{.front = glm::vec3((x / 4 + y / 4) % 2 == 0 ? 1.0F : 0.5F), .z = 5.0F};
  };
  double last = infinite;
  for (const unsigned count : {4U, 64U, 1024U, 16384U}) {
    const Samples samples(gl_, {32, 32}, count, scene);
    const double moved = error_of(samples.filtered(programs_), samples.raw());
    EXPECT_LT(moved, 0.5 * last) << count;
    EXPECT_LT(error_of(samples.filtered(programs_), samples.truth()),
              1.5 * error_of(samples.raw(), samples.truth()) + 1e-9)
        << count;
    last = moved;
  }
  EXPECT_LT(last, 1e-4);
}

TEST_P(Wavelets, WithoutNoiseNothingIsFiltered) {
  const auto scene = [](int x, int y) {
    return Pixel{.front = glm::vec3(0.1F * static_cast<float>(1 + (x * 7 + y * 3) % 11)), .spread = 0.0F, .z = 5.0F};
  };
  const Samples samples(gl_, {32, 32}, 16, scene);
  const auto clean = samples.filtered(programs_);
  for (std::size_t i = 0; i < clean.size(); ++i) EXPECT_NEAR(clean[i].x, samples.truth()[i].x, 2e-3) << i;
}

TEST_P(Wavelets, WhatIsNoNumberStaysInItsPixel) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), infinite, -infinite}) {
    Samples samples(gl_, {33, 29}, 2, [](int, int) { return Pixel{.z = 5.0F}; });
    constexpr std::size_t at = 33 * 14 + 16;
    samples.sums()[at].y = bad;
    const auto clean = samples.filtered(programs_);
    for (std::size_t i = 0; i < clean.size(); ++i) {
      if (i == at) {
        EXPECT_FALSE(std::isfinite(clean[i].y));
      } else {
        EXPECT_NEAR(clean[i].y, 1.0, 0.5) << i;
      }
    }
  }
}

// One of 16 samples found a light: an estimate of its pixel as good as any, and nothing to show.
TEST_P(Wavelets, ASpeckDoesNotStayNorSpreadAsDots) {
  constexpr glm::ivec2 size(48, 48);
  Samples samples(gl_, size, 16, [](int, int) { return Pixel{.z = 5.0F}; });
  const auto without = samples.filtered(programs_);
  samples.add_speck({24, 24}, 400.0F);
  const auto clean = samples.filtered(programs_);
  for (std::size_t i = 0; i < clean.size(); ++i) EXPECT_NEAR(clean[i].x, without[i].x, 0.25) << i % 48 << " " << i / 48;
}

// But where a pixel's own samples are sure of what they see it stays, however dark all around it is.
TEST_P(Wavelets, ABrightPixelStays) {
  const auto scene = [](int x, int y) {
    return Pixel{.front = glm::vec3(x == 20 && y == 20 ? 20.0F : 1.0F), .spread = 0.1F, .z = 5.0F};
  };
  const Samples samples(gl_, {41, 41}, 64, scene);
  EXPECT_NEAR(samples.filtered(programs_)[41 * 20 + 20].x, 20.0, 0.7);
}

TEST_P(Wavelets, AnySizeWillDo) {
  for (const glm::ivec2 size : {glm::ivec2(1, 1), {1, 40}, {40, 1}, {2, 3}, {7, 9}, {65, 33}}) {
    const Samples samples(gl_, size, 4, [](int, int) { return Pixel{.z = 5.0F}; });
    const auto clean = samples.filtered(programs_);
    for (const glm::vec4& v : clean) EXPECT_NEAR(v.x, 1.0, 0.5) << size.x << " x " << size.y;
    if (size == glm::ivec2(1)) {
      EXPECT_NEAR(clean[0].x, samples.raw()[0].x, 1e-5);
    }
  }
}

CUMULET_GL_ON_BACKENDS(Wavelets);

}  // namespace
