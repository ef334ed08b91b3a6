// Motion blur, compared with closed forms and with means of many images without motion.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>
#include <vector>

#include "assets/instance.hpp"
#include "assets/sequence.hpp"
#include "base/error.hpp"
#include "scene/space.hpp"
#include "support/blocks.hpp"
#include "support/cloud_test.hpp"
#include "support/folder.hpp"
#include "support/gl_viewer.hpp"
#include "support/marches.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/surfaces.hpp"
#include "support/vdb_files.hpp"
#include "support/volumes.hpp"
#include "surface/triangles.hpp"

namespace {

using namespace cumulet;
using glm::dmat4;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;
using test::Blocks;

dmat4 moved(double x, double y, double z) { return glm::translate(dmat4(1.0), dvec3(x, y, z)); }

// Linear interpolation of the matrices, as in the library.
dmat4 between(const dmat4& a, const dmat4& b, double t) { return a + (b - a) * t; }

class MotionBlur : public test::CloudTest {
 protected:
  static constexpr std::uint32_t edge = 16;

  void SetUp() override {
    test::CloudTest::SetUp();
    if (IsSkipped()) return;
    still_->set_camera(test::camera_at({40.0, 34.0, 50.0}, {12.0, 10.0, 11.0}, 32.0));
  }
  static volume::ScalarVolume cloud() { return test::noise_volume({24, 20, 22}, ivec3(0), 2); }
  static volume::ScalarVolume flames() {
    return test::make_volume({12, 10, 12}, {5, 4, 5}, [](const ivec3& p) { return p.x < 8 ? 1.5F : 0.25F; });
  }
  // The mean transmittance along lines near (x, y). sigma() is its standard error if samples are 0 or 1.
  double along_z(double x, double y, double shutter = 1.0) {
    viewer::CameraPose pose = test::camera_at({x, y, 300.0}, {x, y, 0.0});
    pose.orthographic_height = 1e-3;
    still_->set_camera(pose);
    return test::render(*still_, {8, 8, samples, 1, render::View::shaded, shutter}).mean().x;
  }
  static constexpr std::uint32_t samples = 256;
  static double sigma(double transmittance) {
    return std::sqrt(transmittance * (1.0 - transmittance) / (64.0 * samples));
  }
  Blocks blurred() {
    return test::blocks_of(6, [&](unsigned k) {
      return test::render(*still_, {edge, edge, 48, 100 + k, render::View::shaded, 1.0});
    });
  }
  // The mean of still images over the shutter interval; set(t) sets the scene to time t.
  template <class Set>
  Blocks still_mean(const Set& set) {
    constexpr unsigned pictures = 6;
    constexpr unsigned moments = 6;
    return test::blocks_of(pictures, [&](unsigned k) {
      test::Picture sum;
      for (unsigned i = 0; i < moments; ++i) {
        // Each image uses another time in each interval.
        set((i + (k + 0.5) / pictures) / moments);
        const test::Picture one = test::render(*still_, {edge, edge, 8, 1000 * k + i, render::View::shaded});
        sum.width = one.width;
        sum.pixels.resize(one.pixels.size());
        for (std::size_t p = 0; p < sum.pixels.size(); ++p)
          sum.pixels[p] += one.pixels[p] / static_cast<float>(moments);
      }
      return sum;
    });
  }
  void expect_as_stills(const dmat4& open, const dmat4& close) {
    viewer().set_transforms({{dmat4(1.0), scene::ShutterTransforms{open, close}}});
    const Blocks swept = blurred();
    test::expect_alike(swept, still_mean([&](double t) { viewer().set_transforms({{between(open, close, t)}}); }));
  }
};
// Only numbers are compared, so one driver is enough.
INSTANTIATE_TEST_SUITE_P(Gl, MotionBlur, testing::Values(test::Door{headless::Backend::egl}), test::backend_name);

// A ray is inside the box for a fraction of the time.
TEST_P(MotionBlur, PassingBoxIsWeightedByItsTime) {
  only_absorb(0.1);
  show(test::make_volume({8, 64, 16}, ivec3(0), [](const ivec3&) { return 1.0F; }));
  const double clear = std::exp(-0.1 * 16.0);
  for (const test::MarchKind& kind : test::march_kinds) {
    still_->set_grid(test::settings_of(kind));
    // The box x in [-0.5, 7.5] moves by 20 to each side: it covers x = 3.5 for 8 of 40.
    viewer().set_transforms({{dmat4(1.0), scene::ShutterTransforms{moved(-20, 0, 0), moved(20, 0, 0)}}});
    const double covered = 8.0 / 40.0;
    const double expected = 1.0 - covered * (1.0 - clear);
    EXPECT_NEAR(along_z(3.5, 31.5), expected, 4.5 * sigma(expected));
    // It covers x = 23 from t = 0.8875 to the end: [-0.5, 7.5] + 40 t - 20.
    const double late = 1.0 - (1.0 - 0.8875) * (1.0 - clear);
    EXPECT_NEAR(along_z(23.0, 31.5), late, 4.5 * sigma(late));
    EXPECT_NEAR(along_z(3.5, 31.5, 0.0), clear, 4.5 * sigma(clear)) << "the shutter is closed";
  }
}

// Its thickness grows linearly: the mean of e^-(a t + b) is a difference of exponentials.
TEST_P(MotionBlur, GrowingBoxIsTheMeanOfItsTransmittances) {
  only_absorb(0.05);
  show(test::make_volume({16, 16, 16}, ivec3(0), [](const ivec3&) { return 1.0F; }));
  const dmat4 thrice = glm::scale(dmat4(1.0), dvec3(1.0, 1.0, 3.0));
  viewer().set_transforms({{dmat4(1.0), scene::ShutterTransforms{dmat4(1.0), thrice}}});
  const double thin = 0.05 * 16.0;
  const double expected = (std::exp(-thin) - std::exp(-3.0 * thin)) / (2.0 * thin);
  EXPECT_NEAR(along_z(7.5, 7.5), expected, 4.5 * sigma(expected));
}

// The sample's time must not change other random numbers: without motion the image is bit-identical.
TEST_P(MotionBlur, WithoutMotionTheImageIsUnchanged) {
  show(cloud(), flames());
  const test::Image image{edge, edge, 8, 3, render::View::shaded};
  test::Image open = image;
  open.shutter_seconds = 0.5;
  const test::Picture before = test::render(*still_, image);
  EXPECT_EQ(test::render(*still_, open).pixels, before.pixels) << "nothing moves";
  viewer().set_transforms({{dmat4(1.0), scene::ShutterTransforms{moved(-1, 0, 0), moved(1, 0, 0)}}});
  EXPECT_EQ(test::render(*still_, image).pixels, before.pixels) << "it is closed";
  const test::Picture swept = test::render(*still_, open);
  EXPECT_NE(swept.pixels, before.pixels);
  EXPECT_EQ(test::render(*still_, open, 0.5).pixels, swept.pixels) << "in bounded steps";
  EXPECT_EQ(test::render(*still_, image).pixels, before.pixels) << "closed again";
}

TEST_P(MotionBlur, RotatingVolumeIsTheMeanOfStills) {
  show(cloud());
  const dmat4 about = moved(12, 10, 11);
  const auto turned = [&](double degrees, const dvec3& axis) {
    return about * glm::rotate(dmat4(1.0), glm::radians(degrees), axis) * glm::inverse(about);
  };
  expect_as_stills(turned(-30.0, {0, 1, 0}) * moved(-3, 1, 0), turned(50.0, {0.3, 0.9, 0.1}) * moved(2, 0, 4));
}

TEST_P(MotionBlur, MovingFireLightsLikeTheMeanOfStills) {
  medium_.field_emission.flame_strength = 0.5;
  still_->set_medium(medium_);
  show(cloud(), flames());
  // It grows too, so cell volumes differ from those at the frame time.
  expect_as_stills(moved(-6, 0, 0) * glm::scale(dmat4(1.0), dvec3(0.7)), moved(4, 3, 0));
}

TEST_P(MotionBlur, VoxelGridsMatchTetrahedralGrids) {
  show(cloud());
  for (const render::March march : {render::March::dense, render::March::brick}) {
    still_->set_grid(test::settings_of({march, grid::CellKind::constant}));
    expect_as_stills(moved(-6, 0, 0), moved(6, 2, 0));
  }
}

TEST_P(MotionBlur, MovingInstanceAmongStaticOnes) {
  show(cloud());
  const std::vector<dmat4> stand{moved(14, 3, 0), moved(-10, -6, 8)};
  const auto transforms = [&](const scene::InstanceTransform& transform) {
    return std::vector<scene::InstanceTransform>{{stand[0]}, transform, {stand[1]}};
  };
  viewer().set_transforms(transforms({dmat4(1.0), scene::ShutterTransforms{moved(-12, 0, 0), moved(12, 0, 0)}}));
  const Blocks swept = blurred();
  test::expect_alike(swept,
                     still_mean([&](double t) { viewer().set_transforms(transforms({moved(24 * t - 12, 0, 0)})); }));
}

// The camera rotates about one axis at constant speed, and its position moves linearly.
TEST_P(MotionBlur, CameraPanIsTheMeanOfStills) {
  show(cloud());
  const dvec3 from(40.0, 22.0, 50.0);
  const dvec3 to(44.0, 14.0, 46.0);
  const auto pose_at = [&](double t) {
    const double yaw = glm::radians(-150.0 + 14.0 * t);  // level, so that +Y is the axis
    const dvec3 eye = from + (to - from) * t;
    return test::camera_at(eye, eye + 60.0 * dvec3(std::sin(yaw), 0.0, std::cos(yaw)), 40.0);
  };
  still_->set_camera(pose_at(0.5));
  viewer().camera()->set_shutter(pose_at(0.0), pose_at(1.0));
  const Blocks swept = blurred();
  test::expect_alike(swept, still_mean([&](double t) { still_->set_camera(pose_at(t)); }));
}

// A roll by a right angle about the view direction. Linear interpolation of matrices would zoom halfway.
TEST_P(MotionBlur, CameraRollKeepsTheFieldOfView) {
  show(cloud(), flames());
  medium_.field_emission.flame_strength = 0.2;
  still_->set_medium(medium_);
  const auto pose_at = [&](double t) {
    viewer::CameraPose pose = test::camera_at({11.0, 9.0, 70.0}, {11.0, 9.0, 11.0}, 30.0 + 6.0 * t);
    const double angle = glm::radians(90.0 * t);
    pose.up = {std::sin(angle), std::cos(angle), 0.0};
    return pose;
  };
  still_->set_camera(pose_at(0.25));
  viewer().camera()->set_shutter(pose_at(0.0), pose_at(1.0));
  const auto tangent = [](double fovy) { return std::tan(0.5 * glm::radians(fovy)); };
  const Blocks swept = blurred();
  test::expect_alike(swept, still_mean([&](double t) {
                       viewer::CameraPose pose = pose_at(t);
                       // The tangent of the half angle is linear in time, as is the image height at a given distance.
                       const double height = tangent(30.0) + t * (tangent(36.0) - tangent(30.0));
                       pose.fovy_degrees = 2.0 * glm::degrees(std::atan(height));
                       still_->set_camera(pose);
                     }));
}

TEST_P(MotionBlur, ShutterPosesEndWithTheNextCameraMove) {
  show(cloud());
  const test::Image image{edge, edge, 4, 3, render::View::shaded, 1.0};
  const viewer::CameraPose pose = test::camera_at({40.0, 34.0, 50.0}, {12.0, 10.0, 11.0}, 32.0);
  viewer::CameraPose aside = pose;
  aside.eye.x += 5.0;
  const test::Picture still = test::render(*still_, image);
  viewer().camera()->set_shutter(std::nullopt, aside);
  EXPECT_NE(test::render(*still_, image).pixels, still.pixels);
  still_->set_camera(aside);
  still_->set_camera(pose);
  EXPECT_EQ(test::render(*still_, image).pixels, still.pixels);
  viewer::CameraPose flat = aside;
  flat.orthographic_height = 20.0;
  EXPECT_THROW(viewer().camera()->set_shutter(flat, std::nullopt), Error) << "of another kind";
  aside.target = aside.eye;
  EXPECT_THROW(viewer().camera()->set_shutter(aside, std::nullopt), Error) << "looks nowhere";
}

// An emissive square moves across the image and lights a floor, as does a growing fire.
TEST_P(MotionBlur, MovingModelIsTheMeanOfStills) {
  auto scene = std::make_shared<test::StillScene>();
  surface::Material emissive = test::diffuse(vec3(0.3F));
  emissive.emission = {3.0F, 2.0F, 1.0F};
  scene->add_quad({{{6, 14, 4}, {14, 14, 4}, {14, 14, 12}, {6, 14, 12}}}, scene->add(emissive));
  scene->add_sphere({12.0F, 20.0F, 14.0F}, 6.0F, scene->add(test::diffuse(vec3(0.7F, 0.5F, 0.3F))), 8);
  auto floor = std::make_shared<test::StillScene>();
  floor->add_quad({{{-30, -2, 40}, {60, -2, 40}, {60, -2, -30}, {-30, -2, -30}}},
                  floor->add(test::diffuse(vec3(0.6F))));
  viewer().show_surfaces(test::source_of(floor));
  medium_.density_scale = 0.02;
  medium_.field_emission.flame_strength = 20.0;
  still_->set_medium(medium_);
  // So small that NEE samples its cells.
  show(cloud(), test::make_volume({2, 2, 2}, {11, 3, 10}, [](const ivec3&) { return 1.5F; }));
  const scene::ShutterTransforms growth{moved(-6, 0, 0) * glm::scale(dmat4(1.0), dvec3(0.5)), dmat4(1.0)};
  viewer().set_transforms({{dmat4(1.0), growth}});
  const dmat4 about = moved(12, 20, 14);
  const dmat4 open = moved(-4, 0, 0);
  const dmat4 close =
      moved(4, 2, 0) * about * glm::rotate(dmat4(1.0), glm::radians(80.0), dvec3(0, 0, 1)) * glm::inverse(about);
  viewer::ModelSettings settings;
  settings.surfaces = std::make_shared<const viewer::SurfaceAsset>(scene, std::string("glow"));
  settings.ends = scene::ShutterTransforms{open, close};
  const auto model = std::make_shared<viewer::ModelInstance>(settings);
  viewer().add_model(model);
  const Blocks swept = blurred();
  test::expect_alike(swept, still_mean([&](double t) {
                       viewer().set_transforms({{between(growth.open, growth.close, t)}});
                       model->edit([&](viewer::ModelSettings& of) {
                         of.ends.reset();
                         of.to_world = between(open, close, t);
                       });
                     }));
}

// A scene whose pose depends on the time; `move` changes the rest pose.
class PosedScene final : public test::StillScene {
 public:
  std::function<void(surface::Pose&, double)> move;

