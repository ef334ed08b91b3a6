// Coarse proxies shown while a large file loads: compared with OpenVDB's own trees, and in a viewer whose load is
// paused.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <fstream>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <mutex>
#include <optional>
#include <ranges>
#include <thread>
#include <tuple>
#include <vector>

#include "assets/instance.hpp"
#include "support/folder.hpp"
#include "support/gl_viewer.hpp"
#include "support/vdb_files.hpp"
#include "volume/bricks.hpp"
#include "volume/frame_import.hpp"

namespace {

using namespace cumulet;
using namespace std::chrono_literals;

/// A ball of this radius around (centre, centre, centre); values depend on the position.
openvdb::FloatGrid::Ptr ball(const std::string& name, int centre, int radius,
                             const std::function<float(const openvdb::Coord&)>& value) {
  auto grid = test::fog(name);
  auto accessor = grid->getAccessor();
  for (int x = -radius; x <= radius; ++x) {
    for (int y = -radius; y <= radius; ++y) {
      for (int z = -radius; z <= radius; ++z) {
        const openvdb::Coord at(centre + x, centre + y, centre + z);
        if (x * x + y * y + z * z <= radius * radius) accessor.setValueOn(at, value(at));
      }
    }
  }
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
  return grid;
}

std::function<float(const openvdb::Coord&)> everywhere(float value) {
  return [value](const openvdb::Coord&) { return value; };
}

void write(const std::filesystem::path& file, const openvdb::GridPtrVec& grids,
           std::uint32_t compression = openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK) {
  openvdb::io::File out(file.string());
  out.setCompression(compression);
  out.write(grids);
  out.close();
}

float value_at(const volume::ScalarVolume& field, const glm::ivec3& voxel) {
  if (glm::any(glm::lessThan(voxel, field.bounds_min)) || glm::any(glm::greaterThan(voxel, field.bounds_max)))
    return 0.0F;
  volume::BrickValues::Brick room;
  if (const float* brick = volume::find_brick(field, voxel & ~7, room))
    return brick[((voxel.x & 7) * 8 + (voxel.y & 7)) * 8 + (voxel.z & 7)];
  for (const volume::Tile& tile : field.tiles) {
    if (glm::all(glm::greaterThanEqual(voxel, tile.min)) && glm::all(glm::lessThanEqual(voxel, tile.max)))
      return tile.value;
  }
  return field.background;
}

double sum_of(const volume::ScalarVolume& field) {
  double sum = 0.0;
  for (glm::ivec3 v = field.bounds_min; v.x <= field.bounds_max.x; ++v.x) {
    for (v.y = field.bounds_min.y; v.y <= field.bounds_max.y; ++v.y) {
      for (v.z = field.bounds_min.z; v.z <= field.bounds_max.z; ++v.z) sum += double{value_at(field, v)};
    }
  }
  return sum;
}

class CoarseProxies : public testing::Test {
 protected:
  /// Imports the file. Returns the proxy, if there was one.
  std::optional<volume::Proxy> import(std::uint64_t min_bricks = 1, const volume::GridNames& names = {}) {
    std::optional<volume::Proxy> taken;
    const volume::ProxyRequest request{[&](volume::Proxy made) {
                                         EXPECT_FALSE(taken);
                                         taken = std::move(made);
                                       },
                                       min_bricks};
    whole_ = volume::import_frame(file(), names, Log(), nullptr, request);
    return taken;
  }
  [[nodiscard]] std::filesystem::path file() const { return folder_ / "large.vdb"; }

  volume::VolumeFrame whole_;

