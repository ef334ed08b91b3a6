// Triangles of the host, and handles of surfaces.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "cumulet/cumulet.h"
#include "support/c_api.hpp"
#include "support/c_surfaces.hpp"
#include "support/folder.hpp"

namespace {

using cumulet::test::CApiSurfaces;
using cumulet::test::make_desc;

/// A square of side 1 in the plane z = 0 that faces +Z.
struct Square {
  float positions[12] = {-0.5F, -0.5F, 0, 0.5F, -0.5F, 0, 0.5F, 0.5F, 0, -0.5F, 0.5F, 0};
  float normals[12] = {0, 0, 2, 0, 0, 1, 0, 0, 1, 0, 0, 1};
  uint32_t indices[6] = {0, 1, 2, 0, 2, 3};

  [[nodiscard]] cumulet_mesh_desc mesh(double x, double y) const {
    auto mesh = make_desc<cumulet_mesh_desc>();
    mesh.positions = positions;
    mesh.vertex_count = 4;
    mesh.indices = indices;
    mesh.index_count = 6;
    for (int i = 0; i < 4; ++i) mesh.to_world[5 * i] = 1.0;
    mesh.to_world[12] = x;
    mesh.to_world[13] = y;
    return mesh;
  }
};

cumulet_status make_triangles(const std::vector<cumulet_mesh_desc>& meshes, cumulet_surfaces** out,
                              std::string* message = nullptr) {
  auto desc = make_desc<cumulet_triangles_desc>();
  desc.meshes = meshes.data();
  desc.mesh_count = meshes.size();
  desc.name = "host";
  char error[512] = "";
  const cumulet_status status = cumulet_surfaces_from_triangles(&desc, out, error, sizeof error);
  if (message != nullptr) *message = error;
  return status;
}

TEST_F(CApiSurfaces, HostTrianglesAreVisible) {
  const Square square;
  cumulet_mesh_desc left = square.mesh(-1.0, 1.0);  // red, indexed, with normals
  left.normals = square.normals;
  left.emission[0] = 3.0F;
  cumulet_mesh_desc right = square.mesh(1.0, -1.0);  // green, three vertices per triangle, one triangle only
  right.indices = nullptr;
  right.index_count = 0;
  right.vertex_count = 3;
  right.emission[1] = 0.5F;
  cumulet_mesh_desc back = square.mesh(1.0, 1.0);  // rotated about the vertical axis, so that it faces away
  back.to_world[0] = back.to_world[10] = -1.0;
  back.emission[2] = 1.0F;
  cumulet_mesh_desc thin = square.mesh(-1.0, -1.0);  // alpha 0.25
  const float colors[16] = {1, 1, 1, 0.5F, 1, 1, 1, 0.5F, 1, 1, 1, 0.5F, 1, 1, 1, 0.5F};
  thin.colors = colors;
  thin.base_color[3] = 0.5F;
  cumulet_surfaces* surfaces = nullptr;
  std::string message;
  ASSERT_EQ(make_triangles({left, right, back, thin}, &surfaces, &message), CUMULET_OK) << message;
  const cumulet_surfaces_info info = info_of(surfaces);
  EXPECT_EQ(info.triangles, 7U);
  EXPECT_EQ(info.materials, 4U);
  EXPECT_STREQ(info.name, "host");
  EXPECT_DOUBLE_EQ(info.bounds_min[0], -1.5);
  EXPECT_DOUBLE_EQ(info.bounds_max[1], 1.5);

  look(viewer_);
  ASSERT_EQ(cumulet_set_surfaces(viewer_, surfaces), CUMULET_OK) << error();
  cumulet_surfaces_release(surfaces);  // the viewer keeps a reference
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  const std::vector<float> rgba = picture(viewer_);
  // A pixel is a quarter of a unit; each square covers exactly 4 x 4 pixels.
  const auto expect = [&rgba](int x, int y, float red, float green, float alpha) {
    const float* pixel = &rgba[static_cast<std::size_t>(4 * (16 * y + x))];
    EXPECT_NEAR(pixel[0], red, 1e-4) << x << ", " << y;
    EXPECT_NEAR(pixel[1], green, 1e-4) << x << ", " << y;
    EXPECT_EQ(pixel[2], 0.0F) << x << ", " << y;
    EXPECT_NEAR(pixel[3], alpha, 1e-4) << x << ", " << y;
  };
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 16; ++x) {
      const bool inside = x >= 2 && x < 6 && y >= 2 && y < 6;
      expect(x, y, inside ? 3.0F : 0.0F, 0.0F, inside ? 1.0F : 0.0F);  // the square that faces away is invisible
    }
  }
  expect(13, 13, 0.0F, 0.5F, 1.0F);  // the triangle is the square's half below the diagonal
  expect(10, 10, 0.0F, 0.0F, 0.0F);
  double covered = 0.0;
  for (int y = 10; y < 14; ++y) {
    for (int x = 2; x < 6; ++x) covered += rgba[static_cast<std::size_t>(4 * (16 * y + x) + 3)] / 16.0;
  }
  EXPECT_NEAR(covered, 0.25, 0.08);  // 512 samples: five standard errors are 0.1

  // Seen from behind: the square that faced away, and double-sided ones.
  look(viewer_, -10.0);
  EXPECT_NEAR(coverage(viewer_), 16.0 / 256.0, 1e-4);
  left.double_sided = 1;
  ASSERT_EQ(make_triangles({left, right}, &surfaces), CUMULET_OK);
  ASSERT_EQ(cumulet_set_surfaces(viewer_, surfaces), CUMULET_OK) << error();
  cumulet_surfaces_release(surfaces);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  EXPECT_NEAR(coverage(viewer_), 16.0 / 256.0, 1e-4);
}