  [[nodiscard]] surface::Pose pose(double time, std::size_t animation, const Progress* progress) const override {
    surface::Pose posed = StillScene::pose(time, animation, progress);
    move(posed, time);
    return posed;
  }
  [[nodiscard]] bool may_move(std::size_t /*animation*/) const override { return true; }
  [[nodiscard]] std::optional<surface::PoseEnds> pose_ends(double time, std::size_t animation, double seconds,
                                                           const Progress* progress) const override {
    return surface::PoseEnds{pose(time - 0.5 * seconds, animation, progress),
                             pose(time + 0.5 * seconds, animation, progress)};
  }
};

viewer::ModelSettings posed_at(std::shared_ptr<const surface::Scene> scene, double time) {
  viewer::ModelSettings settings;
  settings.surfaces = std::make_shared<const viewer::SurfaceAsset>(std::move(scene), std::string("posed"));
  settings.choice.time = time;
  return settings;
}

// A black square in front of a sky of 1.
std::shared_ptr<PosedScene> black_square() {
  auto scene = std::make_shared<PosedScene>();
  scene->add_quad({{{0, 0, 0}, {8, 0, 0}, {8, 8, 0}, {0, 8, 0}}}, scene->add(test::diffuse(vec3(0.0F))));
  return scene;
}

TEST_P(MotionBlur, DeformingSquareIsWeightedByItsTime) {
  only_absorb(0.1);
  const std::shared_ptr<PosedScene> square = black_square();
  // Its right edge moves from x = 8 to 16 in a second, and the whole square moves up by 40.
  square->move = [](surface::Pose& pose, double t) {
    for (std::size_t i = 0; i < 4; ++i)
      pose.vertices[i].position += vec3(i == 1 || i == 2 ? 8.0 * t : 0.0, 40.0 * t, 0.0);
  };
  const auto model = std::make_shared<viewer::ModelInstance>(posed_at(square, 0.5));
  viewer().add_model(model);
  // y = 20 is covered from 20 = 8 + 40 t to 20 = 40 t.
  EXPECT_NEAR(along_z(4.0, 20.0), 0.8, 4.5 * sigma(0.8));
  // x = 11 is covered from 8 + 8 t = 11 on.
  const double clear = 1.0 - (0.5 - 0.375);
  EXPECT_NEAR(along_z(11.0, 20.0), clear, 4.5 * sigma(clear));
  EXPECT_NEAR(along_z(11.0, 24.0, 0.0), 0.0, 1e-6) << "the shutter is closed";
  EXPECT_NEAR(along_z(4.0, 10.0, 0.0), 1.0, 1e-6) << "the shutter is closed";
  // Half of the shutter time, from t = 0.25 on: it is covered from 0.375 to 0.5.
  EXPECT_NEAR(along_z(11.0, 20.0, 0.5), 0.75, 4.5 * sigma(0.75));
  model->edit([](viewer::ModelSettings& of) { of.choice.time = 4.5; });
  EXPECT_NEAR(along_z(11.0, 20.0), 1.0, 1e-6) << "it is elsewhere";
  EXPECT_NEAR(along_z(11.0, 180.0), 0.8, 4.5 * sigma(0.8)) << "it is posed anew";
}

// Vertex motion and transform motion cancel. The object stays in place only if both are evaluated at the same time.
TEST_P(MotionBlur, VertexAndTransformMotionCancel) {
  only_absorb(0.1);
  const std::shared_ptr<PosedScene> squares = black_square();
  squares->add_quad({{{0, 20, 0}, {8, 20, 0}, {8, 28, 0}, {0, 28, 0}}}, squares->add(test::diffuse(vec3(0.0F))));
  squares->prototypes.push_back({1, 1, 1});
  squares->move = [](surface::Pose& pose, double t) {
    for (std::size_t i = 0; i < 8; ++i) pose.vertices[i].position.x += static_cast<float>((i < 4 ? 20.0 : 50.0) * t);
    pose.prototype_transforms = {{moved(-30.0 * t, 0, 0)}};
  };
  viewer::ModelSettings settings = posed_at(squares, 0.5);
  settings.ends = scene::ShutterTransforms{dmat4(1.0), moved(-20, 0, 0)};
  viewer().add_model(std::make_shared<viewer::ModelInstance>(settings));
  for (const double y : {4.0, 24.0}) {
    EXPECT_NEAR(along_z(4.0, y), 0.0, 1e-6) << y;
    EXPECT_NEAR(along_z(12.0, y), 1.0, 1e-6) << y;
  }
}

// It stays in place while its normals turn away from the sun, which is behind the camera.
TEST_P(MotionBlur, NormalsFollowVertexMotion) {
  only_absorb(0.1);
  still_->set_light({0.0F, 0.0F, vec3(std::numbers::pi_v<float>), vec3(0.0F)});
  auto square = std::make_shared<PosedScene>();
  square->add_quad({{{0, 0, 0}, {8, 0, 0}, {8, 8, 0}, {0, 8, 0}}}, square->add(test::diffuse(vec3(0.5F))));
  const vec3 aside(0.8F, 0.0F, 0.6F);
  square->move = [=](surface::Pose& pose, double t) {
    for (surface::PosedVertex& vertex : pose.vertices)
      vertex.normal = glm::normalize(glm::mix(vec3(0, 0, 1), aside, static_cast<float>(t)));
  };
  const auto model = std::make_shared<viewer::ModelInstance>(posed_at(square, 0.5));
  viewer().add_model(model);
  const double swept = along_z(4.0, 4.0);
  const auto still = [&](double t) {
    model->edit([&](viewer::ModelSettings& of) { of.choice.time = t; });
    return along_z(4.0, 4.0, 0.0);
  };
  constexpr int moments = 8;
  double mean = 0.0;
  for (int i = 0; i < moments; ++i) mean += still((i + 0.5) / moments) / moments;
  EXPECT_NEAR(swept, mean, 2e-3);
  // Shading uses the normals at each time, which differ from those at both ends.
  EXPECT_NEAR(still(0.0), 0.5, 5e-3);
  EXPECT_LT(still(1.0), 0.35);
}

// An emissive square grows, is sheared and turns its normals. Instances of a sphere are deformed and move in addition
// to their model.
TEST_P(MotionBlur, DeformingModelIsTheMeanOfStills) {
  auto scene = std::make_shared<PosedScene>();
  surface::Material emissive = test::diffuse(vec3(0.3F));
  emissive.emission = {3.0F, 2.0F, 1.0F};
  emissive.double_sided = true;
  scene->add_quad({{{-30, -2, 40}, {60, -2, 40}, {60, -2, -30}, {-30, -2, -30}}},
                  scene->add(test::diffuse(vec3(0.6F))));
  scene->add_quad({{{4, 12, 4}, {9, 12, 4}, {9, 12, 9}, {4, 12, 9}}}, scene->add(emissive));
  scene->add_sphere({0, 0, 0}, 5.0F, scene->add(test::diffuse(vec3(0.7F, 0.5F, 0.3F))), 8);
  scene->prototypes.push_back({2, 1, 2});
  const std::size_t square = 4;
  const std::size_t sphere = 8;
  scene->move = [=](surface::Pose& pose, double t) {
    const auto s = static_cast<float>(t);
    const std::array<vec3, 4> way{{{-4, 0, 0}, {6, 4, 2}, {8, 8, 9}, {0, 3, 5}}};
    for (std::size_t i = 0; i < way.size(); ++i) pose.vertices[square + i].position += s * way[i];
    for (std::size_t i = sphere; i < pose.vertices.size(); ++i) {
      surface::PosedVertex& vertex = pose.vertices[i];
      const vec3 narrow(vertex.normal.x, vertex.normal.y * 3.0F, vertex.normal.z);
      vertex.position.y *= 1.0F - 0.6F * s;
      vertex.normal = glm::normalize(glm::mix(vertex.normal, glm::normalize(narrow), s));
    }
    pose.prototype_transforms = {
        {between(moved(4, 4, 16), moved(10, 8, 18), t), between(moved(16, 6, 8), moved(13, 3, 8), t)}};
  };
  only_absorb(0.02);
  show(cloud());
  still_->set_light({40.0F, 50.0F, vec3(1.0F), vec3(0.3F)});
  const auto model = std::make_shared<viewer::ModelInstance>(posed_at(scene, 0.5));
  const scene::ShutterTransforms ends{moved(-1, 0, 0), moved(3, 1, 0)};
  model->edit([&](viewer::ModelSettings& of) { of.ends = ends; });
  viewer().add_model(model);
  const Blocks swept = blurred();
  const Blocks stills = still_mean([&](double t) {
    model->edit([&](viewer::ModelSettings& of) {
      of.choice.time = t;
      of.ends.reset();
      of.to_world = between(ends.open, ends.close, t);
    });
  });
  test::expect_alike(swept, stills);
}

TEST_P(MotionBlur, EqualPosesGiveTheStaticImage) {
  const std::shared_ptr<PosedScene> square = black_square();
  bool moves = false;
  square->move = [&](surface::Pose& pose, double t) {
    for (surface::PosedVertex& vertex : pose.vertices) vertex.position.z += static_cast<float>(moves ? t : 0.5);
  };
  show(cloud());
  const auto model = std::make_shared<viewer::ModelInstance>(posed_at(square, 0.5));
  viewer().add_model(model);
  const test::Image image{edge, edge, 8, 3, render::View::shaded};
  test::Image open = image;
  open.shutter_seconds = 0.5;
  const auto words = [&](double shutter_seconds) {
    viewer::SurfaceChoice choice;
    choice.time = 0.5;
    choice.shutter_seconds = shutter_seconds;
    Progress progress;
    return viewer::SurfaceAsset(square, std::string("posed")).posed(choice, progress)->words.size();
  };
  const test::Picture before = test::render(*still_, image);
  const std::size_t closed = words(0.0);
  EXPECT_EQ(test::render(*still_, open).pixels, before.pixels) << "nothing moves";
  EXPECT_EQ(words(0.5), closed) << "and takes no memory";
  moves = true;
  EXPECT_EQ(test::render(*still_, image).pixels, before.pixels) << "it is closed";
  EXPECT_NE(test::render(*still_, open).pixels, before.pixels);
  EXPECT_GT(words(0.5), closed) << "it is there at both ends";
  EXPECT_EQ(words(0.0), closed);
  EXPECT_EQ(test::render(*still_, image).pixels, before.pixels) << "closed again";
}

// A host's triangles move by their velocities, as the viewer's own surfaces.
TEST_P(MotionBlur, HostTrianglesMoveByTheirVelocities) {
  only_absorb(0.1);
  const std::array<float, 9> positions{0, 0, 0, 8, 0, 0, 0, 8, 0};
  const std::array<float, 9> velocities{-5, 0, 0, -5, 0, 0, -5, 0, 0};
  surface::TriangleMesh mesh;
  mesh.positions = positions;
  mesh.velocities = velocities;
  mesh.to_world = glm::scale(dmat4(1.0), dvec3(2.0));
  mesh.material = test::diffuse(vec3(0.0F));
  const surface::ScenePtr scene = surface::import_triangles(std::span(&mesh, 1), "mesh");
  viewer().set_surfaces(std::make_shared<const viewer::SurfaceAsset>(scene, std::string("mesh")));
  // At y = 8 the triangle covers x = 0 to 8 and moves by 5 to each side. x = 6 is covered except from t = 1 - 3 / 10
  // on, and x = -2 after that.
  EXPECT_NEAR(along_z(6.0, 8.0), 0.3, 4.5 * sigma(0.3));
  EXPECT_NEAR(along_z(-2.0, 8.0), 0.7, 4.5 * sigma(0.7));
  EXPECT_NEAR(along_z(6.0, 8.0, 0.0), 0.0, 1e-6) << "the shutter is closed";
}

// It moves by its own width. Where it is at only one end of the interval, its optical depth is linear in time.
TEST_P(MotionBlur, VolumeMovesByItsVelocityField) {
  only_absorb(0.1);
  const ivec3 size(16, 64, 16);
  volume::VolumeFrame frame{.density = test::make_volume(size, ivec3(0), [](const ivec3&) { return 1.0F; })};
  volume::Velocity velocity;
  for (std::size_t part = 0; part < velocity.parts.size(); ++part)
    velocity.parts[part] = test::make_volume(size, ivec3(0), [=](const ivec3&) { return part == 0 ? 16.0F : 0.0F; });
  frame.velocity = std::move(velocity);
  still_->set_volume(std::move(frame));
  const double depth = 0.1 * 16.0;
  const double passing = (1.0 - std::exp(-depth)) / depth;
  const double held = std::exp(-depth);
  const double half = std::exp(-0.5 * depth);
  std::vector<viewer::GridSettings> grids;
  for (const test::MarchKind& kind : test::march_kinds) grids.push_back(test::settings_of(kind));
  for (const test::MarchKind& kind : {test::march_kinds[2], test::march_kinds[3]}) {
    grids.push_back(test::settings_of(kind));
    grids.back().build.interpolation = grid::Interpolation::linear;
  }
  grids.push_back(test::settings_of({render::March::tet, grid::CellKind::trilinear}));
  grids.back().build.interpolation = grid::Interpolation::linear;
  for (const viewer::GridSettings& grid : grids) {
    const bool linear = grid.build.interpolation == grid::Interpolation::linear;
    still_->set_grid(grid);
    // From [-8.5, 7.5] to [7.5, 23.5] in a second.
    EXPECT_NEAR(along_z(0.0, 31.5), passing, 4.5 * sigma(passing)) << "it leaves";
    EXPECT_NEAR(along_z(16.0, 31.5), passing, 4.5 * sigma(passing)) << "it comes";
    EXPECT_NEAR(along_z(30.0, 31.5), 1.0, 1e-6) << "it never is there";
    // In half of the time from [-4.5, 11.5] to [3.5, 19.5].
    EXPECT_NEAR(along_z(8.0, 31.5, 0.5), held, 4.5 * sigma(held)) << "it stays";
    EXPECT_NEAR(along_z(14.0, 31.5, 0.5), passing, 4.5 * sigma(passing)) << "less far in less time";
    EXPECT_NEAR(along_z(0.0, 31.5, 0.0), held, 4.5 * sigma(held)) << "the shutter is closed";
    EXPECT_NEAR(along_z(18.0, 31.5, 0.0), 1.0, 1e-6) << "the shutter is closed";
    if (linear) {
      EXPECT_NEAR(along_z(15.5, 31.5, 0.0), half, 4.5 * sigma(half)) << "the border";
    }
  }
}

// The velocity is multiplied by the playback's velocity scale.
TEST_P(MotionBlur, SequenceVelocityUsesTheVelocityScale) {
  only_absorb(0.1);
  openvdb::initialize();
  const test::Folder folder;
  const auto density = test::fog("density");
  density->fill({{0, 0, 0}, {15, 63, 15}}, 1.0F);
  const auto velocity = openvdb::Vec3SGrid::create(openvdb::Vec3f(0.0F));
  velocity->setName("vel");
  velocity->fill({{-8, -8, -8}, {23, 71, 23}}, openvdb::Vec3f(8.0F, 0.0F, 0.0F));
  const std::string path = (folder / "moves.vdb").string();
  openvdb::io::File(path).write({density, velocity});
  const auto files = std::make_shared<const viewer::FrameFiles>(viewer::FrameFiles{{path}, {}});
  viewer::SequenceState state;
  state.playback.velocity_scale = 2.0;
  const auto sequence = std::make_shared<viewer::Sequence>(files, state);
  viewer().set_sequence(sequence);
  const double depth = 0.1 * 16.0;
  const double passing = (1.0 - std::exp(-depth)) / depth;
  const double held = std::exp(-depth);
  // From [-8.5, 7.5] to [7.5, 23.5] in a second.
  EXPECT_NEAR(along_z(0.0, 31.5), passing, 4.5 * sigma(passing));
  state.playback.velocity_scale = 1.0;
  sequence->set_playback(state.playback);
  // From [-4.5, 11.5] to [3.5, 19.5].
  EXPECT_NEAR(along_z(8.0, 31.5), held, 4.5 * sigma(held));
  EXPECT_NEAR(along_z(14.0, 31.5), passing, 4.5 * sigma(passing));
}

TEST(MotionEndpoints, SingularIntermediateTransformsAreDetected) {
  const auto turned = [](double degrees) {
    return glm::rotate(dmat4(1.0), glm::radians(degrees), glm::normalize(dvec3(1.0, 2.0, 0.5)));
  };
  const dmat4 one(1.0);
  EXPECT_TRUE(scene::stays_solid(one, one));
  EXPECT_TRUE(scene::stays_solid(one, turned(170.0)));
  EXPECT_FALSE(scene::stays_solid(one, turned(180.0)));
  EXPECT_FALSE(scene::stays_solid(one, glm::scale(one, dvec3(-1.0, 1.0, 1.0)))) << "mirrored";
  EXPECT_FALSE(scene::stays_solid(one, glm::scale(one, dvec3(-1.0, -1.0, 1.0)))) << "flat in the middle alone";
  EXPECT_TRUE(scene::stays_solid(glm::scale(one, dvec3(-2.0, 1.0, 1.0)), glm::scale(one, dvec3(-1.0, 3.0, 1.0))));
  EXPECT_TRUE(scene::stays_solid(glm::scale(one, dvec3(1e-3)), glm::scale(one, dvec3(1e3))));
}

}  // namespace
