// Traversal of NanoVDB grids compared with quadrature, and with the dense grid or bricks.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include "peer_shaders.hpp"
#include "support/still.hpp"

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::ivec3;

constexpr ivec3 size{136, 24, 24};  // across lower nodes
constexpr double view_height = 140.0;
constexpr std::uint32_t pixels = 24;
constexpr int seeds = 24;
constexpr double sun_irradiance = 3.0;
constexpr double deviations = 4.0;
constexpr std::array<std::pair<double, double>, 2> gauss{{{0.2113248654, 0.5}, {0.7886751346, 0.5}}};

/// Noise in half of the bricks; some of the others are constant.
volume::ScalarVolume broken_volume() {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit;
  volume::ScalarVolume v;
  v.index_to_world = glm::dmat4(1.0);
  v.bounds_min = ivec3(0);
  v.bounds_max = size - 1;
  v.max_value = 2.0F;
  for (int x = 0; x < size.x; x += 8) {
    for (int y = 0; y < size.y; y += 8) {
      for (int z = 0; z < size.z; z += 8) {
        const float kind = unit(random);
        if (kind < 0.5F) continue;
        v.brick_origins.emplace_back(x, y, z);
        for (int i = 0; i < volume::brick_voxels; ++i) {
          const float value = kind < 0.6F ? 0.5F : std::max(0.0F, 2.0F * std::pow(unit(random), 3.0F) - 0.05F);
          v.brick_values.as_floats().push_back(value);
          v.active_voxels += value > 0.0F ? 1 : 0;
        }
      }
    }
  }
  return v;
}

/// Reference in double precision with its own code.
class Truth {
 public:
  Truth(const volume::ScalarVolume& volume, double extinction, grid::Interpolation interpolation)
      : values_(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y * size.z)),
        linear_(interpolation == grid::Interpolation::linear) {
    volume::BrickValues::Brick room;
    for (std::size_t b = 0; b < volume.brick_origins.size(); ++b) {
      const float* values = volume.brick_values.brick(b, room);
      for (int i = 0; i < volume::brick_voxels; ++i)
        values_[index_of(volume.brick_origins[b] + ivec3(i / 64, (i / 8) % 8, i % 8))] = extinction * double{values[i]};
    }
  }

  /// Extinction at a point.
  [[nodiscard]] double at(const dvec3& p) const {
    if (!linear_) return value(ivec3(glm::floor(p + 0.5)));
    const dvec3 low = glm::floor(p);
    double sum = 0.0;
    for (int i = 0; i < 8; ++i) {
      const ivec3 corner(i & 1, (i >> 1) & 1, i >> 2);
      const dvec3 weight = glm::mix(1.0 - (p - low), p - low, dvec3(corner));
      sum += weight.x * weight.y * weight.z * value(ivec3(low) + corner);
    }
    return sum;
  }

  /// Optical depth of a part of a ray in one cell, exact for cubics.
  [[nodiscard]] double depth(const dvec3& o, const dvec3& d, double t_0, double t_1) const {
    double sum = 0.0;
    for (const auto& [part, weight] : gauss) sum += weight * (t_1 - t_0) * at(o + (t_0 + part * (t_1 - t_0)) * d);
    return sum;
  }

  /// Calls use(t_0, t_1) for each cell on the ray: a voxel, or with interpolation the cube between eight centers.
  template <class Use>
  void walk(const dvec3& o, const dvec3& d, const Use& use) const {
    const double beyond = linear_ ? 1.0 : 0.5;  // of the outer voxels' centers
    const double middle = linear_ ? 0.5 : 0.0;  // of a cell, from its voxel's center
    const dvec3 a = (dvec3(-beyond) - o) / d;
    const dvec3 b = (dvec3(size) - 1.0 + beyond - o) / d;
    const dvec3 near = glm::min(a, b);
    const dvec3 far = glm::max(a, b);
    double t = std::max({near.x, near.y, near.z, 0.0});
    const double end = std::min({far.x, far.y, far.z});
    while (t < end - 1e-9) {
      const dvec3 p = o + (t + 1e-9) * d;
      const dvec3 exit = (glm::floor(p + 0.5 - middle) + middle + 0.5 * glm::sign(d) - o) / d;
      const double next = std::min({exit.x, exit.y, exit.z, end});
      use(t, next);
      t = std::max(next, t + 1e-9);
    }
  }
  [[nodiscard]] double transmittance(const dvec3& o, const dvec3& d) const {
    double sum = 0.0;
    walk(o, d, [&](double t_0, double t_1) { sum += depth(o, d, t_0, t_1); });
    return std::exp(-sum);
  }

 private:
  static std::size_t index_of(const ivec3& p) { return static_cast<std::size_t>((p.x * size.y + p.y) * size.z + p.z); }
  [[nodiscard]] double value(const ivec3& p) const {
    const bool inside = glm::all(glm::greaterThanEqual(p, ivec3(0))) && glm::all(glm::lessThan(p, size));
    return inside ? values_[index_of(p)] : 0.0;
  }
  std::vector<double> values_;
  bool linear_;
};

