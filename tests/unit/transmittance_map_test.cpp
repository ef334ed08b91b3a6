// Transmittance maps as a host's shaders sample them, compared with sums over voxels in double precision.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <string>
#include <vector>

#include "support/c_host.hpp"
#include "support/fake_gl.hpp"

namespace {

using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::test::converge;
using cumulet::test::FakeGl;
using cumulet::test::HostTarget;
using cumulet::test::InstanceRef;
using cumulet::test::make_desc;
using cumulet::test::make_viewer;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
using glm::dmat4;
using glm::dvec3;
using glm::dvec4;

constexpr int side = 14;  // side length of the volume in voxels; the odd map sizes are not multiples of it

/// An asymmetric blob with a hole and a different value in each voxel.
class Blob {
 public:
  Blob() {
    std::minstd_rand random(7);
    std::uniform_real_distribution<float> some(0.2F, 1.0F);
    for (int z = 0; z < side; ++z) {
      for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
          const bool inside = x + y > 6 && z > 1 && x < 12 && !(x == 8 && y == 8);
          values_.push_back(inside ? some(random) : 0.0F);
        }
      }
    }
    auto desc = make_desc<cumulet_dense_desc>();
    desc.values = values_.data();
    desc.value_count = values_.size();
    for (int& extent : desc.size) extent = side;
    for (int i = 0; i < 4; ++i) desc.index_to_world[i * 5] = 1.0;
    cumulet_volume* out = nullptr;
    std::array<char, 256> error{};
    if (cumulet_volume_from_dense(&desc, &out, error.data(), error.size()) != CUMULET_OK)
      throw std::runtime_error(error.data());
    volume_ = VolumeRef(out);
  }
  [[nodiscard]] cumulet_volume* get() const { return volume_.get(); }

  /// Integral of the density along the line from a to b in world space.
  [[nodiscard]] double integral(const dvec3& a, const dvec3& b, const dmat4& to_world,
                                cumulet_interpolation interpolation) const {
    const bool linear = interpolation == CUMULET_INTERPOLATION_LINEAR;
    const dvec3 shift(linear ? 1.0 : 0.5);  // planes at the voxels' centers, the first one outside, or at their faces
    const dmat4 to_index = glm::inverse(to_world);
    const dvec3 from = dvec3(to_index * dvec4(a, 1.0)) + shift;
    const dvec3 way = dvec3(to_index * dvec4(b, 1.0)) + shift - from;
    std::vector<double> crossings{0.0, 1.0};
    for (int axis = 0; axis < 3; ++axis) {
      for (int plane = 0; plane <= side + (linear ? 1 : 0); ++plane) {
        const double t = (plane - from[axis]) / way[axis];
        if (t > 0.0 && t < 1.0) crossings.push_back(t);
      }
    }
    std::sort(crossings.begin(), crossings.end());
    double sum = 0.0;
    for (std::size_t i = 1; i < crossings.size(); ++i) {
      const dvec3 low = from + crossings[i - 1] * way - shift;
      const dvec3 high = from + crossings[i] * way - shift;
      const dvec3 middle = 0.5 * (low + high);
      // Simpson's rule is exact for cubics.
      const double mean = linear ? (between(low) + 4.0 * between(middle) + between(high)) / 6.0
                                 : voxel(glm::ivec3(glm::floor(middle + 0.5)));
      sum += mean * (crossings[i] - crossings[i - 1]);
    }
    return sum * glm::distance(a, b);
  }

 private:
  [[nodiscard]] double voxel(const glm::ivec3& p) const {
    if (glm::any(glm::lessThan(p, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(p, glm::ivec3(side)))) return 0.0;
    return values_[static_cast<std::size_t>((p.z * side + p.y) * side + p.x)];
  }
  /// Trilinear interpolation between voxels, at a point of index space.
  [[nodiscard]] double between(const dvec3& p) const {
    const dvec3 low = glm::floor(p);
    const dvec3 at = p - low;
    double sum = 0.0;
    for (int i = 0; i < 8; ++i) {
      const glm::ivec3 corner(i & 1, (i >> 1) & 1, i >> 2);
      const dvec3 weight = glm::mix(1.0 - at, at, dvec3(corner));
      sum += weight.x * weight.y * weight.z * voxel(glm::ivec3(low) + corner);
    }
    return sum;
  }

  std::vector<float> values_;
  VolumeRef volume_;
};

