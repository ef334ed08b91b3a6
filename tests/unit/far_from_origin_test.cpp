// Scenes far from the world's origin give the same images as at the origin, and non-finite light does not get into
// images.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <string>
#include <vector>

#include "support/gl_viewer.hpp"
#include "support/marches.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"
#include "surface/triangles.hpp"

namespace {

using namespace cumulet;
using glm::dmat4;
using glm::dvec3;
using glm::ivec3;
using glm::vec3;
using glm::vec4;

const dvec3 ecef(4201234.5, 168000.25, 4780000.75);
constexpr std::uint32_t edge = 24;

dmat4 moved(const dvec3& by) { return glm::translate(dmat4(1.0), by); }

// A tetrahedron of size 3.
viewer::SurfaceAssetPtr spike(const dmat4& to_world) {
  const std::vector<float> positions{0, 0, 0, 3, 0, 0, 0, 3, 0, 0, 0, 3};
  const std::vector<std::uint32_t> indices{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  surface::TriangleMesh mesh;
  mesh.positions = positions;
  mesh.indices = indices;
  mesh.to_world = to_world;
  mesh.material = test::diffuse(vec3(0.7F));
  mesh.material.double_sided = true;
  return std::make_shared<const viewer::SurfaceAsset>(surface::import_triangles(std::array{mesh}, "spike"), "spike");
}

struct Kind {
  const char* name;
  bool volume = false;
  bool own_surfaces = false;  // with the position in the file
  bool model = false;         // with the position in the model's transform
  bool instance = false;
  bool rasterised = false;
};

class FarFromOrigin : public test::ViewerTest {
 protected:
  // Makes a scene of this kind, translated by `at`.
  std::unique_ptr<test::Still> show(const Kind& kind, const dvec3& at) const {
    auto still = std::make_unique<test::Still>(*context_, headless::Context::get_proc, sharing_);
    viewer::Viewer& viewer = still->viewer();
    viewer::Medium medium;
    medium.density_scale = 0.3;
    medium.albedo = vec3(0.9F);
    still->set_medium(medium);
    still->set_light({30.0F, 40.0F, vec3(2.0F), vec3(0.3F)});
    light::AnalyticLight analytic_light;
    analytic_light.position = at + dvec3(6.0, 14.0, 12.0);
    analytic_light.power = vec3(2000.0F);
    viewer.set_lights({analytic_light});
    viewer.set_ground({.mode = viewer::GroundMode::at_height, .height = at.y - 2.0, .albedo = vec3(0.4F)});
    const dmat4 turned = glm::rotate(moved(at + dvec3(12.0, 1.0, 2.0)), 0.7, dvec3(0.3, 0.9, 0.1));
    if (kind.volume) {
      volume::ScalarVolume volume = test::noise_volume({12, 10, 8}, ivec3(0), 2);
      volume.index_to_world = moved(at);
      still->set_volume(std::move(volume));
    }
    if (kind.own_surfaces) viewer.set_surfaces(spike(turned));
    if (kind.model) {
      viewer::ModelSettings settings;
      settings.surfaces = spike(dmat4(1.0));
      settings.to_world = turned;
      model_ = std::make_shared<viewer::ModelInstance>(settings);
      viewer.add_model(model_);
    }
    if (kind.instance) {
      viewer::InstanceSettings settings;
      settings.volume = std::make_shared<const viewer::VolumeAsset>(test::noise_volume({8, 8, 8}, ivec3(0), 3));
      settings.to_world = glm::rotate(moved(at + dvec3(3.0, 2.0, 9.0)), 0.5, dvec3(0.0, 1.0, 0.2));
      settings.medium = medium;
      viewer.add_instance(std::make_shared<viewer::Instance>(settings));
    }
    if (kind.rasterised) {
      viewer::SurfaceSettings settings;
      settings.light = viewer::SurfaceLight::none;
      viewer.set_surface_settings(settings);
    }
    still->set_camera(test::camera_at(at + dvec3(24.0, 16.0, 30.0), at + dvec3(7.0, 4.0, 4.0), 35.0));
    return still;
  }
  mutable std::shared_ptr<viewer::ModelInstance> model_;                            // of the last scene
  std::shared_ptr<viewer::Sharing> sharing_ = std::make_shared<viewer::Sharing>();  // shares compiled programs
};
CUMULET_ON_BACKENDS(FarFromOrigin);

// With the same random numbers nearly all pixels are equal, except where rounding changes a path.
void expect_alike(const test::Picture& far, const test::Picture& near, const std::string& what) {
  ASSERT_EQ(far.pixels.size(), near.pixels.size());
  std::size_t same = 0;
  for (std::size_t i = 0; i < near.pixels.size(); ++i)
    same += glm::distance(far.pixels[i], near.pixels[i]) < 0.02F * (0.1F + glm::length(near.pixels[i])) ? 1 : 0;
  EXPECT_GT(same, near.pixels.size() * 8 / 10) << what;
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(far.mean()[i], near.mean()[i], 0.02 * near.mean()[i]) << what;
  for (std::uint32_t y = 0; y < edge; y += 8) {
    for (std::uint32_t x = 0; x < edge; x += 8) {
      glm::dvec4 difference(0.0);
      for (std::uint32_t i = 0; i < 64; ++i) {
        const std::size_t at = (y + i / 8) * edge + x + i % 8;
        difference += glm::dvec4(far.pixels[at]) - glm::dvec4(near.pixels[at]);
      }
      EXPECT_LT(glm::length(difference) / 64.0, 0.05) << what << ", at " << x << " " << y;
    }
  }
}

const test::Image image{edge, edge, 16, 5, render::View::shaded};

TEST_P(FarFromOrigin, ImagesMatchThoseAtTheOrigin) {
  const std::array kinds{Kind{.name = "volume", .volume = true},
                         Kind{.name = "surfaces", .own_surfaces = true},
                         Kind{.name = "model", .model = true},
                         Kind{.name = "both", .volume = true, .model = true},
                         Kind{.name = "instances and all", .volume = true, .own_surfaces = true, .instance = true},
                         Kind{.name = "rasterised", .volume = true, .model = true, .rasterised = true}};
  const std::array positions{dvec3(1e5, 0.0, -1e5), dvec3(1e6, 3.0, 2e6), ecef, dvec3(-1e7, 1e7, 0.3), dvec3(1e8)};
  std::size_t turn = 0;
  for (const Kind& kind : kinds) {
    const auto at_origin = show(kind, dvec3(0.0));
    const test::Picture near = test::render(*at_origin, image);
    EXPECT_GT(near.mean().x, 0.05) << kind.name;
    // Each kind is tested at two positions; together the kinds cover all positions.
    for (int i = 0; i < 2; ++i) {
      const dvec3 at = positions[turn++ % positions.size()];
      const auto far = show(kind, at);
      expect_alike(test::render(*far, image), near, kind.name + (" at " + std::to_string(at.x)));
      EXPECT_EQ(far->viewer().stats().samples_not_finite, 0U);
    }
  }
}

TEST_P(FarFromOrigin, EveryGridTypeWorksFarAway) {
  const Kind both{.name = "both", .volume = true, .model = true};
  for (const test::MarchKind& kind : test::march_kinds) {
    const auto near = show(both, dvec3(0.0));
    const auto far = show(both, ecef);
    near->set_grid(test::settings_of(kind));
    far->set_grid(test::settings_of(kind));
    expect_alike(test::render(*far, image), test::render(*near, image), "march");
  }
}

// A scene with a marker at the origin and a house far away spans the distance between them. The house near the camera
// is exact.
TEST_P(FarFromOrigin, LargeScenesAreExactNearTheCamera) {
  const Kind house{.name = "house", .model = true};
  const auto near = show(house, dvec3(0.0));
  near->viewer().set_surfaces(spike(moved(-ecef)));
  const auto far = show(house, ecef);
  far->viewer().set_surfaces(spike(dmat4(1.0)));
  expect_alike(test::render(*far, image), test::render(*near, image), "house");
}

// A scene moves far away and back: its image is the same in both positions.
TEST_P(FarFromOrigin, SceneMayMoveAwayAndReturn) {
  const Kind kind{.name = "model", .model = true};
  const auto still = show(kind, dvec3(0.0));
  const test::Picture near = test::render(*still, image);
  const viewer::CameraPose camera = still->viewer().camera()->pose();
  const viewer::ModelSettings settings = model_->get();
  const auto shift = [&](const dvec3& at) {
    model_->edit([&](viewer::ModelSettings& s) { s.to_world = moved(at) * settings.to_world; });
    viewer::CameraPose pose = camera;
    pose.eye += at;
    pose.target += at;
    still->set_camera(pose);
    still->viewer().set_ground({.mode = viewer::GroundMode::at_height, .height = at.y - 2.0, .albedo = vec3(0.4F)});
    light::AnalyticLight analytic_light;
    analytic_light.position = at + dvec3(6.0, 14.0, 12.0);
    analytic_light.power = vec3(2000.0F);
    still->viewer().set_lights({analytic_light});
    return test::render(*still, image);
  };
  expect_alike(shift(ecef), near, "there");
  EXPECT_EQ(shift(dvec3(0.0)).pixels, near.pixels) << "the same scene is the same picture";
}

TEST_P(FarFromOrigin, PicksAndAovsAreInWorldSpace) {
  const Kind kind{.name = "both", .volume = true, .model = true};
  const auto near = show(kind, dvec3(0.0));
  const auto near_model = model_;
  const auto far = show(kind, ecef);
  const auto far_model = model_;
  const auto ask = [&](test::Still& still, const std::shared_ptr<viewer::ModelInstance>& model, const dvec3& at) {
    viewer::CameraPose before = still.viewer().camera()->pose();
    before.eye += dvec3(0.5, 0.2, 0.0);
    still.viewer().set_previous_camera(std::make_shared<viewer::Camera>(before), 0.04);
    model->edit([&](viewer::ModelSettings& s) { s.previous = moved(dvec3(0.0, 0.4, 0.0)) * s.to_world; });
    still.viewer().set_previous_transforms({{moved(dvec3(0.3, 0.0, 0.0))}});
    test::render(still, image);
    std::vector<float> values;
    for (const auto& [aov, channels] :
         std::initializer_list<std::pair<viewer::Aov, std::size_t>>{{viewer::Aov::surface_depth, 1},
                                                                    {viewer::Aov::volume_depth, 1},
                                                                    {viewer::Aov::transmittance, 1},
                                                                    {viewer::Aov::normal, 3},
                                                                    {viewer::Aov::motion, 2},
                                                                    {viewer::Aov::volume_motion, 2}}) {
      std::vector<float> more(std::size_t{edge} * edge * channels);
      still.viewer().read_aov(aov, more.data(), more.size());
      values.insert(values.end(), more.begin(), more.end());
    }
    std::vector<dvec3> picked;
    for (std::uint32_t y = 4; y < edge; y += 5) {
      for (std::uint32_t x = 4; x < edge; x += 5) {
        const viewer::Pick pick = still.viewer().pick(x, y);
        picked.push_back(pick.hit ? pick.position - at : dvec3(0.0));
        if (pick.surface) picked.push_back(pick.surface->normal);
      }
    }
    return std::pair(values, picked);
  };
  const auto [near_values, near_picked] = ask(*near, near_model, dvec3(0.0));
  const auto [far_values, far_picked] = ask(*far, far_model, ecef);
  std::size_t other = 0;
  for (std::size_t i = 0; i < near_values.size(); ++i) {
    const bool same = near_values[i] == far_values[i] ||
                      std::abs(near_values[i] - far_values[i]) < 0.01F * (1.0F + std::abs(near_values[i]));
    other += same ? 0 : 1;
  }
  EXPECT_LT(other, near_values.size() / 100) << "but at edges";
  ASSERT_EQ(near_picked.size(), far_picked.size());
  EXPECT_GT(near_picked.size(), 16U) << "some of them are of the model";
  for (std::size_t i = 0; i < near_picked.size(); ++i)
    EXPECT_LT(glm::distance(near_picked[i], far_picked[i]), 1e-2) << i;
}

TEST_P(FarFromOrigin, TransmittanceMapsAreInWorldSpace) {
  const Kind kind{.name = "volume", .volume = true};
  for (const viewer::MapLight light : {viewer::MapLight::sun, viewer::MapLight::point}) {
    std::vector<dvec3> mapped;
    for (const dvec3& at : {dvec3(0.0), ecef}) {
      const auto still = show(kind, at);
      test::render(*still, {8, 8, 1, 1, render::View::shaded});
      viewer::MapRequest request;
      request.light = light;
      request.position = at + dvec3(5.0, 30.0, 5.0);
      request.size = 16;
      request.slices = 4;
      request.budget_ms = 1e6;
      viewer::MapResult map;
      do {
        map = still->viewer().update_map(request);
      } while (map.more);
      for (const dvec3& p : {dvec3(0.0), dvec3(3.0, 2.0, 6.0)})
        mapped.emplace_back(map.to_map * glm::dvec4(at + p, 1.0));
      mapped.emplace_back(map.range.x, map.range.y, 0.0);
    }
    for (std::size_t i = 0; i < 3; ++i) EXPECT_LT(glm::distance(mapped[i], mapped[3 + i]), 1e-4) << i;
  }
}

// Motion blur is the same far away.
TEST_P(FarFromOrigin, MotionBlurMatchesThatAtTheOrigin) {
  const Kind kind{.name = "both", .volume = true, .model = true};
  const auto blurred = [&](const dvec3& at) {
    const auto still = show(kind, at);
    model_->edit([](viewer::ModelSettings& s) {
      s.ends = scene::ShutterTransforms{s.to_world, moved(dvec3(0.0, 3.0, 0.0)) * s.to_world};
    });
    viewer::CameraPose close = still->viewer().camera()->pose();
    close.eye += dvec3(1.0, 0.0, 0.0);
    still->viewer().camera()->set_shutter(std::nullopt, close);
    still->viewer().set_transforms({{dmat4(1.0), scene::ShutterTransforms{dmat4(1.0), moved(dvec3(-2.0, 0.0, 0.0))}}});
    test::Image open = image;
    open.shutter_seconds = 0.02;
    return test::render(*still, open);
  };
  expect_alike(blurred(ecef), blurred(dvec3(0.0)), "blurred");
}

// ---- light that is not finite ----

// A floor over half of the view whose emission exceeds the range of images.
std::shared_ptr<test::StillScene> blinding(float emission) {
  auto scene = std::make_shared<test::StillScene>();
  surface::Material material = test::diffuse(vec3(0.5F));
  material.emission = vec3(emission);
  scene->add_quad({{{-50, 0, 50}, {0, 0, 50}, {0, 0, -50}, {-50, 0, -50}}}, scene->add(material));
  return scene;
}

TEST_P(FarFromOrigin, LightThatIsNotFiniteIsBlackAndCounted) {
  std::vector<std::string> warnings;
  viewer::Viewer viewer(Log([&](LogLevel level, const char* message) {
                          if (level >= LogLevel::warning) warnings.emplace_back(message);
                        }),
                        nullptr, true);
  viewer.attach(headless::Context::get_proc, context_.get());
  viewer.set_light({});
  viewer::CameraPose above = test::camera_at({0.0, 40.0, 0.0}, dvec3(0.0), 40.0);
  above.up = {0.0, 0.0, -1.0};
  viewer.camera()->set(above);
  viewer.set_sampling({4, 1, {render::View::shaded, false}});
  viewer::Frame frame;
  frame.target = viewer::Target::none;
  frame.size = {edge, edge};
  frame.viewport = {0, 0, edge, edge};
  frame.budget_ms = 1e9;
  std::vector<vec4> pixels(std::size_t{edge} * edge);
  const auto expect_counted = [&](std::uint64_t least, std::uint64_t most) {
    while (!viewer.render(frame).converged) {
    }
    EXPECT_GE(viewer.stats().samples_not_finite, least);
    EXPECT_LE(viewer.stats().samples_not_finite, most);
    viewer.read_linear(&pixels[0].x, pixels.size() * 4);
    for (const vec4& p : pixels) {
      for (int c = 0; c < 4; ++c) ASSERT_TRUE(std::isfinite(p[c]) && p[c] < 1e3F);
    }
    EXPECT_TRUE(std::isfinite(viewer.measure_noise().value_or(0.0)));
    EXPECT_EQ(warnings.size(), least > 0 ? 1U : 0U) << "once a picture";
    for (const std::string& warning : warnings)
      EXPECT_NE(warning.find("was not finite; they are black"), std::string::npos) << warning;
    warnings.clear();
  };
  constexpr std::uint64_t all = 4 * std::uint64_t{edge} * edge;
  viewer.show_surfaces(test::source_of(blinding(1.0F)));
  expect_counted(0, 0);
  viewer.show_surfaces(test::source_of(blinding(3e38F)));
  expect_counted(all / 4, all * 3 / 4);
  // Scenes without triangles use another kernel.
  viewer.set_surfaces(nullptr);
  viewer.set_volume(std::make_shared<const viewer::VolumeAsset>(test::slab()));
  viewer::Medium glowing;
  glowing.emission = vec3(3e38F);
  viewer.set_medium(glowing);
  viewer.wait(-1.0);
  expect_counted(all / 10, all * 3 / 4);
}

}  // namespace
