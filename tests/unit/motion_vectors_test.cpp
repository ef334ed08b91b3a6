// Motion vectors: positions of the visible points one frame ago, compared with projections in double precision.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "support/c_viewer.hpp"
#include "support/gltf_model.hpp"

namespace {

using namespace cumulet::test;
using cumulet::headless::Backend;
using cumulet::headless::Context;
using glm::dmat4;
using glm::dvec2;
using glm::dvec3;

constexpr std::uint32_t width = 24;
constexpr std::uint32_t height = 16;
constexpr std::size_t count = std::size_t{width} * height;
constexpr double fovy = 30.0;
constexpr double tolerance = 2e-3;  // pixels

// A camera, and its projection of points: pixels from the center, y up.
struct Eye {
  dvec3 at{0.0, 0.0, 40.0};
  dvec3 target{0.0};
  double orthographic_height = 0.0;

  [[nodiscard]] cumulet_camera_desc desc() const {
    auto desc = make_desc<cumulet_camera_desc>();
    for (int i = 0; i < 3; ++i) {
      desc.eye[i] = at[i];
      desc.target[i] = target[i];
    }
    desc.fovy_degrees = fovy;
    desc.orthographic_height = orthographic_height;
    return desc;
  }
  struct Axes {
    dvec3 forward, right, up;
  };
  [[nodiscard]] Axes axes() const {
    const dvec3 forward = glm::normalize(target - at);
    const dvec3 right = glm::normalize(glm::cross(forward, dvec3(0.0, 1.0, 0.0)));
    return {forward, right, glm::cross(right, forward)};
  }
  [[nodiscard]] double half(double z) const {
    return orthographic_height > 0.0 ? 0.5 * orthographic_height : z * std::tan(fovy * std::numbers::pi / 360.0);
  }
  // Projects a point, or a direction if homogeneous.w is 0.
  [[nodiscard]] dvec2 sees(const glm::dvec4& homogeneous) const {
    const Axes to = axes();
    const dvec3 way = dvec3(homogeneous) - homogeneous.w * at;
    const double scale = 0.5 * height / half(glm::dot(way, to.forward));
    return scale * dvec2(glm::dot(way, to.right), glm::dot(way, to.up));
  }
  // The ray through a position in a pixel, measured from its upper left corner.
  struct Ray {
    dvec3 o, d;
  };
  [[nodiscard]] Ray ray(std::uint32_t x, std::uint32_t y, const dvec2& within) const {
    const Axes to = axes();
    const double scale = half(1.0) / (0.5 * height);
    const dvec3 aside = scale * (x + within.x - 0.5 * width) * to.right + scale * (0.5 * height - y - within.y) * to.up;
    if (orthographic_height > 0.0) return {at + aside, to.forward};
    return {at, to.forward + aside};
  }
};

// A thin plate of medium at z = 0 with this velocity per second.
VolumeRef make_plate(const dvec3& velocity) {
  constexpr std::int32_t side = 64;
  const std::size_t voxels = std::size_t{side} * side;
  const std::vector<float> dense(voxels, 1.0F);
  std::array<std::vector<float>, 3> moves;
  std::array<cumulet_dense_desc, 4> descs{};
  std::array<cumulet_field, 4> fields{};
  for (std::size_t i = 0; i < 4; ++i) {
    if (i > 0) moves.at(i - 1).assign(voxels, static_cast<float>(velocity[static_cast<int>(i) - 1]));
    descs.at(i) = make_desc<cumulet_dense_desc>();
    descs.at(i).values = i == 0 ? dense.data() : moves.at(i - 1).data();
    descs.at(i).value_count = voxels;
    descs.at(i).size[0] = descs.at(i).size[1] = side;
    descs.at(i).size[2] = 1;
    for (int axis = 0; axis < 3; ++axis) descs.at(i).index_to_world[5 * axis] = axis == 2 ? 1e-3 : 1.0;
    descs.at(i).index_to_world[12] = descs.at(i).index_to_world[13] = -31.5;
    descs.at(i).index_to_world[15] = 1.0;
    fields.at(i) = make_desc<cumulet_field>();
    fields.at(i).channel =
        i == 0 ? CUMULET_CHANNEL_DENSITY : static_cast<cumulet_channel>(CUMULET_CHANNEL_VELOCITY_X + i - 1);
    fields.at(i).dense = &descs.at(i);
  }
  auto state = make_desc<cumulet_volume_fields_desc>();
  state.fields = fields.data();
  state.field_count = velocity == dvec3(0.0) ? 1 : 4;
  cumulet_volume* out = nullptr;
  std::array<char, 256> error{};
  if (cumulet_volume_from_fields(&state, &out, error.data(), error.size()) != CUMULET_OK)
    throw std::runtime_error(error.data());
  return VolumeRef(out);
}

// A square at z = 0, 40 wide.
SurfacesRef make_wall() {
  const std::array<float, 18> corners{-20, -20, 0, 20, -20, 0, 20, 20, 0, -20, -20, 0, 20, 20, 0, -20, 20, 0};
  auto mesh = make_desc<cumulet_mesh_desc>();
  mesh.positions = corners.data();
  mesh.vertex_count = 6;
  mesh.double_sided = 1;
  return make_surfaces({&mesh, 1});
}

class MotionVectors : public CViewerTest {
 protected:
  MotionVectors() : CViewerTest(width, height, 1) {}
  void SetUp() override {
    CViewerTest::SetUp();
    if (IsSkipped()) return;
    auto grid = make_desc<cumulet_grid_desc>();
    grid.interpolation = CUMULET_INTERPOLATION_NEAREST;  // a plate of cubes is thinner
    ASSERT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
    now();
  }