class TransmittanceMaps : public testing::Test {
 protected:
  static constexpr double density = 0.3;
  struct Standing {
    dmat4 to_world{1.0};
    double density = TransmittanceMaps::density;
  };

  TransmittanceMaps() {
    viewer_ = make_viewer({.get_proc = FakeGl::get_proc, .user = &fake_, .samples = 1});
    auto medium = make_desc<cumulet_medium_desc>();
    medium.density_scale = density;
    EXPECT_EQ(cumulet_set_medium(viewer_.get(), &medium), CUMULET_OK);
    use_march(CUMULET_GRID_DENSE);
    desc_.size = 67;
    desc_.slices = 41;
    desc_.budget_ms = 1000.0;
  }
  void use_march(cumulet_grid_type march) const {
    auto grid = make_desc<cumulet_grid_desc>();
    grid.type = march;
    grid.cells = CUMULET_CELLS_CONSTANT;
    grid.threshold = 1e-6;
    grid.interpolation = interpolation_;
    EXPECT_EQ(cumulet_set_grid(viewer_.get(), &grid), CUMULET_OK);
  }
  void show() {
    EXPECT_EQ(cumulet_set_volume(viewer_.get(), blob_.get()), CUMULET_OK);
    converge(viewer_.get(), target_.frame());
    standing_ = {{}};
  }
  cumulet_transmittance_map update() {
    auto map = make_desc<cumulet_transmittance_map>();
    map.incomplete = 1;
    for (int i = 0; i < 100 && map.incomplete != 0; ++i) {
      EXPECT_EQ(cumulet_update_transmittance_map(viewer_.get(), &desc_, &map), CUMULET_OK)
          << cumulet_last_error(viewer_.get());
    }
    EXPECT_EQ(map.incomplete, 0);
    return map;
  }
  [[nodiscard]] dvec3 from() const { return {desc_.position[0], desc_.position[1], desc_.position[2]}; }
  /// Position of the light for a point of the map.
  [[nodiscard]] dvec3 source(const dvec3& point, const dvec3& towards) const {
    return desc_.light == CUMULET_MAP_LIGHT_POINT ? from() : point + 400.0 * towards;
  }
  [[nodiscard]] double expected(const dvec3& point, const dvec3& towards) const {
    double depth = 0.0;
    for (const Standing& one : standing_)
      depth += one.density * blob_.integral(source(point, towards), point, one.to_world, interpolation_);
    return std::exp(-depth);
  }
  /// Values that a host's shader samples at these points.
  std::vector<float> looked_up(const cumulet_transmittance_map& map, const std::vector<dvec3>& points) {
    const GladGLContext& gl = fake_.real();
    const std::string source =
        std::string("#version 450\n") + cumulet_transmittance_map_glsl() +
        "layout(local_size_x = 64) in;\n"
        "layout(binding = 0) uniform sampler3D map;\n"
        "layout(location = 0) uniform mat4 to_map;\n"
        "layout(location = 1) uniform vec2 range;\n"
        "layout(std430, binding = 0) readonly buffer Points { vec4 points[]; };\n"
        "layout(std430, binding = 1) writeonly buffer Found { float found[]; };\n"
        "void main() {\n"
        "  uint i = gl_GlobalInvocationID.x;\n"
        "  if (i < points.length()) found[i] = cumulet_transmittance(map, to_map, range, points[i].xyz);\n"
        "}\n";
    const char* text = source.c_str();
    const GLuint program = gl.CreateShaderProgramv(GL_COMPUTE_SHADER, 1, &text);
    GLint linked = 0;
    gl.GetProgramiv(program, GL_LINK_STATUS, &linked);
    EXPECT_EQ(linked, 1);
    std::vector<glm::vec4> positions;
    for (const dvec3& point : points) positions.emplace_back(glm::vec3(point), 1.0F);
    std::array<GLuint, 2> buffers{};
    gl.CreateBuffers(2, buffers.data());
    gl.NamedBufferStorage(buffers[0], static_cast<GLsizeiptr>(positions.size() * sizeof(glm::vec4)), positions.data(),
                          0);
    gl.NamedBufferStorage(buffers[1], static_cast<GLsizeiptr>(positions.size() * sizeof(float)), nullptr, 0);
    std::array<float, 16> to_map{};
    std::copy_n(map.to_map, 16, to_map.begin());
    gl.ProgramUniformMatrix4fv(program, 0, 1, GL_FALSE, to_map.data());
    gl.ProgramUniform2f(program, 1, static_cast<float>(map.near_distance), static_cast<float>(map.far_distance));
    gl.UseProgram(program);
    gl.BindTextureUnit(0, map.texture);
    for (GLuint i = 0; i < 2; ++i) gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, i, buffers.at(i));
    gl.DispatchCompute(static_cast<GLuint>((points.size() + 63) / 64), 1, 1);
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    std::vector<float> found(points.size());
    gl.GetNamedBufferSubData(buffers[1], 0, static_cast<GLsizeiptr>(found.size() * sizeof(float)), found.data());
    gl.UseProgram(0);
    gl.BindTextureUnit(0, 0);
    gl.DeleteBuffers(2, buffers.data());
    gl.DeleteProgram(program);
    return found;
  }
  /// World positions of the texel centers.
  [[nodiscard]] std::vector<dvec3> middles(const cumulet_transmittance_map& map) const {
    dmat4 to_map(1.0);
    for (int i = 0; i < 16; ++i) to_map[i / 4][i % 4] = map.to_map[i];
    const dmat4 back = glm::inverse(to_map);
    const auto last = static_cast<int>(map.size) - 1;
    std::vector<dvec3> points;
    for (int z = 0; z < static_cast<int>(map.slices); z += 5) {
      for (int y = 0; y <= last; y += 6) {
        for (int x = 0; x <= last; x += 6) {
          if (desc_.light != CUMULET_MAP_LIGHT_POINT) {
            const dvec3 within = (dvec3(x, y, z) + 0.5) / dvec3(map.size, map.size, map.slices);
            points.emplace_back(back * dvec4(within, 1.0));
            continue;
          }
          const glm::dvec2 position = 2.0 * glm::dvec2(x, y) / double(last) - 1.0;
          dvec3 d(position, 1.0 - std::abs(position.x) - std::abs(position.y));
          if (d.z < 0.0) {
            d.x = (1.0 - std::abs(position.y)) * (position.x < 0.0 ? -1.0 : 1.0);
            d.y = (1.0 - std::abs(position.x)) * (position.y < 0.0 ? -1.0 : 1.0);
          }
          const double r = map.near_distance + (map.far_distance - map.near_distance) * z / (map.slices - 1.0);
          points.push_back(from() + r * glm::normalize(d));
        }
      }
    }
    return points;
  }
  void expect_truth(const dvec3& towards) {
    const cumulet_transmittance_map map = update();
    EXPECT_EQ(map.size, desc_.size);
    EXPECT_EQ(map.slices, desc_.slices);
    const std::vector<dvec3> points = middles(map);
    const std::vector<float> found = looked_up(map, points);
    double least = 1.0;
    int far_off = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double truth = expected(points[i], towards);
      least = std::min(least, truth);
      // A ray along voxel faces may be on either side of them.
      if (std::abs(found[i] - truth) > 2e-3) ++far_off;
    }
    EXPECT_LE(far_off, static_cast<int>(points.size()) / 200);
    EXPECT_LT(least, 0.4) << "there is some shadow";
    // At arbitrary points, values are interpolated.
    std::mt19937 random(3);
    std::uniform_real_distribution<double> within(-15.0, 30.0);
    std::vector<dvec3> scattered;
    for (int i = 0; i < 3000; ++i) scattered.emplace_back(within(random), within(random), within(random));
    const std::vector<float> there = looked_up(map, scattered);
    double squared = 0.0;
    double worst = 0.0;
    for (std::size_t i = 0; i < scattered.size(); ++i) {
      const double off = std::abs(there[i] - expected(scattered[i], towards));
      squared += off * off;
      worst = std::max(worst, off);
    }
    EXPECT_LT(std::sqrt(squared / 3000.0), 0.02);
    EXPECT_LT(worst, 0.5) << "an edge between voxels is as wide as a texel";
  }

  Context context_ = Context::create(Backend::automatic);
  FakeGl fake_{Context::get_proc, &context_};
  HostTarget target_{fake_.real(), 32, 32};
  Blob blob_;
  ViewerPtr viewer_;
  std::vector<Standing> standing_;
  cumulet_interpolation interpolation_ = CUMULET_INTERPOLATION_NEAREST;
  cumulet_transmittance_map_desc desc_ = make_desc<cumulet_transmittance_map_desc>();
};

