// Volumes of more than 2^15 voxels per side: distant parts look the same as in a small volume.

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "jobs/builder.hpp"
#include "support/gl_viewer.hpp"
#include "support/volumes.hpp"
#include "support/wide_volumes.hpp"

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::ivec3;
using viewer::BuildOn;

class LargeVolumes : public test::StillTest {
 protected:
  // Refines to the voxels, so that the grids are equal in both volumes.
  static void set_grid(test::Still& still, BuildOn on) {
    viewer::GridSettings settings;
    settings.build.on = on;
    settings.build.refine.threshold = -1.0;
    still.set_grid(settings);
  }
  // Looks at a cloud at this position, 30 voxels wide.
  static void look(test::Still& still, const ivec3& at) {
    const dvec3 centre = dvec3(at) + dvec3(15.0, 14.0, 12.0);
    still.set_camera(test::camera_at(centre + dvec3(20.0, 15.0, 80.0), centre, 28.0));
  }
};
CUMULET_ON_BACKENDS(LargeVolumes);

double max_apart(const test::Picture& a, const test::Picture& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    most = std::max(most, std::abs(double(a.pixels[i].a) - double(b.pixels[i].a)));
  return most;
}

// Root mean square of the differences, relative to the mean.
double apart(const test::Picture& a, const test::Picture& b) {
  double square = 0.0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const dvec3 d = dvec3(a.pixels[i]) - dvec3(b.pixels[i]);
    square += glm::dot(d, d);
  }
  const glm::dvec4 mean = b.mean();
  return std::sqrt(square / (3.0 * double(a.pixels.size()))) * 3.0 / (mean.r + mean.g + mean.b);
}

// The far one of two clouds compared with a single cloud near the origin. Opacities agree within 2e-3, and paths are
// the same except where rounding decides. Tests CPU and GPU builds.
TEST_P(LargeVolumes, DistantCloudMatchesANearOne) {
  const auto cloud = test::noise_volume({30, 28, 25}, ivec3(0), 1);
  const ivec3 low(1'000'000, -500'000, 64);
  const ivec3 by(200'000, 131'072, 30'008);
  const auto near = make();
  near->set_volume(cloud);
  still_->set_volume(test::moved(test::clouds_apart(cloud, by), low));
  near->set_light({30.0F, 30.0F, glm::vec3(3.0F), glm::vec3(0.3F)});
  for (test::Still* still : {still_.get(), near.get()}) still->set_medium({0.3, glm::vec3(0.9F), {}, 8});
  set_grid(*near, BuildOn::cpu);
  look(*near, ivec3(0));
  const test::Image opaque{48, 40, 1, 5, render::View::density};
  const test::Image image{32, 28, 24, 5, render::View::shaded};
  test::Image other = image;
  other.seed = 6;
  const test::Picture alpha = test::render(*near, opaque);
  const test::Picture shaded = test::render(*near, image);
  const double noise = apart(test::render(*near, other), shaded);
  EXPECT_GT(alpha.mean().a, 0.2);
  for (const BuildOn on : {BuildOn::cpu, BuildOn::gpu}) {
    SCOPED_TRACE(on == BuildOn::cpu ? "cpu" : "gpu");
    set_grid(*still_, on);
    for (const ivec3& at : {low, low + by}) {
      look(*still_, at);
      EXPECT_LT(max_apart(test::render(*still_, opaque), alpha), 2e-3);
    }
    EXPECT_GT(viewer().stats().cells, 2U * near->viewer().stats().cells - 5000U);
    const test::Picture far = test::render(*still_, image);
    EXPECT_LT(apart(far, shaded), 0.5 * noise);
    EXPECT_LT(std::abs(far.mean().g / shaded.mean().g - 1.0), 0.01);
  }
}

// A sheet of 8 voxels at the far end, seen from nearby and from 100,000 voxels away: Beer-Lambert law.
TEST_P(LargeVolumes, DistantSheetFollowsBeerLambert) {
  const ivec3 at(240'000, 131'080, 131'064);
  const auto speck = test::make_volume({8, 8, 8}, ivec3(0), [](const ivec3&) { return 1.0F; });
  still_->set_volume(test::both(speck, test::moved(test::slab(), at)));
  still_->set_medium({0.1, glm::vec3(0.0F), {}, 0});
  for (const BuildOn on : {BuildOn::cpu, BuildOn::gpu}) {
    set_grid(*still_, on);
    for (const double height : {300.0, 100'000.0}) {
      viewer::CameraPose pose =
          test::camera_at(dvec3(at) + dvec3(32.0, height, 32.0), dvec3(at) + dvec3(32.0, 0.0, 32.0), 300.0 / height);
      pose.up = {0.0, 0.0, -1.0};
      still_->set_camera(pose);
      const test::Picture picture = test::render(*still_, {16, 16, 1, 0, render::View::density});
      for (const glm::vec4& pixel : picture.pixels) ASSERT_NEAR(pixel.a, -std::expm1(-0.8), 1e-3) << height;
    }
  }
}

// A fire far away, sampled by NEE: its light table has cells of both record layouts.
TEST_P(LargeVolumes, DistantFireMatchesANearOne) {
  const auto fire = [](const ivec3& by) {
    volume::VolumeFrame frame;
    frame.density = test::noise_volume({30, 28, 25}, ivec3(0), 1);
    frame.flame = test::noise_volume({30, 28, 25}, ivec3(0), 2);
    if (by != ivec3(0)) {
      frame.density = test::clouds_apart(frame.density, by);
      frame.flame = test::clouds_apart(*frame.flame, by);
    }
    return frame;
  };
  const ivec3 by(150'000, 0, 0);
  const auto near = make();
  near->set_volume(fire(ivec3(0)));
  still_->set_volume(fire(by));
  viewer::Medium medium;
  medium.density_scale = 0.3;
  medium.field_emission.flame_strength = 2.0;
  medium.field_emission.flame_color = {1.0F, 0.4F, 0.1F};
  for (test::Still* still : {still_.get(), near.get()}) {
    still->set_medium(medium);
    still->set_light({30.0F, 30.0F, glm::vec3(0.2F), glm::vec3(0.02F)});
  }
  set_grid(*near, BuildOn::cpu);
  look(*near, ivec3(0));
  const test::Image image{24, 24, 48, 5, render::View::shaded};
  const test::Picture shaded = test::render(*near, image);
  for (const BuildOn on : {BuildOn::cpu, BuildOn::gpu}) {
    set_grid(*still_, on);
    look(*still_, by);
    const test::Picture far = test::render(*still_, image);
    EXPECT_LT(std::abs(far.mean().r / shaded.mean().r - 1.0), 0.02);
    EXPECT_LT(std::abs(far.mean().b / shaded.mean().b - 1.0), 0.05);
  }
}

}  // namespace