// base_color under a white sky: the image's channels are ordered as those of the color.
TEST_F(CApiSurfaces, HostTrianglesAreLit) {
  const Square square;
  cumulet_mesh_desc mesh = square.mesh(0.0, 0.0);
  mesh.base_color[0] = 0.8F;
  mesh.base_color[1] = 0.4F;
  mesh.base_color[3] = 1.0F;
  cumulet_surfaces* surfaces = nullptr;
  ASSERT_EQ(make_triangles({mesh}, &surfaces), CUMULET_OK);
  look(viewer_);
  auto light = make_desc<cumulet_sun_sky_desc>();
  for (float& c : light.sky_radiance) c = 1.0F;
  ASSERT_EQ(cumulet_set_sun_sky(viewer_, &light), CUMULET_OK);
  ASSERT_EQ(cumulet_set_surfaces(viewer_, surfaces), CUMULET_OK);
  cumulet_surfaces_release(surfaces);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  const std::vector<float> rgba = picture(viewer_);
  double mean[3] = {};
  for (int y = 6; y < 10; ++y) {
    for (int x = 6; x < 10; ++x) {
      for (int c = 0; c < 3; ++c) mean[c] += rgba[static_cast<std::size_t>(4 * (16 * y + x) + c)] / 16.0;
    }
  }
  // Blue is only the colorless specular reflection, a few percent. The base color scales the diffuse rest.
  EXPECT_GT(mean[2], 0.01);
  EXPECT_LT(mean[2], 0.12);
  EXPECT_NEAR(mean[0] - mean[2], 2.0 * (mean[1] - mean[2]), 0.03);
  EXPECT_NEAR(mean[0], mean[2] + 0.8 * (1.0 - mean[2]), 0.05);
}