 private:
  test::Folder folder_;
};

// The proxy uses only the tree and its masks. With one value everywhere it is exact.
TEST_F(CoarseProxies, ConstantVolumeIsExactInEveryCompression) {
  constexpr float value = 0.75F;
  using namespace openvdb::io;
  for (const std::uint32_t compression :
       {std::uint32_t{COMPRESS_NONE}, std::uint32_t{COMPRESS_ACTIVE_MASK}, std::uint32_t{COMPRESS_ZIP},
        std::uint32_t{COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK}}) {
    for (const bool half : {false, true}) {
      const auto grid = ball("density", -13, 41, everywhere(value));
      grid->tree().addTile(1, openvdb::Coord(128, 0, -8), value, true);   // of 8^3
      grid->tree().addTile(2, openvdb::Coord(128, 128, 0), value, true);  // of 128^3
      std::map<std::tuple<int, int, int>, int> active;
      for (auto voxel = grid->cbeginValueOn(); voxel; ++voxel) {
        if (!voxel.isVoxelValue()) continue;
        const openvdb::Coord at = voxel.getCoord();
        ++active[{at.x() >> 2, at.y() >> 2, at.z() >> 2}];
      }
      grid->setSaveFloatAsHalf(half);
      write(file(), {grid}, compression);
      const auto made = import();
      ASSERT_TRUE(made);
      const volume::ScalarVolume& coarse = made->frame.density;
      for (const auto& [at, count] : active) {
        const auto [x, y, z] = at;
        ASSERT_NEAR(value_at(coarse, {x, y, z}), value * static_cast<float>(count) / 64.0F, 1e-3F);
      }
      for (const glm::ivec3 tile :
           {glm::ivec3(32, 0, -2), glm::ivec3(33, 1, -1), glm::ivec3(32, 32, 0), glm::ivec3(63, 63, 31)}) {
        EXPECT_EQ(value_at(coarse, tile), value);
      }
      EXPECT_EQ(value_at(coarse, {34, 0, -2}), 0.0F);
      EXPECT_EQ(coarse.bounds_min, whole_.density.bounds_min >> 2);
      EXPECT_EQ(coarse.bounds_max, whole_.density.bounds_max >> 2);
      EXPECT_EQ(whole_.density.active_voxels, grid->activeVoxelCount());
    }
  }
}

// Compared with the whole volume in double precision. For slowly varying values the sum is right to one percent, and
// local values are close.
TEST_F(CoarseProxies, MeanDensityMatchesTheFullVolume) {
  const auto slope = [](const openvdb::Coord& at) {
    return 1.0F + 0.004F * static_cast<float>(at.x()) + 0.002F * static_cast<float>(at.z());
  };
  write(file(), {ball("density", 64, 60, slope)});
  const auto made = import();
  ASSERT_TRUE(made);
  const volume::ScalarVolume& coarse = made->frame.density;
  const double whole = sum_of(whole_.density);
  EXPECT_NEAR(64.0 * sum_of(coarse) / whole, 1.0, 0.01);
  for (const int x : {24, 48, 64, 80, 104})
    EXPECT_NEAR(value_at(coarse, glm::ivec3(x, 64, 64) >> 2), slope(openvdb::Coord(x, 64, 64)), 0.05) << x;
  // The center of a coarse voxel is the center of the voxels that it covers.
  const glm::dvec3 first(coarse.index_to_world * glm::dvec4(3.0, 5.0, 7.0, 1.0));
  const glm::dvec3 of(whole_.density.index_to_world * glm::dvec4(13.5, 21.5, 29.5, 1.0));
  EXPECT_LT(glm::distance(first, of), 1e-12);
}

TEST_F(CoarseProxies, BoundsMatchTheFullVolume) {
  write(file(), {ball("density", 5, 37, everywhere(1.0F)), ball("flame", 40, 11, everywhere(2.0F))});
  const auto made = import();
  ASSERT_TRUE(made && made->extent);
  ASSERT_TRUE(made->frame.flame);
  EXPECT_GT(made->frame.flame->active_voxels, 0U);
  const volume::VolumeFrame& w = whole_;
  EXPECT_EQ(made->extent->low, glm::min(w.density.bounds_min, w.flame->bounds_min));
  EXPECT_EQ(made->extent->high, glm::max(w.density.bounds_max, w.flame->bounds_max));
  EXPECT_EQ(made->extent->index_to_world, w.density.index_to_world);
}

TEST_F(CoarseProxies, IncludeFlames) {
  write(file(), {ball("flames", 0, 30, everywhere(1.5F))});
  const auto made = import();
  ASSERT_TRUE(made && made->frame.flame && made->extent);
  EXPECT_TRUE(made->frame.density.empty());
  EXPECT_FLOAT_EQ(made->frame.flame->max_value, 1.5F);
  EXPECT_EQ(made->extent->low, glm::ivec3(-30));
}

TEST_F(CoarseProxies, AreBuiltOnlyForLargeFiles) {
  write(file(), {ball("density", 0, 30, everywhere(1.0F))});
  ASSERT_TRUE(import());
  const std::uint64_t bricks = whole_.density.brick_origins.size();
  EXPECT_FALSE(import(10 * bricks));
  EXPECT_GT(whole_.density.active_voxels, 0U);  // the whole volume is read from the same tree
}

// Messages and the file's other fields are the same as without a proxy.
TEST_F(CoarseProxies, DoNotChangeTheFullImport) {
  const auto varied = [](const openvdb::Coord& at) {
    return static_cast<float>((at.x() * 7 + at.y() * 3) & 63) / 64.0F;
  };
  write(file(), {ball("density", 0, 33, varied), ball("temperature", 3, 20, varied), ball("flame", 0, 9, varied)});
  ASSERT_TRUE(import());
  const volume::VolumeFrame plain = volume::import_frame(file(), {}, Log());
  const auto fields = plain.fields();
  ASSERT_EQ(fields.size(), whole_.fields().size());
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const volume::ScalarVolume& other = *whole_.fields()[i];
    EXPECT_EQ(fields[i]->name, other.name);
    EXPECT_EQ(fields[i]->brick_origins, other.brick_origins);
    EXPECT_EQ(sum_of(*fields[i]), sum_of(other));
  }
}