struct Mean {
  double value = 0.0;
  double error = 0.0;  // its standard deviation
};

Mean mean_of(const std::vector<double>& values) {
  Mean mean;
  for (const double value : values) mean.value += value / static_cast<double>(values.size());
  double square = 0.0;
  for (const double value : values) square += (value - mean.value) * (value - mean.value);
  const auto n = static_cast<double>(values.size());
  mean.error = std::sqrt(square / (n * (n - 1.0)));
  return mean;
}

viewer::CameraPose pose() {
  viewer::CameraPose pose;
  pose.target = 0.5 * dvec3(size);
  pose.eye = pose.target + dvec3(110.0, 170.0, 230.0);
  pose.orthographic_height = view_height;
  return pose;
}

viewer::Light light(bool sky) {
  viewer::Light light;
  light.sun_azimuth_degrees = 50.0F;
  light.sun_elevation_degrees = 35.0F;
  light.sun_irradiance = glm::vec3(static_cast<float>(sun_irradiance));
  if (sky) light.sky_radiance = glm::vec3(0.7F);
  return light;
}

/// Means of the alpha and the radiance of an image.
struct Shown {
  Mean alpha, radiance;
};

class Shows {
 public:
  Shows(headless::Context& context, const viewer::VolumeAssetPtr& volume, scene::March march,
        grid::Interpolation interpolation, std::shared_ptr<viewer::Sharing> programs)
      : still_(context, headless::Context::get_proc, std::move(programs)) {
    still_.set_volume(volume);
    still_.set_camera(pose());
    viewer::GridSettings grid;
    grid.build.march = march;
    grid.build.interpolation = interpolation;
    still_.set_grid(grid);
  }
  Shown show(double density_scale, std::uint32_t bounces, bool sky, std::uint32_t samples) {
    viewer::Medium medium;
    medium.density_scale = density_scale;
    medium.max_bounces = bounces;
    still_.set_medium(medium);
    still_.set_light(light(sky));
    std::vector<double> alphas;
    std::vector<double> radiances;
    for (std::uint32_t seed = 0; seed < seeds; ++seed) {
      still_.set_image({pixels, pixels, samples, seed});
      still_.build();
      while (!still_.render(500.0)) {
      }
      const std::vector<float> rgba = still_.read();
      double alpha = 0.0;
      double radiance = 0.0;
      for (std::size_t i = 0; i < rgba.size(); i += 4) {
        alpha += rgba[i + 3];
        radiance += rgba[i];
      }
      alphas.push_back(alpha * 4.0 / static_cast<double>(rgba.size()));
      radiances.push_back(radiance * 4.0 / static_cast<double>(rgba.size()));
    }
    return {mean_of(alphas), mean_of(radiances)};
  }

 private:
  test::Still still_;
};

/// Expected single scattering of the sun, over the image.
struct Expected {
  double alpha = 0.0, radiance = 0.0;
};

Expected expected(const Truth& truth) {
  constexpr int rays = 128;
  const viewer::CameraPose camera = pose();
  const dvec3 forward = glm::normalize(camera.target - camera.eye);
  const dvec3 right = glm::normalize(glm::cross(forward, camera.up));
  const dvec3 up = glm::cross(right, forward);
  const double azimuth = 50.0 * std::numbers::pi / 180.0;
  const double elevation = 35.0 * std::numbers::pi / 180.0;
  const dvec3 sun{std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                  std::cos(elevation) * std::cos(azimuth)};
  Expected sum;
  for (int i = 0; i < rays * rays; ++i) {
    const double u = view_height * ((i % rays + 0.5) / rays - 0.5);
    const double v = view_height * ((i / rays + 0.5) / rays - 0.5);
    const dvec3 o = camera.eye + u * right + v * up;
    double depth = 0.0;
    double radiance = 0.0;
    truth.walk(o, forward, [&](double t_0, double t_1) {
      for (const auto& [at, weight] : gauss) {
        const double t = t_0 + at * (t_1 - t_0);
        const double extinction = truth.at(o + t * forward);
        if (extinction == 0.0) continue;
        radiance += weight * (t_1 - t_0) * extinction * std::exp(-depth - truth.depth(o, forward, t_0, t)) *
                    truth.transmittance(o + t * forward, sun);
      }
      depth += truth.depth(o, forward, t_0, t_1);
    });
    sum.alpha += (1.0 - std::exp(-depth)) / (rays * rays);
    sum.radiance += radiance * sun_irradiance / (4.0 * std::numbers::pi) / (rays * rays);
  }
  return sum;
}