// The sun direction of make_viewer.
dvec3 sun() {
  const double azimuth = glm::radians(60.0);
  const double elevation = glm::radians(40.0);
  return {std::sin(azimuth) * std::cos(elevation), std::sin(elevation), std::cos(azimuth) * std::cos(elevation)};
}

TEST_F(TransmittanceMaps, FollowTheSunForEveryGridType) {
  show();
  for (const cumulet_grid_type march : {CUMULET_GRID_DENSE, CUMULET_GRID_BRICKS, CUMULET_GRID_TETRAHEDRAL}) {
    SCOPED_TRACE(march);
    use_march(march);
    converge(viewer_.get(), target_.frame());
    expect_truth(sun());
  }
}

TEST_F(TransmittanceMaps, SeeInterpolatedVoxels) {
  show();
  interpolation_ = CUMULET_INTERPOLATION_LINEAR;
  for (const cumulet_grid_type march : {CUMULET_GRID_DENSE, CUMULET_GRID_BRICKS}) {
    SCOPED_TRACE(march);
    use_march(march);
    converge(viewer_.get(), target_.frame());
    expect_truth(sun());
  }
}

TEST_F(TransmittanceMaps, WorkForAnyDirection) {
  show();
  desc_.light = CUMULET_MAP_LIGHT_DIRECTION;
  for (const dvec3& towards : {dvec3(0.0, 3.0, 0.0), dvec3(0.0, -1.0, 0.0), dvec3(1e-5, 2e-5, -1e-5)}) {
    for (int i = 0; i < 3; ++i) desc_.direction[i] = towards[i];
    expect_truth(glm::normalize(towards));
  }
}

