// The wavelet filter on images with known noise: means are kept and the noise is reduced. Temporal history: valid
// samples of earlier images are reused, and others are not.

#include "render/wavelet.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/luminance.hpp"
#include "gl/state_guard.hpp"
#include "support/fake_gl.hpp"
#include "support/gl_state.hpp"

namespace {

using cumulet::gl::Object;
using cumulet::gl::StateGuard;
using cumulet::render::MeansBackground;
using cumulet::render::PictureTextures;
using cumulet::render::PictureView;
using cumulet::render::Wavelet;
namespace gl = cumulet::gl;

constexpr float infinite = std::numeric_limits<float>::infinity();

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

float luminance_of(const glm::vec3& color) { return static_cast<float>(cumulet::luminance(glm::dvec3(color))); }

// A pixel's side at depth 1.
constexpr float pixel_at_1 = 0.01F;

/// The view of an image of this size from (x, 0, 0) along -z.
PictureView view_at(double x, glm::ivec2 size) {
  PictureView view;
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
                                  MeansBackground background = MeansBackground::left_out) const {
    const StateGuard guard(*gl_);
    Wavelet wavelet(gl_, programs);
    std::vector<glm::vec4> values = filtered_by(wavelet, std::nullopt, background);
    EXPECT_EQ(wavelet.bytes(), 112U * static_cast<unsigned>(size_.x * size_.y));
    return values;
  }
  /// Filters with a Wavelet that may have a history; with a view, this image becomes history. error: receives that of
  /// begin().
  std::vector<glm::vec4> filtered_by(Wavelet& wavelet, const std::optional<PictureView>& view,
                                     MeansBackground background = MeansBackground::left_out,
                                     std::optional<cumulet::Error>* error = nullptr) const {
    const StateGuard guard(*gl_);
    const std::vector<Object> textures = upload();
    PictureTextures picture;
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
    const Object means = gl::make_texture_2d(gl_, GL_RGBA32F, size_.x, size_.y, "means");
    const Object behind = gl::make_texture_2d(gl_, GL_RGBA32F, size_.x, size_.y, "background");
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
  Object texture(GLenum internal, GLenum format, GLenum type, const std::vector<Texel>& texels) const {
    Object made = gl::make_texture_2d(gl_, internal, size_.x, size_.y, "a layer");
    gl_->TextureSubImage2D(made.name(), 0, 0, 0, size_.x, size_.y, format, type, texels.data());
    return made;
  }
  static std::uint64_t next_number() {
    static std::uint64_t last = 0;
    return ++last;
  }
  [[nodiscard]] std::vector<Object> upload() const {
    std::vector<Object> textures;
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

class WaveletFilter : public cumulet::test::GlTest {};

TEST_P(WaveletFilter, ConstantKeepsItsMeanAndLosesNoise) {
  for (const unsigned count : {1U, 4U, 64U}) {
    const Samples samples(gl_, {61, 47}, count, [](int, int) { return Pixel{.z = 5.0F}; });
    const Moments raw = moments_of(samples.raw());
    const Moments clean = moments_of(samples.filtered(programs_));
    EXPECT_NEAR(clean.mean, raw.mean, 0.01 * raw.mean) << count;
    EXPECT_LT(clean.variance, 0.05 * raw.variance) << count;
  }
}

TEST_P(WaveletFilter, PartialCoverageKeepsItsMeans) {
  const glm::vec3 sky(0.4F, 0.6F, 2.0F);
  const Samples samples(gl_, {64, 64}, 2, [&](int, int) { return Pixel{.cover = 0.4F, .behind = sky}; });
  const auto clean = samples.filtered(programs_);
  // Radiance seen in less than half of the samples is underestimated by up to 3 %.
  EXPECT_NEAR(moments_of(clean).mean, moments_of(samples.raw()).mean, 0.02);
  EXPECT_NEAR(moments_of(clean, 3).mean, moments_of(samples.raw(), 3).mean, 0.02);
  EXPECT_LT(moments_of(clean, 3).variance, 0.05 * moments_of(samples.raw(), 3).variance);
  // With the background, also in pixels without a background sample.
  const auto whole = samples.filtered(programs_, MeansBackground::added);
  EXPECT_NEAR(moments_of(whole, 2).mean, 0.4 * 1.0 + 0.6 * 2.0, 0.03);
}

// A straight edge between bright and dark: light that crosses it is blur.
TEST_P(WaveletFilter, SurfaceSilhouettesStaySharp) {
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

// As for leaves: the mean normals are short, but the pixels are fully covered. A leak would show the background.
TEST_P(WaveletFilter, FullCoverageIsKeptForAnyMeanNormal) {
  const auto scene = [](int x, int y) {
    return Pixel{.front = glm::vec3(0.4F),
                 .behind = glm::vec3(9.0F),
                 .normal = {0.0F, 0.0F, (x + y) % 2 == 0 ? 0.3F : 0.8F},
                 .albedo = glm::vec3(0.5F),
                 .z = 3.0F};
  };
  const Samples samples(gl_, {32, 32}, 1, scene);
  const auto clean = samples.filtered(programs_);
  for (std::size_t i = 0; i < clean.size(); ++i) {
    EXPECT_EQ(clean[i].w, 1.0F) << i;
    EXPECT_NEAR(clean[i].x, 0.4F, 0.21F) << i;
  }
}

// The coverage by the volume increases to 1 over a few pixels.
TEST_P(WaveletFilter, CloudEdgesStaySharp) {
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

// A light in a wall of the same plane: its emission is fifty times the wall's radiance, and its albedo is low.
TEST_P(WaveletFilter, BrightLightsDoNotLeak) {
  const auto is_analytic_light = [](int x, int y) { return x >= 20 && x < 28 && y >= 20 && y < 24; };
  const auto scene = [&](int x, int y) {
    const bool analytic_light = is_analytic_light(x, y);
    return Pixel{.front = glm::vec3(analytic_light ? 0.01F : 0.7F),
                 .normal = {0.0F, 0.0F, 1.0F},
                 .albedo = glm::vec3(analytic_light ? 0.01F : 0.7F),
                 .z = 4.0F,
                 .emission = glm::vec3(analytic_light ? 35.0F : 0.0F)};
  };
  const Samples samples(gl_, {48, 48}, 1, scene);
  const auto clean = samples.filtered(programs_);
  for (int i = 0; i < 48 * 48; ++i) {
    const bool analytic_light = is_analytic_light(i % 48, i / 48);
    EXPECT_NEAR(clean[static_cast<std::size_t>(i)].x, analytic_light ? 35.01F : 0.7F, analytic_light ? 1.2F : 0.4F)
        << i % 48 << ", " << i / 48;
  }
  EXPECT_LT(error_of(clean, samples.truth()), 0.3 * error_of(samples.raw(), samples.truth()));
}

// A shadow on a striped plane with few informative samples. The noise-free sunlight defines its edge. The remaining
// light varies with the albedo.
TEST_P(WaveletFilter, NoiseFreeShadowKeepsItsEdge) {
  const auto scene = [](bool known) {
    return [known](int x, int y) {
      const glm::vec3 albedo(x / 2 % 2 == 0 ? 0.2F : 0.8F);
      const glm::vec3 sun = y < 16 ? albedo : glm::vec3(0.0F);
      return Pixel{.front = 0.2F * albedo + sun,
                   .spread = 0.95F,
                   .normal = {0.0F, 0.0F, 1.0F},
                   .albedo = albedo,
                   .z = 4.0F,
                   .sunlit = known ? sun : glm::vec3(0.0F)};
    };
  };
  const Samples samples(gl_, {32, 32}, 1, scene(true));
  const double error = error_of(samples.filtered(programs_), samples.truth());
  const double unknown = error_of(Samples(gl_, {32, 32}, 1, scene(false)).filtered(programs_), samples.truth());
  EXPECT_LT(error, 0.5 * unknown);
}

// Flames without smoke have no alpha and end in clear air.
TEST_P(WaveletFilter, FlamesHaveNoHalo) {
  const auto scene = [](int x, int) {
    return Pixel{
        .cover = 0.0F, .behind = glm::vec3(0.02F), .spread = 0.0F, .emission = glm::vec3(x < 16 ? 3.0F : 0.0F)};
  };
  const Samples samples(gl_, {32, 32}, 1, scene);
  const auto clean = samples.filtered(programs_);
  for (std::size_t i = 0; i < clean.size(); ++i) EXPECT_NEAR(clean[i].x, samples.truth()[i].x, 1e-3) << i;
}

// An edge that no feature buffer shows, only the samples.
TEST_P(WaveletFilter, ConvergesToTheMeanOfSamples) {
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

// Detail that no feature buffer shows and that is close to the noise level: noise is better than blur.
TEST_P(WaveletFilter, FilterIsSkippedIfBlurExceedsTheNoise) {
  constexpr unsigned count = 64;
  const double noise = 0.5 / std::sqrt(3.0 * count);
  // Limits relative to the noisy image's error. The filter without this rule gives 0.76, 1.28 and 1.55.
  for (const auto& [contrast, most] : {std::pair(1.0, 0.7), std::pair(2.0, 1.2), std::pair(4.0, 1.47)}) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const double amplitude = std::sqrt(3.0) * contrast * noise;
    const auto scene = [&](int, int) {
      const double light = 1.0 + amplitude * unit(random);
      return Pixel{.front = glm::vec3(static_cast<float>(light)), .z = 5.0F};
    };
    const Samples samples(gl_, {48, 48}, count, scene);
    const double raw = error_of(samples.raw(), samples.truth());
    EXPECT_LT(error_of(samples.filtered(programs_), samples.truth()), most * raw) << contrast;
  }
}

TEST_P(WaveletFilter, WithoutNoiseNothingIsFiltered) {
  const auto scene = [](int x, int y) {
    return Pixel{.front = glm::vec3(0.1F * static_cast<float>(1 + (x * 7 + y * 3) % 11)), .spread = 0.0F, .z = 5.0F};
  };
  const Samples samples(gl_, {32, 32}, 16, scene);
  const auto clean = samples.filtered(programs_);
  for (std::size_t i = 0; i < clean.size(); ++i) EXPECT_NEAR(clean[i].x, samples.truth()[i].x, 2e-3) << i;
}

TEST_P(WaveletFilter, NonFiniteValuesStayInTheirPixel) {
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

// One of few samples hit a light: unbiased, but a firefly that must not be displayed.
TEST_P(WaveletFilter, FirefliesAreRemovedWithoutDots) {
  constexpr glm::ivec2 size(48, 48);
  for (const unsigned count : {1U, 4U, 16U}) {
    Samples samples(gl_, size, count, [](int, int) { return Pixel{.z = 5.0F}; });
    const auto without = samples.filtered(programs_);
    samples.add_speck({24, 24}, 400.0F);
    const auto clean = samples.filtered(programs_);
    for (std::size_t i = 0; i < clean.size(); ++i)
      EXPECT_NEAR(clean[i].x, without[i].x, i == 24 * 48 + 24 ? 1.0 : 0.25) << count << ": " << i % 48 << " " << i / 48;
  }
}

// A bright pixel whose own samples agree is kept, even in dark surroundings.
TEST_P(WaveletFilter, BrightPixelsAreKept) {
  const auto scene = [](int x, int y) {
    return Pixel{.front = glm::vec3(x == 20 && y == 20 ? 20.0F : 1.0F), .spread = 0.1F, .z = 5.0F};
  };
  const Samples samples(gl_, {41, 41}, 64, scene);
  EXPECT_NEAR(samples.filtered(programs_)[41 * 20 + 20].x, 20.0, 0.7);
}

TEST_P(WaveletFilter, WorksForAnySize) {
  for (const glm::ivec2 size : {glm::ivec2(1, 1), {1, 40}, {40, 1}, {2, 3}, {7, 9}, {65, 33}}) {
    const Samples samples(gl_, size, 4, [](int, int) { return Pixel{.z = 5.0F}; });
    const auto clean = samples.filtered(programs_);
    for (const glm::vec4& v : clean) EXPECT_NEAR(v.x, 1.0, 0.5) << size.x << " x " << size.y;
    if (size == glm::ivec2(1)) {
      EXPECT_NEAR(clean[0].x, samples.raw()[0].x, 1e-5);
    }
  }
}

// ---- Sequences of images ----

// Detail that only samples show: a random value for each position of a wall at depth 5, where a pixel is 0.05 wide.
float painted(int x, int y) {
  const auto hash = static_cast<unsigned>((x + 1000) * 7919 + (y + 1000) * 104729);
  return 0.3F + 0.1F * static_cast<float>((hash ^ (hash >> 7U)) % 14U);
}
constexpr double wall_z = 5.0;
constexpr double wall_pixel = wall_z * pixel_at_1;

// The wall seen from an eye that is moved to the right by this number of its pixels.
Scene wall_from(int moved) {
  return [moved](int x, int y) {
    return Pixel{.front = glm::vec3(painted(x + moved, y)),
                 .normal = {0.0F, 0.0F, 1.0F},
                 .albedo = glm::vec3(0.5F),
                 .z = static_cast<float>(wall_z)};
  };
}

class DenoiserHistory : public cumulet::test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (gl_) wavelet_ = std::make_unique<Wavelet>(gl_, programs_);
  }
  void TearDown() override {
    wavelet_.reset();
    GlTest::TearDown();
  }
  // Filters images of a wall of one sample per pixel, moving the eye by a step each time. Returns the last.
  std::vector<glm::vec4> after(int pictures, int step, std::vector<glm::vec4>* truth = nullptr) {
    std::vector<glm::vec4> last;
    for (int i = 0; i < pictures; ++i) {
      const Samples samples(gl_, size_, 1, wall_from(step * i), static_cast<unsigned>(i + 1));
      last = samples.filtered_by(*wavelet_, view_at(step * i * wall_pixel, size_));
      if (truth != nullptr) *truth = samples.truth();
    }
    return last;
  }

  glm::ivec2 size_{48, 40};
  std::unique_ptr<Wavelet> wavelet_;
};

TEST_P(DenoiserHistory, SameViewAccumulates) {
  std::vector<glm::vec4> truth;
  const double one = error_of(after(1, 0, &truth), truth);
  const double many = error_of(after(12, 0, &truth), truth);
  EXPECT_LT(many, 0.5 * one);
}

TEST_P(DenoiserHistory, MovingObjectsAreReprojected) {
  std::vector<glm::vec4> truth;
  const double one = error_of(after(1, 0, &truth), truth);
  for (const int step : {2, -3}) EXPECT_LT(error_of(after(12, step, &truth), truth), 0.65 * one) << step;
}

TEST_P(DenoiserHistory, MediumIsReprojectedByItsMeanDepth) {
  const auto scene = [](int moved) {
    return [moved](int x, int y) { return Pixel{.front = glm::vec3(painted(x + moved, y)), .z = float(wall_z)}; };
  };
  double one = 0.0;
  double many = 0.0;
  for (int i = 0; i < 12; ++i) {
    const Samples samples(gl_, size_, 1, scene(3 * i), static_cast<unsigned>(i + 1));
    many = error_of(samples.filtered_by(*wavelet_, view_at(3 * i * wall_pixel, size_)), samples.truth());
    if (i == 0) one = many;
  }
  EXPECT_LT(many, 0.65 * one);
}

TEST_P(DenoiserHistory, OrthographicAndRotatedViewsAreReprojected) {
  double one = 0.0;
  double many = 0.0;
  for (int i = 0; i < 12; ++i) {
    const Samples samples(gl_, size_, 1, wall_from(2 * i), static_cast<unsigned>(i + 1));
    PictureView view = view_at(2 * i * wall_pixel, size_);
    view.orthographic = true;
    view.right *= wall_z;  // so that pixels have the same size as with perspective
    view.up *= wall_z;
    // A rotated view; the eye moves by the same distance along its own axis.
    const glm::dmat3 turn(0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0);
    view = {
        turn * view.eye + glm::dvec3(7.0, 8.0, 9.0), turn * view.forward, turn * view.right, turn * view.up, true, 0};
    many = error_of(samples.filtered_by(*wavelet_, view), samples.truth());
    if (i == 0) one = many;
  }
  EXPECT_LT(many, 0.65 * one);
}

// A card at depth 2 in front of a slightly darker wall, with a difference below the noise. As the eye moves, more of
// the wall becomes visible.
TEST_P(DenoiserHistory, DisocclusionsLeaveNoGhosting) {
  constexpr int first = 30;
  constexpr int step = 5;  // pixels of the card, which are two of the wall
  constexpr int views = 5;
  const auto scene = [](int i) {
    return [i](int x, int) {
      const bool card = x < first - step * i;
      return Pixel{.front = glm::vec3(card ? 0.13F : 0.1F),
                   .spread = 0.9F,
                   .normal = {0.0F, 0.0F, 1.0F},
                   .albedo = glm::vec3(0.5F),
                   .z = card ? 2.0F : float(wall_z)};
    };
  };
  std::vector<glm::vec4> last;
  for (int i = 0; i < views; ++i) {
    const Samples samples(gl_, size_, 2, scene(i), static_cast<unsigned>(i + 1));
    last = samples.filtered_by(*wavelet_, view_at(2 * i * wall_pixel, size_));
  }
  // The area that the last step uncovered was covered in all earlier views.
  double mean = 0.0;
  for (int y = 0; y < size_.y; ++y) {
    for (int x = first - step * (views - 1); x < first - step * (views - 2); ++x) {
      mean += last[static_cast<std::size_t>(y * size_.x + x)].x / double(step * size_.y);
    }
  }
  EXPECT_NEAR(mean, 0.1, 0.008);
}

// The light changed without a reset of the history.
TEST_P(DenoiserHistory, OutdatedHistoryFadesOut) {
  const auto lit = [](float light) {
    return [light](int, int) { return Pixel{.front = glm::vec3(light), .z = 5.0F}; };
  };
  const PictureView view = view_at(0.0, size_);
  for (const unsigned count : {1U, 4U, 64U}) {
    wavelet_->free();
    for (unsigned i = 0; i < 8; ++i) {
      static_cast<void>(Samples(gl_, size_, 4, lit(4.0F), i + 1).filtered_by(*wavelet_, view));
    }
    const Samples now(gl_, size_, count, lit(1.0F), 9);
    const auto with = now.filtered_by(*wavelet_, view);
    EXPECT_NEAR(moments_of(with).mean, 1.0, count == 1 ? 0.3 : 0.1) << count;
    if (count == 64) {
      EXPECT_EQ(with, now.filtered(programs_));
    }
  }
}

TEST_P(DenoiserHistory, OtherScenesAndViewersHaveSeparateHistory) {
  static_cast<void>(after(8, 0));
  PictureView other = view_at(0.0, size_);
  other.scene = 7;
  const Samples samples(gl_, size_, 1, wall_from(0), 20);
  const auto alone = samples.filtered(programs_);
  EXPECT_EQ(samples.filtered_by(*wavelet_, other), alone);
  static_cast<void>(after(8, 0));
  EXPECT_NE(samples.filtered_by(*wavelet_, view_at(0.0, size_)), alone);
  // Without a view, the history is neither used nor kept.
  EXPECT_EQ(samples.filtered_by(*wavelet_, std::nullopt), alone);
  wavelet_->free();
  EXPECT_EQ(samples.filtered_by(*wavelet_, view_at(0.0, size_)), alone);
  EXPECT_EQ(wavelet_->bytes(), (112U + 16U + 32U) * static_cast<unsigned>(size_.x * size_.y));
}

// Filtering the same image again, as samples arrive, does not count them twice.
TEST_P(DenoiserHistory, ImageIsNotItsOwnHistory) {
  const Samples samples(gl_, size_, 1, wall_from(0), 3);
  const auto alone = samples.filtered(programs_);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(samples.filtered_by(*wavelet_, view_at(0.0, size_)), alone) << i;
}

TEST_P(DenoiserHistory, NonFiniteHistoryIsDiscarded) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), infinite, -infinite}) {
    wavelet_->free();
    Samples before(gl_, size_, 2, wall_from(0), 1);
    for (std::size_t i = 0; i < before.sums().size(); i += 3) before.sums()[i].y = bad;
    static_cast<void>(before.filtered_by(*wavelet_, view_at(0.0, size_)));
    const Samples now(gl_, size_, 2, wall_from(1), 2);
    const auto clean = now.filtered_by(*wavelet_, view_at(wall_pixel, size_));
    for (std::size_t i = 0; i < clean.size(); ++i) ASSERT_NEAR(clean[i].y, now.truth()[i].y, 2.0) << i;
  }
}

