// The denoiser's kernels compared with the same network in plain loops and doubles, and images that denoising must
// preserve.
#include "denoise/denoiser.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "denoise/plan.hpp"
#include "gl/state_guard.hpp"
#include "support/denoise_reference.hpp"
#include "support/gl_state.hpp"
#include "support/scrambling_host.hpp"
#include "support/tza.hpp"

namespace {

using namespace cumulet;
using denoise::Denoiser;
using denoise::make_network;
using denoise::NetworkPtr;
using denoise::read_tza;
using denoise::TensorArchive;
using denoise::Tile;
using glm::ivec2;
using glm::uvec2;
using glm::vec3;
using glm::vec4;
using test::base_widths;
using test::DenoiseReference;
using test::random_archive;
using test::small_widths;
namespace fs = std::filesystem;

constexpr std::uint64_t plenty = std::uint64_t{512} << 20U;
constexpr double whole = 1e18;  // multiplications per step: all work groups of a stage

// A bright ball in front of a dark wall with noise, and its albedo and normals.
struct Scene {
  ivec2 size;
  std::vector<vec4> color, albedo, normal;

  explicit Scene(ivec2 s, float noise = 1.0F) : size(s) {
    std::mt19937 random(5);
    std::exponential_distribution<float> specks(1.0F);
    for (int y = 0; y < s.y; ++y) {
      for (int x = 0; x < s.x; ++x) {
        const glm::vec2 p = (glm::vec2(x, y) + 0.5F) / float(std::max(s.x, s.y)) * 2.0F - glm::vec2(1.0F, 0.6F);
        const float r = glm::length(p);
        const bool ball = r < 0.5F;
        const float speck = 1.0F + noise * (specks(random) - 1.0F);
        const vec3 light = (ball ? vec3(4.0F, 3.0F, 2.0F) : vec3(0.02F, 0.03F, 0.05F)) * (1.2F + p.y) * speck;
        color.emplace_back(light, 0.25F + 0.5F * float(ball));
        albedo.emplace_back(ball ? vec3(0.9F, 0.7F, 0.5F) : vec3(0.2F), 0.0F);
        normal.emplace_back(ball ? vec3(p, std::sqrt(0.25F - r * r)) * 2.0F : vec3(0.0F, 0.0F, 1.0F), 0.0F);
      }
    }
  }
};

// Error bounds for random weights, which amplify errors more than learned weights.
constexpr double random_mean = 5e-4;
constexpr double random_most = 3e-3;

class Denoise : public test::GlTest {
 protected:
  gl::Object texture(const std::vector<vec4>& texels, ivec2 size) const {
    gl::Object made = gl::make_texture_2d(gl_, GL_RGBA32F, size.x, size.y, "a test's picture");
    if (!texels.empty()) gl_->TextureSubImage2D(made.name(), 0, 0, 0, size.x, size.y, GL_RGBA, GL_FLOAT, texels.data());
    return made;
  }

  std::vector<vec4> denoised(const NetworkPtr& network, const Scene& scene, std::uint64_t max_bytes = plenty,
                             double step = whole) const {
    const gl::StateGuard guard(*gl_);
    Denoiser denoiser(gl_, programs_, network, max_bytes);
    const gl::Object color = texture(scene.color, scene.size);
    const gl::Object albedo = texture(scene.albedo, scene.size);
    const gl::Object normal = texture(scene.normal, scene.size);
    const gl::Object result = texture({}, scene.size);
    denoiser.begin({scene.size, color.name(), albedo.name(), normal.name(), result.name()});
    EXPECT_EQ(denoiser.progress(), 0.0);
    steps_ = 1;
    double before = 0.0;
    while (!denoiser.step(step)) {
      ++steps_;
      EXPECT_LE(denoiser.progress() - before, std::max(step / denoiser.multiply_adds(), 0.05) + 0.5);
      EXPECT_GE(denoiser.progress(), before);  // unchanged while the driver compiles
      before = denoiser.progress();
    }
    EXPECT_DOUBLE_EQ(denoiser.progress(), 1.0);
    bytes_ = denoiser.bytes();
    std::vector<vec4> read(scene.color.size());
    gl_->GetTextureImage(result.name(), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(read.size() * sizeof(vec4)),
                         read.data());
    return read;
  }

