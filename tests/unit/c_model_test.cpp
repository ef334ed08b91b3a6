// Models in the C API: rejected arguments, sharing between viewers, picking, and calls from any thread.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include "support/c_host.hpp"
#include "support/fake_gl.hpp"

namespace {

using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::test::at;
using cumulet::test::converge;
using cumulet::test::difference;
using cumulet::test::FakeGl;
using cumulet::test::HostTarget;
using cumulet::test::make_desc;
using cumulet::test::make_surfaces;
using cumulet::test::make_viewer;
using cumulet::test::ModelRef;
using cumulet::test::SurfacesRef;
using cumulet::test::ViewerPtr;
using Picture = std::vector<std::uint8_t>;
using Matrix = std::array<double, 16>;

// Sheared, stretched and mirrored.
constexpr Matrix askew{-1.5, 0.2, 0, 0, 0.4, 0.8, 0, 0, 0.3, -0.2, 1.2, 0, 5, 1, -2, 1};

// A box of six sides, 4 wide, with four vertices per side. Rows of tiny triangles are added for a large triangle count.
struct Box {
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;

  explicit Box(int rows = 0) {
    for (int side = 0; side < 6; ++side) {
      const auto first = static_cast<std::uint32_t>(positions.size() / 3);
      const int axis = side / 2;
      const float s = side % 2 == 0 ? -2.0F : 2.0F;
      for (int c = 0; c < 4; ++c) {
        std::array<float, 3> p{};
        p.at(static_cast<std::size_t>(axis)) = s;
        p.at(static_cast<std::size_t>((axis + 1) % 3)) = c % 2 == 0 ? -2.0F : 2.0F;
        p.at(static_cast<std::size_t>((axis + 2) % 3)) = c / 2 == 0 ? -2.0F : 2.0F;
        positions.insert(positions.end(), p.begin(), p.end());
      }
      for (const std::uint32_t i :
           s > 0.0F ? std::array<std::uint32_t, 6>{0, 1, 3, 0, 3, 2} : std::array<std::uint32_t, 6>{0, 3, 1, 0, 2, 3})
        indices.push_back(first + i);
    }
    for (int row = 0; row < rows; ++row) {
      const auto first = static_cast<std::uint32_t>(positions.size() / 3);
      const float y = -2.0F + 4.0F * static_cast<float>(row) / static_cast<float>(rows);
      positions.insert(positions.end(), {-2.1F, y, 0.0F, -2.1F, y, 0.01F, -2.1F, y + 0.001F, 0.0F});
      for (std::uint32_t i = 0; i < 3; ++i) indices.push_back(first + i);
    }
  }

  [[nodiscard]] cumulet_mesh_desc mesh() const {
    auto desc = make_desc<cumulet_mesh_desc>();
    desc.positions = positions.data();
    desc.vertex_count = positions.size() / 3;
    desc.indices = indices.data();
    desc.index_count = indices.size();
    for (float& c : desc.base_color) c = 0.8F;
    desc.base_color[3] = 1.0F;
    return desc;
  }
};

SurfacesRef surfaces_of(const std::vector<Matrix>& transforms, const Box& box = Box(), float emission = 0.0F) {
  std::vector<cumulet_mesh_desc> meshes;
  for (const Matrix& transform : transforms) {
    meshes.push_back(box.mesh());
    std::ranges::copy(transform, meshes.back().to_world);
    for (float& e : meshes.back().emission) e = emission;
  }
  return make_surfaces(meshes);
}

ModelRef make_model(cumulet_surfaces* surfaces, const Matrix& transform = {}, bool shadow_only = false,
                    std::uint64_t tag = 0) {
  auto desc = make_desc<cumulet_model_desc>();
  desc.surfaces = surfaces;
  desc.shadow_only = shadow_only ? 1 : 0;
  desc.tag = tag;
  std::ranges::copy(transform, desc.to_world);
  return cumulet::test::made_by<ModelRef>(cumulet_model_create, desc);
}

double mean_of(const Picture& picture) {
  return std::accumulate(picture.begin(), picture.end(), 0.0) / static_cast<double>(picture.size());
}

class CModelInstance : public testing::Test {
 protected:
  [[nodiscard]] ViewerPtr make(std::uint32_t samples = 1) {
    return make_viewer({.get_proc = FakeGl::get_proc, .user = &fake_, .samples = samples});
  }
  Picture picture(cumulet_viewer* of) {
    EXPECT_EQ(cumulet_wait(of, -1.0), CUMULET_OK) << cumulet_last_error(of);
    converge(of, target_.frame());
    return target_.pixels();
  }
  static cumulet_pick pick(cumulet_viewer* of, double x, double y) {
    auto found = make_desc<cumulet_pick>();
    EXPECT_EQ(cumulet_pick_at(of, x, y, &found), CUMULET_OK) << cumulet_last_error(of);
    return found;
  }