TEST_F(CoarseProxies, ErrorsAreReportedOnceByTheFullImport) {
  const auto write_both = [&] {
    write(file(), {ball("density", 0, 33, everywhere(1.0F)), ball("temperature", 0, 33, everywhere(2.0F))});
    return std::filesystem::file_size(file());
  };
  const auto size = write_both();
  volume::GridNames missing;
  missing.temperature = "nowhere";
  const auto refusal = [&](bool with, const volume::GridNames& names) {
    return test::refusal(file(), [&] {
      if (with) {
        import(1, names);
      } else {
        static_cast<void>(volume::import_frame(file(), names, Log()));
      }
    });
  };
  EXPECT_EQ(refusal(true, missing), refusal(false, missing));
  // The file ends inside the temperature grid.
  const volume::GridNames any;
  for (const double at : {0.95, 0.75, 0.55}) {
    std::filesystem::resize_file(file(), static_cast<std::uintmax_t>(at * double(size)));
    EXPECT_NE(refusal(false, any), "");
    EXPECT_EQ(refusal(true, any), refusal(false, any)) << at;
  }
  write_both();
  // Values that no codec accepts: in the density, which comes first, or in the temperature.
  for (const double at : {0.9, 0.25}) {
    std::fstream damaged(file(), std::ios::in | std::ios::out | std::ios::binary);
    damaged.seekp(static_cast<std::streamoff>(at * double(size)));
    const std::vector<char> noise(size / 20, '\x7f');
    damaged.write(noise.data(), static_cast<std::streamsize>(noise.size()));
    damaged.close();
    EXPECT_NE(refusal(false, any), "");
    EXPECT_EQ(refusal(true, any), refusal(false, any)) << at;
  }
}

/// A viewer whose loads pause after the density was read, until go_on(). A negative voxel in the density causes the log
/// message that pauses them.
class CoarseProxyDisplay : public test::BackendTest {
 protected:
  static constexpr std::uint32_t size = 48;

  void SetUp() override {
    BackendTest::SetUp();
    if (IsSkipped()) return;
    write_file();
    viewer_ = std::make_unique<viewer::Viewer>(Log([this](LogLevel level, const char*) {
                                                 if (level == LogLevel::warning) stand_still();
                                               }),
                                               nullptr, true);
    viewer_->attach(headless::Context::get_proc, context_.get());
    viewer_->set_light({30.0F, 30.0F, glm::vec3(3.0F), glm::vec3(0.3F)});
    viewer::Medium medium;
    medium.density_scale = 0.3;
    viewer_->set_medium(medium);
    set_sampling(true);
  }
  void TearDown() override {
    go_on();
    viewer_.reset();
  }