  void now(const Eye& eye = {}) {
    eye_ = eye;
    cumulet_camera* camera = nullptr;
    const cumulet_camera_desc desc = eye.desc();
    ASSERT_EQ(cumulet_get_camera(v_, &camera), CUMULET_OK);
    const CameraRef owner(camera);
    ASSERT_EQ(cumulet_camera_set(camera, &desc), CUMULET_OK);
  }
  void then(const std::optional<Eye>& eye, double seconds = 0.0) {
    then_ = eye.value_or(eye_);
    CameraRef owner;
    if (eye) {
      cumulet_camera* camera = nullptr;
      const cumulet_camera_desc desc = eye->desc();
      ASSERT_EQ(cumulet_camera_create(&desc, &camera), CUMULET_OK);
      owner.reset(camera);
    }
    ASSERT_EQ(cumulet_set_previous_camera(v_, owner.get(), seconds), CUMULET_OK) << cumulet_last_error(v_);
  }
  std::vector<float> read(cumulet_aov which) {
    make();
    return aov(which, 2);
  }
  // before: returns the previous position of the point that a ray sees now; nullopt if the ray is ignored.
  using Before = std::function<std::optional<glm::dvec4>(const Eye::Ray&, glm::dvec4& now)>;
  void expect(cumulet_aov aov, const Before& before, const std::string& what, double within = tolerance) {
    const std::vector<float> made = read(aov);
    int looked_at = 0;
    double most = 0.0;
    for (std::uint32_t y = 0; y < height; ++y) {
      for (std::uint32_t x = 0; x < width; ++x) {
        // The volume's motion is the mean over the 16 rays of glsl/features/aovs.comp.
        const int rays = aov == CUMULET_AOV_VOLUME_MOTION ? 16 : 1;
        dvec2 wanted(0.0);
        bool known = true;
        for (int i = 0; i < rays && known; ++i) {
          glm::dvec4 at(0.0);
          const dvec2 within_pixel = glm::fract(0.5 + double(i) * dvec2(0.7548776662, 0.5698402910));
          const auto was = before(eye_.ray(x, y, within_pixel), at);
          known = was.has_value();
          if (known) wanted += (then_.sees(*was) - eye_.sees(at)) / double(rays);
        }
        if (!known) continue;
        ++looked_at;
        for (int i = 0; i < 2; ++i) {
          ASSERT_NEAR(made[2 * (std::size_t{y} * width + x) + static_cast<std::size_t>(i)], wanted[i], within)
              << what << ": " << x << ", " << y << " axis " << i;
          most = std::max(most, std::abs(wanted[i]));
        }
      }
    }
    EXPECT_GT(looked_at, 100) << what;
    EXPECT_GT(most, 0.2) << what << ": there is motion to be seen";
  }
  // The previous position of a point in a plane that moved by this transform.
  static Before on_plane(const dmat4& moved, const dmat4& transform = dmat4(1.0)) {
    return [=](const Eye::Ray& ray, glm::dvec4& now) -> std::optional<glm::dvec4> {
      const dmat4 back = glm::inverse(transform);
      const dvec3 o(back * glm::dvec4(ray.o, 1.0));
      const dvec3 d(back * glm::dvec4(ray.d, 0.0));
      const dvec3 own = o - o.z / d.z * d;
      if (std::max(std::abs(own.x), std::abs(own.y)) > 18.0) return std::nullopt;
      now = transform * glm::dvec4(own, 1.0);
      return moved * now;
    };
  }
  void expect_none(cumulet_aov aov) {
    for (const float value : read(aov)) ASSERT_EQ(value, 0.0F);
  }