TEST_P(DenoiserHistory, SizeMayChange) {
  unsigned seed = 1;
  for (const glm::ivec2 size : {glm::ivec2(1, 1), {40, 1}, {65, 33}, {7, 9}, {1, 40}, {64, 64}, {2, 3}, {1, 1}}) {
    const Samples samples(
        gl_, size, 4, [](int, int) { return Pixel{.z = 5.0F}; }, ++seed);
    const auto clean = samples.filtered_by(*wavelet_, view_at(0.02 * seed, size));
    for (const glm::vec4& v : clean) EXPECT_NEAR(v.x, 1.0, 0.5) << size.x << " x " << size.y;
  }
}

// A coarse preview may be history for a finer image, but does not replace a finer history.
TEST_P(DenoiserHistory, CoarseImagesDoNotReplaceFineHistory) {
  std::vector<glm::vec4> truth;
  const double one = error_of(after(1, 0, &truth), truth);
  static_cast<void>(after(12, 0));
  const glm::ivec2 coarse(size_ / 4);
  const Samples rough(gl_, coarse, 1, [](int, int) {
    return Pixel{
        .front = glm::vec3(0.95F), .normal = {0.0F, 0.0F, 1.0F}, .albedo = glm::vec3(0.5F), .z = float(wall_z)};
  });
  PictureView wide = view_at(0.0, size_);
  static_cast<void>(rough.filtered_by(*wavelet_, wide));
  const Samples fine(gl_, size_, 1, wall_from(0), 30);
  EXPECT_LT(error_of(fine.filtered_by(*wavelet_, wide), truth), 0.5 * one);
}