  void write_file() const {
    const auto grid = ball("density", 20, 45, everywhere(1.0F));
    grid->tree().setValueOn(openvdb::Coord(20, 20, 20), -1.0F);
    write(path_.path() / "large.vdb", {grid});
  }
  void set_sampling(bool preview) { viewer_->set_sampling({16, 0, {render::View::shaded, preview}}); }
  void load(std::uint64_t min_bricks = 1) {
    viewer_->load_volume({.path = (path_ / "large.vdb").string(), .grids = {}, .min_proxy_bricks = min_bricks});
  }
  void stand_still() {
    std::unique_lock lock(mutex_);
    stands_ = true;
    changed_.notify_all();
    changed_.wait(lock, [this] { return goes_on_; });
  }
  void wait_for_stand() {
    std::unique_lock lock(mutex_);
    ASSERT_TRUE(changed_.wait_for(lock, 60s, [this] { return stands_; }));
  }
  void go_on() {
    const std::scoped_lock lock(mutex_);
    goes_on_ = true;
    changed_.notify_all();
  }
  /// The next load pauses as the first one did.
  void stand_again() {
    const std::scoped_lock lock(mutex_);
    stands_ = goes_on_ = false;
  }
  viewer::FrameResult render(double budget_ms = 1e4) {
    viewer::Frame frame;
    frame.target = viewer::Target::none;
    frame.size = {size, size};
    frame.viewport = {0, 0, size, size};
    frame.budget_ms = budget_ms;
    return viewer_->render(frame);
  }
  /// The image after some frames.
  std::vector<float> picture() {
    viewer::FrameResult result;
    for (int i = 0; i < 6 || result.preview || result.size.x != size; ++i) result = render(200.0);
    std::vector<float> rgba(std::size_t{4} * size * size);
    viewer_->read_linear(rgba.data(), rgba.size());
    return rgba;
  }
  /// The mean opacity of that image.
  double opacity() {
    const std::vector<float> rgba = picture();
    double sum = 0.0;
    for (std::size_t i = 3; i < rgba.size(); i += 4) sum += double{rgba[i]};
    return sum / (size * size);
  }
  std::vector<float> finished() {
    viewer_->wait(-1.0);
    while (!render().converged) {
    }
    std::vector<float> rgba(std::size_t{4} * size * size);
    viewer_->read_linear(rgba.data(), rgba.size());
    return rgba;
  }
  [[nodiscard]] bool shows_something() {
    try {
      viewer_->bounds();
      return true;
    } catch (const Error&) {
      return false;
    }
  }

  test::Folder path_;
  std::unique_ptr<viewer::Viewer> viewer_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stands_ = false;
  bool goes_on_ = false;
};

TEST_P(CoarseProxyDisplay, ProxyIsShownUntilTheFullVolumeIsLoaded) {
  load();
  wait_for_stand();
  const viewer::FrameResult result = render();
  EXPECT_TRUE(result.loading);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(viewer_->status().stage, Progress::Stage::loading);
  EXPECT_EQ(viewer_->volume(), nullptr);
  const viewer::Bounds early = viewer_->bounds();
  const double early_opacity = opacity();
  EXPECT_GT(early_opacity, 0.2);
  const viewer::CameraPose early_pose = viewer_->camera()->pose();
  go_on();
  viewer_->wait(-1.0);
  ASSERT_NE(viewer_->volume(), nullptr);
  const viewer::Bounds whole = viewer_->bounds();
  EXPECT_EQ(early.min, whole.min);
  EXPECT_EQ(early.max, whole.max);
  EXPECT_NEAR(opacity(), early_opacity, 0.03);
  EXPECT_EQ(viewer_->camera()->pose(), early_pose);
  // The final image is the same as without a proxy.
  set_sampling(false);
  const std::vector<float> with = finished();
  viewer_->set_volume(nullptr);
  load(1'000'000);
  EXPECT_EQ(finished(), with);
}

// Compared with the proxy's own volume, shown with each setting.
TEST_P(CoarseProxyDisplay, ProxyHasTheInterpolationOfTheGridSettings) {
  std::optional<volume::Proxy> proxy;
  volume::import_frame((path_ / "large.vdb"), {}, Log(), nullptr,
                       {[&](volume::Proxy made) { proxy = std::move(made); }, 1});
  ASSERT_TRUE(proxy);
  viewer_->camera()->set(test::camera_at({35.0, 25.0, 40.0}, {5.0, 5.0, 5.0}, 25.0));
  viewer_->set_sampling({1, 0, {render::View::density, true}});
  for (const render::March march : {render::March::tet, render::March::dense, render::March::brick}) {
    SCOPED_TRACE(static_cast<int>(march));
    viewer::GridSettings grid;
    grid.build.march = march;
    grid.build.interpolation = grid::Interpolation::linear;
    viewer_->set_grid(grid);
    load();
    wait_for_stand();
    const std::vector<float> shown = picture();
    viewer_->cancel();
    go_on();
    EXPECT_THROW(viewer_->wait(-1.0), Error);
    const auto own = std::make_shared<const viewer::VolumeAsset>(proxy->frame);
    viewer_->set_volume(own);
    viewer_->wait(-1.0);
    EXPECT_EQ(picture(), shown);
    grid.build.interpolation = grid::Interpolation::nearest;
    viewer_->set_grid(grid);
    viewer_->wait(-1.0);
    const std::vector<float> nearest = picture();
    EXPECT_GT(std::ranges::count_if(std::views::iota(0U, nearest.size()),
                                    [&](std::size_t i) { return std::abs(nearest[i] - shown[i]) > 0.02F; }),
              static_cast<std::ptrdiff_t>(nearest.size() / 20));
    viewer_->set_volume(nullptr);
    stand_again();
  }
}