  // Compares encoded values, in which half floats are equally exact everywhere.
  void expect_reference(const TensorArchive& archive, const Scene& scene, const char* what, double mean_bound,
                        double max_bound) const {
    const std::vector<vec4> ours = denoised(make_network(archive, what), scene);
    const double exposure = DenoiseReference::exposure(scene.color, scene.size);
    const bool guided = archive.at("enc_conv0.weight").shape[1] > 3;
    const auto theirs = DenoiseReference(archive).denoise(scene.color, guided ? scene.albedo : std::vector<vec4>{},
                                                          guided ? scene.normal : std::vector<vec4>{}, scene.size);
    double sum = 0.0;
    double most = 0.0;
    for (std::size_t i = 0; i < ours.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        const double difference = std::abs(DenoiseReference::encode(exposure * double(ours[i][c])) -
                                           DenoiseReference::encode(exposure * theirs[i][c]));
        sum += difference / double(3 * ours.size());
        most = std::max(most, difference);
      }
      EXPECT_EQ(ours[i].a, scene.color[i].a) << what << " " << i;
    }
    EXPECT_LT(sum, mean_bound) << what;
    EXPECT_LT(most, max_bound) << what;
  }

  mutable int steps_ = 0;
  mutable std::uint64_t bytes_ = 0;
};
CUMULET_ON_BACKENDS(Denoise);

// Longer tests, on one driver only.
class DenoiseMore : public Denoise {};
INSTANTIATE_TEST_SUITE_P(Gl, DenoiseMore, testing::Values(test::Door{headless::Backend::egl}),
                         [](const auto&) { return "egl"; });

TEST_P(Denoise, MatchesAPlainLoopImplementation) {
  expect_reference(random_archive(small_widths, 3, 1), Scene({48, 32}), "small", random_mean, random_most);
  expect_reference(random_archive(small_widths, 9, 2), Scene({48, 32}), "small, guided", random_mean, random_most);
  expect_reference(random_archive(base_widths, 9, 3), Scene({48, 32}), "base, guided", random_mean, random_most);
}

TEST_P(DenoiseMore, PublishedNetworksMatchAPlainLoopImplementation) {
  const fs::path data = CUMULET_SHARED_DATA "/oidn_weights";
  if (!fs::exists(data)) GTEST_SKIP() << "no " << data;
  for (const char* name : {"rt_hdr_alb_nrm.tza", "rt_hdr_alb_nrm_small.tza", "rt_hdr_calb_cnrm.tza", "rt_hdr.tza"}) {
    expect_reference(read_tza((data / name).string()), Scene({48, 32}), name, 6e-5, 6e-4);
  }
}

// Mean squared error of encoded values, so that dark and bright pixels count alike.
double error_of(const std::vector<vec4>& picture, const Scene& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < picture.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const double difference = DenoiseReference::encode(picture[i][c]) - DenoiseReference::encode(truth.color[i][c]);
      sum += difference * difference / (3.0 * double(picture.size()));
    }
  }
  return sum;
}

TEST_P(DenoiseMore, PublishedNetworksRemoveNoiseAndKeepCleanImages) {
  const fs::path data = CUMULET_SHARED_DATA "/oidn_weights";
  if (!fs::exists(data)) GTEST_SKIP() << "no " << data;
  const Scene noisy({96, 64});
  const Scene clean({96, 64}, 0.0F);
  for (const char* name : {"rt_hdr_alb_nrm.tza", "rt_hdr_alb_nrm_small.tza", "rt_hdr.tza", "rt_hdr_small.tza"}) {
    const NetworkPtr network = make_network(read_tza((data / name).string()), name);
    EXPECT_LT(error_of(denoised(network, noisy), clean), 0.1 * error_of(noisy.color, clean)) << name;
    EXPECT_LT(error_of(denoised(network, clean), clean), 1e-4) << name;
    // A constant image stays constant at any exposure.
    for (const float value : {1e-4F, 3000.0F}) {
      Scene constant({64, 64});
      std::ranges::fill(constant.color, vec4(value, value, value, 1.0F));
      std::ranges::fill(constant.albedo, vec4(0.5F));
      std::ranges::fill(constant.normal, vec4(0.0F, 0.0F, 1.0F, 0.0F));
      const std::vector<vec4> result = denoised(network, constant);
      double mean = 0.0;
      for (std::size_t i = 0; i < result.size(); ++i) {
        mean += result[i].g / value / (64.0 * 64.0);
        EXPECT_NEAR(result[i].g / value, 1.0F, 0.1F) << name << " " << i % 64 << "," << i / 64;
      }
      EXPECT_NEAR(mean, 1.0, 0.02) << name << " " << value;
    }
  }
}