TEST_P(DenoiserHistory, WithoutMemoryImagesAreFilteredWithoutHistory) {
  const Samples samples(gl_, size_, 1, wall_from(0), 20);
  const auto alone = samples.filtered(programs_);
  cumulet::test::FakeGl fake(cumulet::headless::Context::get_proc, context_.get());
  const gl::FunctionsPtr functions = gl::load_functions(cumulet::test::FakeGl::get_proc, &fake);
  // Numbers of textures; each takes two calls.
  constexpr std::int64_t filter = 2 * 7;
  constexpr std::int64_t history = 2 * 3;
  for (std::int64_t n = 0; n < filter + history; ++n) {
    Wavelet wavelet(functions, programs_);
    std::optional<cumulet::Error> error;
    fake.fail_allocation(n);
    if (n < filter) {
      EXPECT_THROW(samples.filtered_by(wavelet, view_at(0.0, size_)), cumulet::Error) << n;
      continue;
    }
    EXPECT_EQ(samples.filtered_by(wavelet, view_at(0.0, size_), MeansBackground::left_out, &error), alone) << n;
    fake.fail_allocation(-1);
    ASSERT_TRUE(error) << n;
    EXPECT_EQ(error->code(), cumulet::ErrorCode::out_of_memory);
    EXPECT_EQ(wavelet.bytes(), 112U * static_cast<unsigned>(size_.x * size_.y));
    // The error is returned once.
    EXPECT_EQ(samples.filtered_by(wavelet, view_at(0.0, size_), MeansBackground::left_out, &error), alone) << n;
    EXPECT_FALSE(error) << n;
  }
}

CUMULET_ON_BACKENDS(WaveletFilter);
CUMULET_ON_BACKENDS(DenoiserHistory);

}  // namespace