struct Case {
  bench::NanoType type;
  bench::Look look;
  double density_scale;
  std::uint32_t samples;
  grid::Interpolation interpolation = grid::Interpolation::nearest;
};

class PeersTest : public testing::TestWithParam<Case> {};

TEST_P(PeersTest, ScatteringMatchesTheField) {
  const Case& c = GetParam();
  headless::Context context = headless::Context::create(headless::Backend::automatic);
  const auto volume = std::make_shared<const viewer::VolumeAsset>(broken_volume());
  const gl::FunctionsPtr functions = gl::load_functions(headless::Context::get_proc, &context);
  const bench::BoundGrid grid(functions, bench::make_nano_grid(volume->volume(), c.type, c.interpolation));
  const auto shaders = bench::peer_shaders(c.type, c.look);
  Shows nano(context, volume, scene::March::dense, c.interpolation, shaders->programs());

  const Truth truth(volume->volume(), c.density_scale, c.interpolation);
  const Expected single = expected(truth);
  const Shown shown = nano.show(c.density_scale, 1, false, c.samples);
  // The quadrature's own error, because it uses rays through pixel centers only.
  EXPECT_NEAR(shown.alpha.value, single.alpha, deviations * shown.alpha.error + 0.001 * single.alpha);
  EXPECT_NEAR(shown.radiance.value, single.radiance, deviations * shown.radiance.error + 0.001 * single.radiance);
  EXPECT_LT(shown.radiance.error, 0.01 * single.radiance) << "carries too little information";

  const bool linear = c.interpolation == grid::Interpolation::linear;
  Shows exact(context, volume, linear ? scene::March::brick : scene::March::dense, c.interpolation, nullptr);
  const Shown all = nano.show(c.density_scale, 0, true, 32);
  const Shown same = exact.show(c.density_scale, 0, true, 32);
  const double alpha_error = std::hypot(all.alpha.error, same.alpha.error);
  const double radiance_error = std::hypot(all.radiance.error, same.radiance.error);
  EXPECT_NEAR(all.alpha.value, same.alpha.value, deviations * alpha_error);
  EXPECT_NEAR(all.radiance.value, same.radiance.value, deviations * radiance_error);
  EXPECT_LT(radiance_error, 0.01 * same.radiance.value) << "carries too little information";
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, PeersTest,
    testing::Values(Case{bench::NanoType::float32, bench::Look::delta, 0.3, 64},
                    Case{bench::NanoType::float32, bench::Look::ratio, 0.3, 256},
                    // In such a thin medium, a lower node is one region.
                    Case{bench::NanoType::float32, bench::Look::ratio, 0.012, 256},
                    Case{bench::NanoType::fp16, bench::Look::ratio, 0.3, 64},
                    Case{bench::NanoType::float32, bench::Look::delta, 0.3, 64, grid::Interpolation::linear},
                    Case{bench::NanoType::float32, bench::Look::ratio, 0.3, 256, grid::Interpolation::linear},
                    Case{bench::NanoType::float32, bench::Look::ratio, 0.012, 256, grid::Interpolation::linear}));

// A leaf's maximum covers the cells up to the voxels of the next leaves, and each cell that is not empty is in a leaf.
TEST(NanoGrid, MaximaOfInterpolatedCells) {
  volume::ScalarVolume volume;
  volume.index_to_world = glm::dmat4(1.0);
  volume.bounds_min = ivec3(0);
  volume.bounds_max = ivec3(15);
  volume.max_value = 1.0F;
  volume.active_voxels = 1;
  volume.brick_origins.emplace_back(8, 8, 8);
  std::vector<float>& values = volume.brick_values.as_floats();
  values.assign(volume::brick_voxels, 0.0F);
  values[0] = 1.0F;  // voxel (8, 8, 8), a corner of cells in eight bricks
  const std::size_t one = bench::make_nano_grid(volume, bench::NanoType::float32).size();
  const std::size_t eight = bench::make_nano_grid(volume, bench::NanoType::float32, grid::Interpolation::linear).size();
  const std::size_t leaf_words = 2144 / 4;  // PNANOVDB's leaf of floats
  EXPECT_EQ(eight, one + 7 * leaf_words);
  EXPECT_THROW(bench::make_nano_grid(volume, bench::NanoType::fp16, grid::Interpolation::linear), std::runtime_error);
}

}  // namespace