  Eye eye_;
  Eye then_;
};
CUMULET_ON_BACKENDS(MotionVectors);

const dmat4 turned =
    glm::translate(glm::rotate(dmat4(1.0), 0.12, glm::normalize(dvec3(0.3, 0.2, 1.0))), dvec3(0.7, -0.4, 1.5));
const Eye elsewhere{{1.5, -0.6, 43.0}, {0.4, 0.3, 0.0}, 0.0};

TEST_P(MotionVectors, StaticSceneHasNone) {
  const VolumeRef plate = make_plate(dvec3(1.0, 2.0, 3.0));
  ASSERT_EQ(cumulet_set_volume(v_, plate.get()), CUMULET_OK);
  const SurfacesRef wall = make_wall();
  expect_none(CUMULET_AOV_MOTION);
  expect_none(CUMULET_AOV_VOLUME_MOTION);
  then(eye_);
  expect_none(CUMULET_AOV_VOLUME_MOTION);
  ASSERT_EQ(cumulet_set_surfaces(v_, wall.get()), CUMULET_OK);
  for (const float value : read(CUMULET_AOV_MOTION)) ASSERT_NEAR(value, 0.0F, 1e-4F);
}

TEST_P(MotionVectors, FollowCameraMotion) {
  const VolumeRef plate = make_plate(dvec3(0.0));
  ASSERT_EQ(cumulet_set_volume(v_, plate.get()), CUMULET_OK);
  then(elsewhere);
  expect(CUMULET_AOV_VOLUME_MOTION, on_plane(dmat4(1.0)), "volume");
  // Behind it there is nothing: distant points move only by the camera's rotation.
  const Before far = [](const Eye::Ray& ray, glm::dvec4& now) -> std::optional<glm::dvec4> {
    now = glm::dvec4(ray.d, 0.0);
    return now;
  };
  expect(CUMULET_AOV_MOTION, far, "background");
  const SurfacesRef wall = make_wall();
  ASSERT_EQ(cumulet_set_surfaces(v_, wall.get()), CUMULET_OK);
  expect(CUMULET_AOV_MOTION, on_plane(dmat4(1.0)), "surface");
  // Orthographic now, before, or both.
  Eye parallel = elsewhere;
  parallel.orthographic_height = 20.0;
  then(parallel);
  expect(CUMULET_AOV_VOLUME_MOTION, on_plane(dmat4(1.0)), "parallel then");
  Eye along;
  along.orthographic_height = 22.0;
  now(along);
  then(parallel);
  expect(CUMULET_AOV_VOLUME_MOTION, on_plane(dmat4(1.0)), "parallel");
  expect(CUMULET_AOV_MOTION, on_plane(dmat4(1.0)), "surface, parallel");
}

TEST_P(MotionVectors, OfTheGroundFollowTheCamera) {
  auto ground = make_desc<cumulet_ground_desc>();
  ground.mode = CUMULET_GROUND_AT_HEIGHT;
  ground.height = -8.0;
  ASSERT_EQ(cumulet_set_ground(v_, &ground), CUMULET_OK);
  const VolumeRef ball = make_ball(8, 1.0F);
  ASSERT_EQ(cumulet_set_volume(v_, ball.get()), CUMULET_OK);
  now({{0.0, 6.0, 40.0}, {0.0, -2.0, 0.0}, 0.0});
  then(Eye{{1.0, 6.5, 42.0}, {0.2, -2.0, 0.0}, 0.0});
  expect(
      CUMULET_AOV_MOTION,
      [](const Eye::Ray& ray, glm::dvec4& at) -> std::optional<glm::dvec4> {
        const double t = (-8.0 - ray.o.y) / ray.d.y;
        if (!(t > 0.0) || t > 200.0) return std::nullopt;
        at = glm::dvec4(ray.o + t * ray.d, 1.0);
        return at;
      },
      "ground", 2e-2);
}

TEST_P(MotionVectors, OfTheMediumFollowItsVelocity) {
  const dvec3 v(3.0, -5.0, 20.0);
  const VolumeRef plate = make_plate(v);
  ASSERT_EQ(cumulet_set_volume(v_, plate.get()), CUMULET_OK);
  constexpr double seconds = 0.1;
  then(std::nullopt, seconds);
  expect(CUMULET_AOV_VOLUME_MOTION, on_plane(glm::translate(dmat4(1.0), -seconds * v)), "velocity");
  then(elsewhere, seconds);
  expect(CUMULET_AOV_VOLUME_MOTION, on_plane(glm::translate(dmat4(1.0), -seconds * v)), "and the camera");
  // With a rotated instance transform, the motion is rotated too.
  const dmat4 transform = glm::rotate(dmat4(1.0), 0.5, dvec3(0.0, 1.0, 0.0));
  ASSERT_EQ(cumulet_set_volume_transforms(v_, glm::value_ptr(transform), 1), CUMULET_OK);
  const dvec3 there = glm::dmat3(transform) * v;
  expect(CUMULET_AOV_VOLUME_MOTION, on_plane(glm::translate(dmat4(1.0), -seconds * there), transform), "turned", 2e-2);
}

TEST_P(MotionVectors, OfInstancesFollowTheirPreviousTransforms) {
  const VolumeRef plate = make_plate(dvec3(0.0));
  ASSERT_EQ(cumulet_set_volume(v_, plate.get()), CUMULET_OK);
  const dmat4 transform = glm::rotate(dmat4(1.0), 0.3, dvec3(1.0, 0.0, 0.0));
  const dmat4 was = turned * transform;
  ASSERT_EQ(cumulet_set_volume_transforms(v_, glm::value_ptr(transform), 1), CUMULET_OK);
  ASSERT_EQ(cumulet_set_previous_volume_transforms(v_, glm::value_ptr(was), 1), CUMULET_OK);
  then(std::nullopt);
  expect(CUMULET_AOV_VOLUME_MOTION, on_plane(turned, transform), "a place", 2e-2);
  // Several transforms move separately. One far away stays fixed.
  std::array<dmat4, 2> transforms{transform, glm::translate(dmat4(1.0), dvec3(0.0, 0.0, -500.0))};
  ASSERT_EQ(cumulet_set_volume_transforms(v_, glm::value_ptr(transforms[0]), 2), CUMULET_OK);
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 1e5;
  ASSERT_EQ(cumulet_set_medium(v_, &medium), CUMULET_OK);
  expect(CUMULET_AOV_VOLUME_MOTION, on_plane(turned, transform), "the first of two", 2e-2);
  ASSERT_EQ(cumulet_set_previous_volume_transforms(v_, nullptr, 0), CUMULET_OK);
  expect_none(CUMULET_AOV_VOLUME_MOTION);
}

TEST_P(MotionVectors, OfOneInstanceFollowItsOwnTransform) {
  const VolumeRef plate = make_plate(dvec3(0.0));
  auto desc = make_desc<cumulet_instance_desc>();
  desc.volume = plate.get();
  const InstanceRef instance = cumulet::test::make_instance(desc);
  cumulet_instance* const made = instance.get();
  ASSERT_EQ(cumulet_add_instance(v_, made), CUMULET_OK);
  ASSERT_EQ(cumulet_instance_set_previous(made, glm::value_ptr(turned)), CUMULET_OK);
  then(std::nullopt);
  expect(CUMULET_AOV_VOLUME_MOTION, on_plane(turned), "an instance");
  ASSERT_EQ(cumulet_instance_set_previous(made, nullptr), CUMULET_OK);
  expect_none(CUMULET_AOV_VOLUME_MOTION);
  dmat4 bad = turned;
  bad[0] = glm::dvec4(0.0);
  EXPECT_EQ(cumulet_instance_set_previous(made, glm::value_ptr(bad)), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_P(MotionVectors, OfAModelFollowItsTransform) {
  const VolumeRef ball = make_ball(4, 1e-3F);
  ASSERT_EQ(cumulet_set_volume(v_, ball.get()), CUMULET_OK);
  const SurfacesRef wall = make_wall();
  auto desc = make_desc<cumulet_model_desc>();
  desc.surfaces = wall.get();
  const dmat4 transform = glm::rotate(dmat4(1.0), 0.3, dvec3(0.0, 1.0, 0.0));
  std::copy_n(glm::value_ptr(transform), 16, desc.to_world);
  cumulet_model* made = nullptr;
  ASSERT_EQ(cumulet_model_create(&desc, &made, nullptr, 0), CUMULET_OK);
  const ModelRef model(made);
  ASSERT_EQ(cumulet_add_model(v_, made), CUMULET_OK);
  const dmat4 was = turned * transform;
  ASSERT_EQ(cumulet_model_set_previous(made, glm::value_ptr(was), nullptr), CUMULET_OK);
  then(elsewhere);
  expect(CUMULET_AOV_MOTION, on_plane(turned, transform), "a model");
}

// A wall whose animation moves it by 2 per second along x and stretches it along y.
SurfacesRef make_animated() {
  GltfModel model;
  const json primitive = {
      {"attributes",
       {{"POSITION", model.vec3({-20, -20, 0, 20, -20, 0, 20, 20, 0, -20, -20, 0, 20, 20, 0, -20, 20, 0})}}},
      {"material", model.add("materials", {{"doubleSided", true}})}};
  const int node = model.show(primitive);
  model.root["scenes"] = json::array({{{"nodes", json::array({node})}}});
  model.root["scene"] = 0;
  const int times = model.scalars({0, 1});
  const auto sampler = [&](const std::vector<float>& values) {
    return json{{"input", times}, {"output", model.vec3(values)}, {"interpolation", "LINEAR"}};
  };
  const auto channel = [&](int s, const char* path) {
    return json{{"sampler", s}, {"target", {{"node", node}, {"path", path}}}};
  };
  model.add("animations", {{"samplers", {sampler({0, 0, 0, 2, 0, 0}), sampler({1, 1, 1, 1, 2, 1})}},
                           {"channels", {channel(0, "translation"), channel(1, "scale")}}});
  return read_surfaces(model.glb());
}

TEST_P(MotionVectors, OfDeformingModelsFollowTheirVertices) {
  const VolumeRef ball = make_ball(4, 1e-3F);
  ASSERT_EQ(cumulet_set_volume(v_, ball.get()), CUMULET_OK);
  const SurfacesRef wall = make_animated();
  auto desc = make_desc<cumulet_model_desc>();
  desc.surfaces = wall.get();
  desc.time = 0.75;
  cumulet_model* made = nullptr;
  ASSERT_EQ(cumulet_model_create(&desc, &made, nullptr, 0), CUMULET_OK);
  const ModelRef model(made);
  ASSERT_EQ(cumulet_add_model(v_, made), CUMULET_OK);
  const auto pose = [](double time) {
    return glm::scale(glm::translate(dmat4(1.0), dvec3(2.0 * time, 0.0, 0.0)), dvec3(1.0, 1.0 + time, 1.0));
  };
  const double before = 0.25;
  ASSERT_EQ(cumulet_model_set_previous(made, nullptr, &before), CUMULET_OK);
  then(std::nullopt);
  expect(CUMULET_AOV_MOTION, on_plane(pose(before) * glm::inverse(pose(0.75))), "deforms");
  ASSERT_EQ(cumulet_model_set_previous(made, glm::value_ptr(turned), &before), CUMULET_OK);
  expect(CUMULET_AOV_MOTION, on_plane(turned * pose(before) * glm::inverse(pose(0.75))), "deforms and moves");
  ASSERT_EQ(cumulet_model_set_previous(made, nullptr, nullptr), CUMULET_OK);
  for (const float value : read(CUMULET_AOV_MOTION)) ASSERT_NEAR(value, 0.0F, 1e-4F);
}

}  // namespace