TEST_F(CApiSurfaces, InvalidTrianglesGiveAOneLineError) {
  const Square square;
  const cumulet_mesh_desc good = square.mesh(0.0, 0.0);
  std::string message;
  const auto refused = [&](const cumulet_mesh_desc& bad, const std::string& cause) {
    cumulet_surfaces* surfaces = reinterpret_cast<cumulet_surfaces*>(1);
    EXPECT_EQ(make_triangles({good, bad}, &surfaces, &message), CUMULET_ERROR_INVALID_ARGUMENT) << cause;
    EXPECT_EQ(surfaces, nullptr);
    EXPECT_EQ(message.rfind("host: mesh 1: ", 0), 0U) << message;
    EXPECT_NE(message.find(cause), std::string::npos) << message << " for " << cause;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  };
  cumulet_mesh_desc bad = good;
  const uint32_t beyond[3] = {0, 1, 4};
  bad.indices = beyond;
  bad.index_count = 3;
  refused(bad, "index 4 is out of range, of 4 vertices");
  bad.index_count = 2;
  refused(bad, "the number of indices is not a multiple of 3");
  bad = good;
  bad.index_count = 0;
  refused(bad, "the number of vertices is not a multiple of 3");
  bad = good;
  bad.indices = nullptr;
  refused(bad, "indices are NULL");
  bad = good;
  bad.positions = nullptr;
  refused(bad, "positions are NULL");
  bad = good;
  bad.vertex_count = UINT64_MAX / 8;
  refused(bad, "exceed the address space");
  float numbers[16] = {};
  numbers[7] = std::nanf("");
  bad = good;
  bad.positions = numbers;
  refused(bad, "positions");
  bad = good;
  bad.normals = numbers;
  refused(bad, "normals");
  bad = good;
  bad.colors = numbers;
  refused(bad, "color");
  bad = good;
  bad.to_world[3] = 0.5;
  refused(bad, "affine");
  bad = good;
  bad.to_world[12] = INFINITY;
  refused(bad, "to_world");
  for (float cumulet_mesh_desc::*field : {&cumulet_mesh_desc::metallic, &cumulet_mesh_desc::smoothness}) {
    bad = good;
    bad.*field = 1.5F;
    refused(bad, "from 0 to 1");
  }
  bad = good;
  bad.base_color[2] = -0.1F;
  refused(bad, "base_color");
  bad = good;
  bad.emission[1] = std::nanf("");
  refused(bad, "emission");
  bad = good;
  bad.double_sided = 2;
  refused(bad, "double_sided");
  bad = good;
  bad.struct_size = sizeof(size_t);
  refused(bad, "struct_size");

  cumulet_surfaces* surfaces = nullptr;
  float huge[12] = {};
  huge[4] = 3e38F;
  bad = good;
  bad.positions = huge;
  EXPECT_EQ(make_triangles({bad}, &surfaces, &message), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(message.find("too large"), std::string::npos) << message;
  EXPECT_EQ(cumulet_surfaces_from_triangles(nullptr, &surfaces, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  auto desc = make_desc<cumulet_triangles_desc>();
  desc.mesh_count = 1;
  EXPECT_EQ(cumulet_surfaces_from_triangles(&desc, &surfaces, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  desc.meshes = &good;
  desc.mesh_count = UINT64_MAX / 2;
  EXPECT_EQ(cumulet_surfaces_from_triangles(&desc, &surfaces, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  desc.mesh_count = 1;
  EXPECT_EQ(cumulet_surfaces_from_triangles(&desc, nullptr, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  // A list without meshes is legal: a host's scene may be empty for a while.
  ASSERT_EQ(make_triangles({}, &surfaces, &message), CUMULET_OK) << message;
  EXPECT_EQ(info_of(surfaces).triangles, 0U);
  ASSERT_EQ(cumulet_set_surfaces(viewer_, surfaces), CUMULET_OK);
  cumulet_surfaces_release(surfaces);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  look(viewer_);
  EXPECT_EQ(coverage(viewer_), 0.0);
}

// A scene without triangles gives an empty converged image; the host does not wait for it.
TEST_F(CApiSurfaces, WithoutTrianglesThePictureConvergesAndIsEmpty) {
  const auto without_mesh = folder_ / "camera.gltf";
  std::ofstream(without_mesh) << R"({"asset": {"version": "2.0"},
    "nodes": [{"camera": 0, "translation": [0, 0, 10]}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}]})";
  ASSERT_EQ(cumulet_load_surfaces(viewer_, without_mesh.c_str()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  double low[3];
  double high[3];
  EXPECT_EQ(cumulet_get_bounds(viewer_, low, high), CUMULET_ERROR_INVALID_ARGUMENT);
  auto light = make_desc<cumulet_sun_sky_desc>();
  light.sky_radiance[0] = 0.25F;
  ASSERT_EQ(cumulet_set_sun_sky(viewer_, &light), CUMULET_OK);
  for (const cumulet_surface_lighting surface_light :
       {CUMULET_SURFACE_LIGHTING_GLOBAL, CUMULET_SURFACE_LIGHTING_RASTERIZED}) {
    auto settings = make_desc<cumulet_surface_settings_desc>();
    settings.lighting = surface_light;
    ASSERT_EQ(cumulet_set_surface_settings(viewer_, &settings), CUMULET_OK);
    const std::vector<float> rgba = picture(viewer_);
    for (std::size_t i = 0; i < rgba.size(); ++i) EXPECT_EQ(rgba[i], i % 4 == 0 ? 0.25F : 0.0F) << i;
  }
  // Its camera can be used without geometry.
  EXPECT_EQ(cumulet_use_surface_camera(viewer_, 0), CUMULET_OK) << error();
  EXPECT_EQ(coverage(viewer_), 0.0);
  std::vector<float> depth(256);
  EXPECT_EQ(cumulet_read_aov(viewer_, CUMULET_AOV_SURFACE_DEPTH, depth.data(), depth.size()), CUMULET_OK) << error();
  EXPECT_TRUE(std::isinf(depth[0]));
  // Loads geometry, then a file without any again.
  ASSERT_EQ(cumulet_load_surfaces(viewer_, path_.c_str()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  EXPECT_GT(coverage(viewer_), 0.01);
  ASSERT_EQ(cumulet_set_surfaces(viewer_, nullptr), CUMULET_OK);
  EXPECT_TRUE(shows_nothing(viewer_));
}

// An array of an older header's struct, which ended before `emission`.
TEST_F(CApiSurfaces, OlderMeshStructSizesAreAccepted) {
  struct Older {
    alignas(cumulet_mesh_desc) unsigned char bytes[offsetof(cumulet_mesh_desc, emission) / 8 * 8];
  };
  const Square square;
  std::vector<Older> older(2);
  for (int i = 0; i < 2; ++i) {
    cumulet_mesh_desc mesh = square.mesh(i, 0.0);
    mesh.struct_size = sizeof(Older);
    std::memcpy(older[static_cast<std::size_t>(i)].bytes, &mesh, sizeof(Older));
  }
  auto desc = make_desc<cumulet_triangles_desc>();
  desc.meshes = reinterpret_cast<const cumulet_mesh_desc*>(older.data());
  desc.mesh_count = 2;
  cumulet_surfaces* surfaces = nullptr;
  char error[512] = "";
  ASSERT_EQ(cumulet_surfaces_from_triangles(&desc, &surfaces, error, sizeof error), CUMULET_OK) << error;
  EXPECT_EQ(info_of(surfaces).triangles, 4U);
  EXPECT_DOUBLE_EQ(info_of(surfaces).bounds_max[0], 1.5);
  cumulet_surfaces_release(surfaces);
}

TEST_F(CApiSurfaces, TwoViewersShareAHandleThatOutlivesThem) {
  const Square square;
  cumulet_surfaces* surfaces = nullptr;
  ASSERT_EQ(make_triangles({square.mesh(0.0, 0.0)}, &surfaces), CUMULET_OK);
  auto create = make_desc<cumulet_create_desc>();
  create.get_proc = cumulet::headless::Context::get_proc;
  create.get_proc_user = &context_;
  cumulet_viewer* other = nullptr;
  ASSERT_EQ(cumulet_create(&create, &other, nullptr, 0), CUMULET_OK);
  for (cumulet_viewer* viewer : {viewer_, other}) {
    look(viewer);
    ASSERT_EQ(cumulet_set_surfaces(viewer, surfaces), CUMULET_OK);
    cumulet_surfaces* got = nullptr;
    ASSERT_EQ(cumulet_get_surfaces(viewer, &got), CUMULET_OK);
    EXPECT_EQ(got, surfaces);  // available at once, the same object
    cumulet_surfaces_release(got);
  }
  for (cumulet_viewer* viewer : {viewer_, other}) {
    ASSERT_EQ(cumulet_wait(viewer, -1.0), CUMULET_OK) << cumulet_last_error(viewer);
    EXPECT_NEAR(coverage(viewer), 16.0 / 256.0, 1e-4);
  }
  cumulet_destroy(other);
  EXPECT_EQ(info_of(surfaces).triangles, 2U);
  ASSERT_EQ(cumulet_set_surfaces(viewer_, nullptr), CUMULET_OK);
  EXPECT_TRUE(shows_nothing(viewer_));
  // The viewer's reference keeps them alive after the host's release.
  ASSERT_EQ(cumulet_set_surfaces(viewer_, surfaces), CUMULET_OK);
  cumulet_surfaces_release(surfaces);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  EXPECT_NEAR(coverage(viewer_), 16.0 / 256.0, 1e-4);
  EXPECT_EQ(cumulet_set_surfaces(nullptr, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_get_surfaces(viewer_, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
}

}  // namespace