TEST_F(TransmittanceMaps, CoverPointsOutsideAndInside) {
  show();
  desc_.light = CUMULET_MAP_LIGHT_POINT;
  desc_.size = 131;
  desc_.slices = 61;
  for (const dvec3& position : {dvec3(5.0, 25.0, 9.0), dvec3(8.3, 7.9, 6.1)}) {
    for (int i = 0; i < 3; ++i) desc_.position[i] = position[i];
    expect_truth({});
  }
}

TEST_F(TransmittanceMaps, IncludeAllInstances) {
  show();
  dmat4 transform = glm::translate(dmat4(1.0), dvec3(9.0, -3.0, 4.0));
  transform = glm::rotate(transform, 0.7, dvec3(1.0, 2.0, 0.5));
  transform = glm::scale(transform, dvec3(1.3, 0.6, 1.0));
  transform[0].y += 0.3;
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 0.2;
  auto desc = make_desc<cumulet_instance_desc>();
  desc.volume = blob_.get();
  desc.medium = &medium;
  for (int i = 0; i < 16; ++i) desc.to_world[i] = transform[i / 4][i % 4];
  const InstanceRef one = cumulet::test::make_instance(desc);
  ASSERT_EQ(cumulet_add_instance(viewer_.get(), one.get()), CUMULET_OK);
  converge(viewer_.get(), target_.frame());
  standing_.push_back({transform, 0.2});
  expect_truth(sun());
  // After a move and another update.
  transform[3] += dvec4(-5.0, 2.0, 0.0, 0.0);
  for (int i = 0; i < 16; ++i) desc.to_world[i] = transform[i / 4][i % 4];
  ASSERT_EQ(cumulet_instance_set_to_world(one.get(), desc.to_world), CUMULET_OK);
  converge(viewer_.get(), target_.frame());
  standing_.back().to_world = transform;
  expect_truth(sun());
}

TEST_F(TransmittanceMaps, AreReusedWhileNothingChanges) {
  show();
  const cumulet_transmittance_map map = update();
  const auto dispatches = fake_.calls("DispatchCompute");
  const cumulet_transmittance_map again = update();
  EXPECT_EQ(fake_.calls("DispatchCompute"), dispatches);
  EXPECT_EQ(again.texture, map.texture);
  desc_.slot = 3;
  const cumulet_transmittance_map other = update();
  EXPECT_NE(other.texture, map.texture);
  auto stats = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_get_stats(viewer_.get(), &stats), CUMULET_OK);
  const std::uint64_t both = stats.gl_bytes;
  ASSERT_EQ(cumulet_destroy_transmittance_map(viewer_.get(), 3), CUMULET_OK);
  ASSERT_EQ(cumulet_destroy_transmittance_map(viewer_.get(), 3), CUMULET_OK);
  ASSERT_EQ(cumulet_get_stats(viewer_.get(), &stats), CUMULET_OK);
  EXPECT_EQ(both - stats.gl_bytes, 2U * 67 * 67 * 41);
  EXPECT_EQ(fake_.real().IsTexture(other.texture), GL_FALSE);
}