TEST_P(DenoiseMore, ResultDoesNotDependOnSizeOrSteps) {
  const NetworkPtr network = make_network(random_archive(small_widths, 9), "small");
  for (const ivec2 size : {ivec2(1, 1), ivec2(17, 3), ivec2(5, 40), ivec2(33, 31)}) {
    const Scene scene(size);
    const auto at_once = denoised(network, scene);
    const int min_steps = steps_;
    for (const vec4& texel : at_once) EXPECT_TRUE(std::isfinite(texel.r));
    EXPECT_TRUE(denoised(network, scene, plenty, 1.0) == at_once) << size.x;
    EXPECT_GT(steps_, min_steps);
  }
  expect_reference(random_archive(small_widths, 9), Scene({17, 3}), "17x3", random_mean, random_most);
  Denoiser denoiser(gl_, programs_, network, plenty);
  denoiser.begin({});
  EXPECT_TRUE(denoiser.step(whole));
}

TEST_P(DenoiseMore, TilesLeaveNoSeams) {
  test::NetworkWidths narrow;
  narrow.fill(3);
  const NetworkPtr network = make_network(random_archive(narrow, 3), "narrow");
  const Scene scene({389, 40});
  const auto at_once = denoised(network, scene);
  const std::uint64_t bytes = bytes_;
  const auto in_tiles = denoised(network, scene, 1);
  EXPECT_LT(bytes_, bytes);
  std::size_t different = 0;
  for (std::size_t i = 0; i < at_once.size(); ++i) different += at_once[i] == in_tiles[i] ? 0 : 1;
  EXPECT_EQ(different, 0U);
}

TEST_P(Denoise, NonFiniteValuesStayInTheirPixel) {
  const NetworkPtr network = make_network(random_archive(small_widths, 9), "small");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinite = std::numeric_limits<float>::infinity();
  Scene black({32, 32});
  black.color[40] = black.color[600] = black.color[601] = vec4(0.0F, 0.0F, 0.0F, 1.0F);
  Scene broken = black;
  broken.color[40] = vec4(1.0F, nan, 1.0F, 1.0F);
  broken.color[600] = vec4(infinite, 1.0F, 1.0F, 1.0F);
  broken.color[601] = vec4(1.0F, 1.0F, -infinite, 1.0F);
  const auto expected = denoised(network, black);
  const auto result = denoised(network, broken);
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (i == 40 || i == 600 || i == 601) {
      EXPECT_EQ(std::memcmp(&result[i], &broken.color[i], sizeof(vec4)), 0) << i;
    } else {
      EXPECT_EQ(result[i], expected[i]) << i;
    }
  }
  // The same holds for non-finite guides.
  broken = black;
  broken.albedo[7] = vec4(nan);
  broken.normal[8] = vec4(infinite);
  for (const vec4& texel : denoised(network, broken)) EXPECT_TRUE(std::isfinite(texel.r + texel.g + texel.b));
}

TEST_P(Denoise, HostStateIsRestoredAndNotRead) {
  const NetworkPtr network = make_network(random_archive(small_widths, 9), "small");
  const Scene scene({20, 20});
  const auto expected = denoised(network, scene);
  test::ScramblingHost host(gl_);
  for (std::uint32_t seed = 0; seed < 4; ++seed) {
    host.scramble(seed);
    const test::GlState before = test::read_gl_state(*gl_);
    EXPECT_TRUE(denoised(network, scene) == expected) << seed;
    EXPECT_EQ(test::state_differences(before, test::read_gl_state(*gl_)), "") << seed;
  }
}