  Context context_ = Context::create(Backend::automatic);
  FakeGl fake_{Context::get_proc, &context_};
  HostTarget target_{fake_.real(), 32, 32};
  SurfacesRef box_ = surfaces_of({at(0, 0, 0)});
};

TEST_F(CModelInstance, InvalidInputGivesAOneLineError) {
  const auto refused = [&](const auto& change, const char* cause) {
    auto desc = make_desc<cumulet_model_desc>();
    desc.surfaces = box_.get();
    change(desc);
    cumulet_model* out = nullptr;
    std::array<char, 256> error{};
    EXPECT_EQ(cumulet_model_create(&desc, &out, error.data(), error.size()), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(out, nullptr);
    EXPECT_STREQ(error.data(), cause);
    const ModelRef one = make_model(box_.get());
    EXPECT_EQ(cumulet_model_set(one.get(), &desc), CUMULET_ERROR_INVALID_ARGUMENT);
  };
  refused([](auto& d) { d.to_world[0] = NAN; }, "cumulet_model_desc.to_world is not finite");
  refused([](auto& d) { d.to_world[0] = d.to_world[15] = 1.0; }, "cumulet_model_desc.to_world is singular");
  refused([](auto& d) { d.to_world[0] = d.to_world[5] = d.to_world[10] = 1e-11, d.to_world[15] = 1.0; },
          "cumulet_model_desc.to_world is singular or too large");
  refused([](auto& d) { d.hidden = 2; }, "cumulet_model_desc.hidden is not 0 or 1");
  refused([](auto& d) { d.shadow_only = -1; }, "cumulet_model_desc.shadow_only is not 0 or 1");
  refused([](auto& d) { d.double_sided = 7; }, "cumulet_model_desc.double_sided is not 0 or 1");
  refused([](auto& d) { d.time = INFINITY; }, "cumulet_model_desc.time is not finite");
  const ModelRef one = make_model(box_.get());
  Matrix flat{};
  flat[15] = 1.0;
  EXPECT_EQ(cumulet_model_set_to_world(one.get(), flat.data()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_model_set_to_world(one.get(), nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_model_set_to_world(nullptr, flat.data()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_model_set_time(one.get(), NAN), CUMULET_ERROR_INVALID_ARGUMENT);
  const ViewerPtr shows = make();
  EXPECT_EQ(cumulet_add_model(shows.get(), nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_remove_model(shows.get(), one.get()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(shows.get()), "the model is not in the viewer");
  EXPECT_EQ(cumulet_add_model(shows.get(), one.get()), CUMULET_OK);
  EXPECT_EQ(cumulet_add_model(shows.get(), one.get()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(shows.get()), "the model is already in the viewer");
}

TEST_F(CModelInstance, ChangesAppearInAllItsViewers) {
  const ViewerPtr first = make();
  const ViewerPtr second = make();
  ASSERT_EQ(cumulet_set_surfaces(first.get(), box_.get()), CUMULET_OK);
  const Picture alone = picture(first.get());
  ModelRef one = make_model(box_.get(), at(6.0, 0.0, 0.0));
  ASSERT_EQ(cumulet_add_model(first.get(), one.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_add_model(second.get(), one.get()), CUMULET_OK);
  const Picture here = picture(first.get());
  EXPECT_NE(here, alone);
  const Picture one_alone = picture(second.get());
  EXPECT_NE(one_alone, here);
  ASSERT_EQ(cumulet_model_set_to_world(one.get(), at(-6.0, 0.0, 0.0).data()), CUMULET_OK);
  EXPECT_NE(picture(first.get()), here);
  EXPECT_NE(picture(second.get()), one_alone);
  ASSERT_EQ(cumulet_model_set_to_world(one.get(), at(6.0, 0.0, 0.0).data()), CUMULET_OK);
  EXPECT_EQ(difference(picture(second.get()), one_alone), "");
  // The viewer keeps a reference.
  cumulet_model* const name = one.get();
  cumulet_model_retain(name);
  one.reset();
  EXPECT_EQ(difference(picture(second.get()), one_alone), "");
  const ModelRef again(name);
  ASSERT_EQ(cumulet_remove_model(first.get(), name), CUMULET_OK);
  EXPECT_EQ(difference(picture(first.get()), alone), "");
  // A model without surfaces is legal and shows nothing.
  auto nothing = make_desc<cumulet_model_desc>();
  ASSERT_EQ(cumulet_model_set(name, &nothing), CUMULET_OK);
  auto frame = target_.frame();
  EXPECT_EQ(cumulet_render(second.get(), &frame, nullptr), CUMULET_OK);
}

// Two instances of one mesh look like two meshes: sheared, stretched and mirrored, lit by sun, sky and each other.
TEST_F(CModelInstance, TwoInstancesMatchOneMergedMesh) {
  for (const float emission : {0.0F, 0.7F}) {
    const SurfacesRef one = surfaces_of({at(0, 0, 0)}, Box(), emission);
    const SurfacesRef both = surfaces_of({at(-4, 0, 0), askew}, Box(), emission);
    const ViewerPtr expected = make(256);
    ASSERT_EQ(cumulet_set_surfaces(expected.get(), both.get()), CUMULET_OK);
    const ViewerPtr shows = make(256);
    const ModelRef left = make_model(one.get(), at(-4, 0, 0));
    const ModelRef right = make_model(one.get(), askew);
    ASSERT_EQ(cumulet_add_model(shows.get(), left.get()), CUMULET_OK);
    ASSERT_EQ(cumulet_add_model(shows.get(), right.get()), CUMULET_OK);
    const Picture a = picture(expected.get());
    const Picture b = picture(shows.get());
    EXPECT_NEAR(mean_of(a), mean_of(b), 0.3) << emission;
    double square = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) square += std::pow(double(a[i]) - double(b[i]), 2.0);
    EXPECT_LT(std::sqrt(square / static_cast<double>(a.size())), 3.0) << emission;
  }
}

TEST_F(CModelInstance, MovingDoesNotReuploadTriangles) {
  const SurfacesRef many = surfaces_of({at(0, 0, 0)}, Box(20000));
  const ViewerPtr shows = make();
  std::vector<ModelRef> models;
  for (int i = 0; i < 3; ++i) {
    models.push_back(make_model(many.get(), at(6.0 * i - 6.0, 0.0, 0.0)));
    ASSERT_EQ(cumulet_add_model(shows.get(), models.back().get()), CUMULET_OK);
  }
  picture(shows.get());
  const auto uploads = [&] {
    const std::uint64_t before = fake_.uploaded();
    picture(shows.get());
    return fake_.uploaded() - before;
  };
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 1.1;
  ASSERT_EQ(cumulet_set_medium(shows.get(), &medium), CUMULET_OK);
  const std::uint64_t of_a_medium = uploads();
  ASSERT_EQ(cumulet_model_set_to_world(models[1].get(), askew.data()), CUMULET_OK);
  EXPECT_LT(uploads(), of_a_medium + 4096);
  // Adding another model of the same surfaces, or removing one, uploads no triangles either.
  const ModelRef more = make_model(many.get(), at(0.0, 5.0, 0.0));
  ASSERT_EQ(cumulet_add_model(shows.get(), more.get()), CUMULET_OK);
  EXPECT_LT(uploads(), of_a_medium + 4096);
  ASSERT_EQ(cumulet_remove_model(shows.get(), models[0].get()), CUMULET_OK);
  EXPECT_LT(uploads(), of_a_medium + 4096);
}

TEST_F(CModelInstance, ThousandInstancesUseTheMemoryOfOne) {
  const SurfacesRef many = surfaces_of({at(0, 0, 0)}, Box(20000));
  const ViewerPtr shows = make();
  const auto bytes = [&] {
    picture(shows.get());
    auto stats = make_desc<cumulet_stats>();
    EXPECT_EQ(cumulet_get_stats(shows.get(), &stats), CUMULET_OK);
    return stats.gl_bytes;
  };
  const ModelRef first = make_model(many.get());
  ASSERT_EQ(cumulet_add_model(shows.get(), first.get()), CUMULET_OK);
  const std::uint64_t of_one = bytes();
  std::vector<ModelRef> models;
  for (int i = 0; i < 1000; ++i) {
    models.push_back(make_model(many.get(), at(i % 10, i / 10 % 10, -(i / 100))));
    ASSERT_EQ(cumulet_add_model(shows.get(), models.back().get()), CUMULET_OK);
  }
  EXPECT_LT(bytes(), of_one + 1000 * 400);
  EXPECT_GT(of_one, 4'000'000U);
}

TEST_F(CModelInstance, PickReturnsItsTag) {
  const SurfacesRef two = surfaces_of({at(0, 0, 0), at(0, 100, 0)});
  const ViewerPtr shows = make();
  const ModelRef here = make_model(two.get(), {}, false, 77);
  ASSERT_EQ(cumulet_add_model(shows.get(), here.get()), CUMULET_OK);
  auto camera = make_desc<cumulet_camera_desc>();
  cumulet_camera* seen = nullptr;
  ASSERT_EQ(cumulet_get_camera(shows.get(), &seen), CUMULET_OK);
  const cumulet::test::CameraRef owner(seen);
  camera.eye[2] = 12.0;
  ASSERT_EQ(cumulet_camera_set(seen, &camera), CUMULET_OK);
  picture(shows.get());
  const cumulet_pick found = pick(shows.get(), 16, 16);
  EXPECT_EQ(found.hit, 1);
  EXPECT_EQ(found.hit_surface, 1);
  EXPECT_EQ(found.hit_volume, 0);
  EXPECT_EQ(found.tag, 77U);
  EXPECT_EQ(found.material, 0U);
  EXPECT_STREQ(found.material_name, "triangles: mesh 0");
  EXPECT_NEAR(found.position[2], 2.0, 1e-4);
  EXPECT_NEAR(found.distance, 10.0, 0.1);
  EXPECT_NEAR(found.normal[2], 1.0, 1e-6);
  // Another model of the same surfaces, mirrored and closer. The pick returns its own tag and a normal towards the eye.
  const Matrix near{-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -100, 3, 1};
  const ModelRef nearer = make_model(two.get(), near, false, 78);
  ASSERT_EQ(cumulet_add_model(shows.get(), nearer.get()), CUMULET_OK);
  picture(shows.get());
  const cumulet_pick second = pick(shows.get(), 16, 16);
  EXPECT_EQ(second.tag, 78U);
  EXPECT_EQ(second.material, 1U);
  EXPECT_NEAR(second.position[2], 5.0, 1e-4);
  EXPECT_NEAR(second.normal[2], 1.0, 1e-6);
}

TEST_F(CModelInstance, ShadowOnlyModelIsInvisibleButCastsShadows) {
  const ViewerPtr shows = make(64);
  const Matrix floor{4, 0, 0, 0, 0, 0.1, 0, 0, 0, 0, 4, 0, 0, -4, 0, 1};
  const ModelRef ground = make_model(box_.get(), floor, false, 1);
  const ModelRef above = make_model(box_.get(), at(0, 3, 0), true, 2);
  ASSERT_EQ(cumulet_add_model(shows.get(), ground.get()), CUMULET_OK);
  const Picture lit = picture(shows.get());
  const cumulet_pick before = pick(shows.get(), 16, 12);
  ASSERT_EQ(cumulet_add_model(shows.get(), above.get()), CUMULET_OK);
  const Picture shaded = picture(shows.get());
  std::size_t darker = 0;
  for (std::size_t i = 0; i < lit.size(); i += 4) darker += int{lit[i]} - int{shaded[i]} > 40 ? 1U : 0U;
  EXPECT_GT(darker, 6U);
  // A shadow-only model is not picked.
  const cumulet_pick found = pick(shows.get(), 16, 12);
  EXPECT_EQ(found.tag, before.tag);
  EXPECT_EQ(found.distance, before.distance);
  // Once it is visible to cameras, it is picked.
  auto desc = make_desc<cumulet_model_desc>();
  desc.surfaces = box_.get();
  desc.tag = 2;
  std::ranges::copy(at(0, 3, 0), desc.to_world);
  ASSERT_EQ(cumulet_model_set(above.get(), &desc), CUMULET_OK);
  picture(shows.get());
  EXPECT_EQ(pick(shows.get(), 16, 12).tag, 2U);
}

// Rasterized previews show models where the path tracer does. The image is only the rasterized layers.
TEST_F(CModelInstance, RasterizationMatchesPathTracing) {
  const SurfacesRef own = surfaces_of({at(0, 0, 0)}, Box(), 1.0F);
  const auto silhouette = [&](cumulet_surface_lighting light) {
    const ViewerPtr shows = make(16);
    auto settings = make_desc<cumulet_surface_settings_desc>();
    settings.lighting = light;
    EXPECT_EQ(cumulet_set_surface_settings(shows.get(), &settings), CUMULET_OK);
    auto dark = make_desc<cumulet_sun_sky_desc>();
    EXPECT_EQ(cumulet_set_sun_sky(shows.get(), &dark), CUMULET_OK);
    const ModelRef left = make_model(own.get(), at(-4, 0, 0));
    const ModelRef right = make_model(own.get(), askew);
    EXPECT_EQ(cumulet_add_model(shows.get(), left.get()), CUMULET_OK);
    EXPECT_EQ(cumulet_add_model(shows.get(), right.get()), CUMULET_OK);
    return picture(shows.get());
  };
  const Picture traced = silhouette(CUMULET_SURFACE_LIGHTING_DIRECT);
  const Picture drawn = silhouette(CUMULET_SURFACE_LIGHTING_RASTERIZED);
  EXPECT_GT(mean_of(drawn), 60.0);
  EXPECT_NEAR(mean_of(drawn), mean_of(traced), 2.0);
}

TEST_F(CModelInstance, MayBeChangedFromAnyThread) {
  const SurfacesRef other = surfaces_of({at(0, 1, 0)});
  const ViewerPtr shows = make();
  std::vector<ModelRef> models;
  for (int i = 0; i < 4; ++i) {
    models.push_back(make_model(box_.get()));
    ASSERT_EQ(cumulet_add_model(shows.get(), models.back().get()), CUMULET_OK);
  }
  std::atomic<bool> ends = false;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&, i, model = models[static_cast<std::size_t>(i)].get()] {
      for (int k = 0; !ends; ++k) {
        EXPECT_EQ(cumulet_model_set_to_world(model, at(0.1 * (k % 50) - 2.0, i, 0.0).data()), CUMULET_OK);
        auto desc = make_desc<cumulet_model_desc>();
        desc.surfaces = k % 3 == 0 ? other.get() : box_.get();
        desc.hidden = k % 5 == 0 ? 1 : 0;
        EXPECT_EQ(cumulet_model_set(model, &desc), CUMULET_OK);
        EXPECT_EQ(cumulet_model_set_time(model, 0.1 * (k % 3)), CUMULET_OK);
      }
    });
  }
  auto frame = target_.frame();
  frame.budget_ms = 2.0;
  for (int i = 0; i < 40; ++i) {
    EXPECT_EQ(cumulet_render(shows.get(), &frame, nullptr), CUMULET_OK) << cumulet_last_error(shows.get());
    if (i % 7 != 0) continue;
    const ModelRef more = make_model(box_.get(), at(0.0, 0.0, 3.0));
    ASSERT_EQ(cumulet_add_model(shows.get(), more.get()), CUMULET_OK);
    ASSERT_EQ(cumulet_remove_model(shows.get(), models.front().get()), CUMULET_OK);
    ASSERT_EQ(cumulet_add_model(shows.get(), models.front().get()), CUMULET_OK);
    ASSERT_EQ(cumulet_remove_model(shows.get(), more.get()), CUMULET_OK);
  }
  ends = true;
  for (std::thread& thread : threads) thread.join();
  // In the end the state is the one that the threads set last.
  for (std::size_t i = 0; i < 4; ++i) {
    auto desc = make_desc<cumulet_model_desc>();
    desc.surfaces = box_.get();
    std::ranges::copy(at(4.0 * double(i) - 6.0, 0.0, 0.0), desc.to_world);
    ASSERT_EQ(cumulet_model_set(models[i].get(), &desc), CUMULET_OK);
  }
  const Picture found = picture(shows.get());
  const ViewerPtr fresh = make();
  for (const std::size_t i : {1U, 2U, 3U, 0U}) ASSERT_EQ(cumulet_add_model(fresh.get(), models[i].get()), CUMULET_OK);
  EXPECT_EQ(difference(found, picture(fresh.get())), "");
}

}  // namespace