TEST_P(CoarseProxyDisplay, ProxyDisappearsWithACancelledLoad) {
  load();
  wait_for_stand();
  EXPECT_GT(opacity(), 0.2);
  viewer_->cancel();
  go_on();
  EXPECT_THROW(viewer_->wait(-1.0), Error);
  EXPECT_FALSE(shows_something());
  render();
  EXPECT_FALSE(render().loading);
}

TEST_P(CoarseProxyDisplay, PreviousVolumeReturnsAfterACancelledLoad) {
  volume::ScalarVolume small;
  small.bounds_max = small.bounds_min;
  small.background = small.max_value = 1.0F;
  small.active_voxels = 1;
  viewer_->set_volume(std::make_shared<const viewer::VolumeAsset>(std::move(small)));
  viewer_->wait(-1.0);
  const viewer::Bounds before = viewer_->bounds();
  load();
  wait_for_stand();
  EXPECT_NE(viewer_->bounds().max, before.max);
  viewer_->cancel();
  go_on();
  EXPECT_THROW(viewer_->wait(-1.0), Error);
  EXPECT_EQ(viewer_->bounds().max, before.max);
}

TEST_P(CoarseProxyDisplay, GridIsBuiltForTheCurrentCamera) {
  volume::ScalarVolume small;
  small.bounds_max = glm::ivec3(7);
  small.background = small.max_value = 1.0F;
  small.active_voxels = 512;
  const auto before = std::make_shared<const viewer::VolumeAsset>(std::move(small));
  viewer::GridSettings grid;
  grid.camera_adaptive = true;
  viewer_->set_grid(grid);
  viewer_->set_volume(before);
  // Its grid is built for views while the file is read.
  viewer_->add_instance(std::make_shared<viewer::Instance>(
      viewer::InstanceSettings{.volume = before, .to_world = glm::translate(glm::dmat4(1.0), glm::dvec3(20.0))}));
  finished();
  load();
  wait_for_stand();
  viewer::CameraPose pose;
  pose.eye = {40.0, 30.0, 90.0};
  pose.target = {10.0, 4.0, 4.0};
  viewer_->camera()->set(pose);
  for (int i = 0; i < 4; ++i) render();
  viewer_->cancel();
  go_on();
  EXPECT_THROW(viewer_->wait(-1.0), Error);
  for (int i = 0; i < 3; ++i) render();
  EXPECT_NO_THROW(viewer_->wait(-1.0));
}

TEST_P(CoarseProxyDisplay, ProxyStaysUntilTheViewDependentGridIsBuilt) {
  viewer::GridSettings grid;
  grid.camera_adaptive = true;
  viewer_->set_grid(grid);
  load();
  wait_for_stand();
  EXPECT_GT(opacity(), 0.2);
  go_on();
  viewer_->wait(-1.0);
  // The file is read. Its grid is requested by a frame, which still shows the proxy.
  EXPECT_TRUE(render().loading);
  viewer_->wait(-1.0);
  EXPECT_GT(opacity(), 0.2);
  EXPECT_GT(viewer_->stats().cells, 0U);
}

TEST_P(CoarseProxyDisplay, NoProxyWithPreviewsOff) {
  set_sampling(false);
  load();
  wait_for_stand();
  render();
  EXPECT_FALSE(shows_something());
  set_sampling(true);
  render();
  EXPECT_FALSE(shows_something());
}

TEST_P(CoarseProxyDisplay, ProxyDisappearsWhenPreviewsAreTurnedOff) {
  load();
  wait_for_stand();
  render();
  EXPECT_TRUE(shows_something());
  set_sampling(false);
  EXPECT_FALSE(shows_something());
}

CUMULET_ON_BACKENDS(CoarseProxyDisplay);

}  // namespace