TEST(DenoisePlan, TilesCoverTheImageOnceWithTheirReceptiveField) {
  constexpr unsigned reach = denoise::Network::reach;
  for (const uvec2 size : {uvec2(1), uvec2(16, 700), uvec2(1921, 1080), uvec2(4000, 300), uvec2(16384)}) {
    for (const std::uint64_t most : {std::uint64_t{1}, std::uint64_t{300000}, std::uint64_t{1} << 40U}) {
      const std::vector<Tile> tiles = denoise::tiles_of(size, most);
      std::uint64_t covered = 0;
      const uvec2 padded = (size + 15U) / 16U * 16U;
      for (const Tile& tile : tiles) {
        EXPECT_EQ(tile.begin % 16U, uvec2(0U));
        EXPECT_EQ(tile.size % 16U, uvec2(0U));
        EXPECT_LE(std::uint64_t{tile.size.x} * tile.size.y, std::max<std::uint64_t>(most, 256 * 256));
        const uvec2 kept = tile.keep_end - tile.keep_begin;
        covered += std::uint64_t{kept.x} * kept.y;
        for (int axis = 0; axis < 2; ++axis) {
          const unsigned end = tile.begin[axis] + tile.size[axis];
          EXPECT_TRUE(tile.begin[axis] == 0 || tile.begin[axis] + reach == tile.keep_begin[axis]);
          EXPECT_TRUE(end == padded[axis] || end >= tile.keep_end[axis] + reach);
          EXPECT_LE(end, padded[axis]);
          EXPECT_LE(tile.keep_end[axis], size[axis]);
        }
      }
      EXPECT_EQ(covered, std::uint64_t{size.x} * size.y);
      EXPECT_TRUE(tiles.size() == 1 || most < std::uint64_t{1} << 39U);
    }
  }
}

TEST(DenoisePlan, BuffersAreNotOverwrittenWhileInUse) {
  const NetworkPtr network = make_network(random_archive(base_widths, 9), "base");
  const uvec2 size(512, 256);
  const denoise::Memory memory = denoise::memory_of(*network, size);
  const auto extent = [&](std::size_t i) {
    const denoise::Convolution& convolution = network->convolutions.at(i);
    const unsigned level = convolution.level + (convolution.pooled ? 1 : 0);
    return denoise::result_blocks(convolution) * (size.x >> level) * (size.y >> level);
  };
  constexpr std::uint32_t unknown = 99;
  std::vector<std::uint32_t> owner(memory.size, unknown);
  const auto fill = [&](std::uint32_t at, std::uint32_t count, std::uint32_t value) {
    ASSERT_LE(at + count, memory.size);
    std::fill_n(owner.begin() + at, count, value);
  };
  constexpr std::uint32_t of_input = 50;
  fill(memory.input, denoise::input_blocks(*network) * size.x * size.y, of_input);
  for (std::size_t i = 0; i < network->convolutions.size(); ++i) {
    const denoise::Convolution& convolution = network->convolutions.at(i);
    // The result of the last layer is the image. Each other result is written while the layer's inputs are still in
    // use.
    if (i + 1 < network->convolutions.size()) fill(memory.results.at(i), extent(i), static_cast<std::uint32_t>(i));
    for (const denoise::Source& source : convolution.sources) {
      const std::uint32_t at = source.convolution ? memory.results.at(*source.convolution) : memory.input;
      const std::uint32_t count =
          source.convolution ? extent(*source.convolution) : denoise::input_blocks(*network) * size.x * size.y;
      const auto value = static_cast<std::uint32_t>(source.convolution.value_or(of_input));
      EXPECT_EQ(std::count(owner.begin() + at, owner.begin() + at + count, value), count) << convolution.name;
    }
  }
  EXPECT_LE(double(memory.size) * 16.0 / (size.x * size.y), 260.0);
}

}  // namespace