TEST_F(TransmittanceMaps, UpdateDuringContinuousChangesAndCompleteAtRest) {
  show();
  desc_.size = 512;
  desc_.slices = 64;
  desc_.budget_ms = 0.5;
  auto map = make_desc<cumulet_transmittance_map>();
  double scale = density;
  std::vector<GLuint> seen;
  for (int i = 0; i < 120; ++i) {
    scale *= 1.01;
    auto medium = make_desc<cumulet_medium_desc>();
    medium.density_scale = scale;
    ASSERT_EQ(cumulet_set_medium(viewer_.get(), &medium), CUMULET_OK);
    const auto frame = target_.frame();
    ASSERT_EQ(cumulet_render(viewer_.get(), &frame, nullptr), CUMULET_OK);
    ASSERT_EQ(cumulet_update_transmittance_map(viewer_.get(), &desc_, &map), CUMULET_OK);
    EXPECT_NE(map.texture, 0U);
    if (map.size > 1) seen.push_back(map.texture);
  }
  EXPECT_GT(seen.size(), 30U) << "it is never starved";
  standing_ = {{dmat4(1.0), scale}};
  desc_.size = 128;
  desc_.slices = 41;
  desc_.budget_ms = 1000.0;
  converge(viewer_.get(), target_.frame());
  expect_truth(sun());
}

TEST_F(TransmittanceMaps, AreOneWithoutAVolume) {
  const auto frame = target_.frame();
  ASSERT_EQ(cumulet_render(viewer_.get(), &frame, nullptr), CUMULET_OK);
  EXPECT_EQ(looked_up(update(), {dvec3(0.0), dvec3(5.0)}), (std::vector<float>{1.0F, 1.0F}));
  show();
  EXPECT_LT(looked_up(update(), {dvec3(7.0, -9.0, 3.0) - 5.0 * sun()})[0], 1.1F);
  const std::vector<float> behind = looked_up(update(), {dvec3(7.0) - 20.0 * sun()});
  EXPECT_LT(behind[0], 0.6F);
  ASSERT_EQ(cumulet_set_volume(viewer_.get(), nullptr), CUMULET_OK);
  ASSERT_EQ(cumulet_render(viewer_.get(), &frame, nullptr), CUMULET_OK);
  EXPECT_EQ(looked_up(update(), {dvec3(7.0) - 20.0 * sun()})[0], 1.0F);
}

TEST_F(TransmittanceMaps, InvalidInputGivesAOneLineError) {
  auto map = make_desc<cumulet_transmittance_map>();
  const auto refused = [&](const auto& change, const char* cause) {
    auto desc = make_desc<cumulet_transmittance_map_desc>();
    change(desc);
    EXPECT_EQ(cumulet_update_transmittance_map(viewer_.get(), &desc, &map), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_STREQ(cumulet_last_error(viewer_.get()), cause);
  };
  const std::string of = "cumulet_transmittance_map_desc.";
  refused([](auto& d) { d.slot = 16; }, (of + "slot is not from 0 to 15").c_str());
  refused([](auto& d) { d.light = static_cast<cumulet_map_light>(3); }, (of + "light is unknown").c_str());
  refused([](auto& d) { d.light = CUMULET_MAP_LIGHT_DIRECTION; }, (of + "direction is zero, or not finite").c_str());
  refused(
      [](auto& d) {
        d.light = CUMULET_MAP_LIGHT_POINT;
        d.position[1] = NAN;
      },
      (of + "position is not finite").c_str());
  refused([](auto& d) { d.size = 15; }, (of + "size is not from 16 to 4096").c_str());
  refused([](auto& d) { d.slices = 1; }, (of + "slices is not from 2 to 256").c_str());
  refused([](auto& d) { d.size = 4096; }, (of + "size and slices give more than 2^27 texels").c_str());
  refused([](auto& d) { d.budget_ms = -1.0; }, (of + "budget_ms is not from 0 to 1e9").c_str());
  auto desc = make_desc<cumulet_transmittance_map_desc>();
  EXPECT_EQ(cumulet_update_transmittance_map(viewer_.get(), &desc, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_destroy_transmittance_map(viewer_.get(), 16), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_update_transmittance_map(nullptr, &desc, &map), CUMULET_ERROR_INVALID_ARGUMENT);
  ASSERT_EQ(cumulet_detach(viewer_.get()), CUMULET_OK);
  EXPECT_EQ(cumulet_update_transmittance_map(viewer_.get(), &desc, &map), CUMULET_ERROR_DETACHED);
}

}  // namespace
