// Descriptors of cumulet.hpp convert to the C structs.
#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "cumulet/cumulet.hpp"

namespace {

using namespace cumulet;  // NOLINT(google-build-using-namespace)

template <class Range, class Values>
void expect_same(const Range& range, const Values& values) {
  EXPECT_TRUE(std::ranges::equal(range, values)) << testing::PrintToString(range);
}

TEST(CppDescs, ClipConvertsToTheCStruct) {
  constexpr std::array<std::array<double, 4>, 2> planes{{{1.0, 2.0, 3.0, 4.0}, {5.0, 6.0, 7.0, 8.0}}};
  const cumulet_clip_desc clip = ClipDesc{.box = Bounds{{1.0, 2.0, 3.0}, {4.0, 5.0, 6.0}}, .planes = planes};
  EXPECT_EQ(clip.struct_size, sizeof clip);
  EXPECT_EQ(clip.box, 1);
  expect_same(clip.box_min, Vector{1.0, 2.0, 3.0});
  expect_same(clip.box_max, Vector{4.0, 5.0, 6.0});
  EXPECT_EQ(clip.planes, planes.front().data());
  EXPECT_EQ(clip.plane_count, 2U);
  const cumulet_clip_desc no_clip = ClipDesc{};
  EXPECT_EQ(no_clip.box, 0);
  EXPECT_EQ(no_clip.planes, nullptr);
}

TEST(CppDescs, ConvertToTheCStructs) {
  const cumulet_grid_desc grid = GridDesc{.type = GridType::bricks,
                                          .cells = CellDensity::constant,
                                          .criterion = RefinementCriterion::range_mean,
                                          .threshold = 1.5,
                                          .max_cells = 7,
                                          .camera_adaptive = true,
                                          .pixel_size = 2.5,
                                          .build_device = BuildDevice::gpu};
  EXPECT_EQ(grid.struct_size, sizeof grid);
  EXPECT_EQ(grid.type, CUMULET_GRID_BRICKS);
  EXPECT_EQ(grid.cells, CUMULET_CELLS_CONSTANT);
  EXPECT_EQ(grid.criterion, CUMULET_CRITERION_RANGE_MEAN);
  EXPECT_EQ(grid.threshold, 1.5);
  EXPECT_EQ(grid.max_cells, 7U);
  EXPECT_EQ(grid.camera_adaptive, 1);
  EXPECT_EQ(grid.pixel_size, 2.5);
  EXPECT_EQ(grid.build_device, CUMULET_BUILD_GPU);

  const cumulet_medium_desc medium = MediumDesc{
      .density_scale = 2, .coalbedo = {0.1F, 0.2F, 0.3F}, .anisotropy = 0.5F, .max_bounces = 9, .emission = {4, 5, 6}};
  EXPECT_EQ(medium.struct_size, sizeof medium);
  EXPECT_EQ(medium.density_scale, 2.0);
  expect_same(medium.coalbedo, Rgb{0.1F, 0.2F, 0.3F});
  EXPECT_EQ(medium.anisotropy, 0.5F);
  EXPECT_EQ(medium.max_bounces, 9U);
  expect_same(medium.emission, std::array{4.0F, 5.0F, 6.0F});

  const cumulet_sun_sky_desc light = SunSkyDesc{
      .sun_azimuth_degrees = 1, .sun_elevation_degrees = 2, .sun_irradiance = {3, 4, 5}, .sky_radiance = {6, 7, 8}};
  EXPECT_EQ(light.struct_size, sizeof light);
  EXPECT_EQ(light.sun_azimuth_degrees, 1.0F);
  EXPECT_EQ(light.sun_elevation_degrees, 2.0F);
  expect_same(light.sun_irradiance, Rgb{3, 4, 5});
  expect_same(light.sky_radiance, Rgb{6, 7, 8});

  const cumulet_sampling_desc sampling =
      SamplingDesc{.samples = 3, .seed = 4, .view = ViewMode::wireframe, .preview = Preview::off};
  EXPECT_EQ(sampling.struct_size, sizeof sampling);
  EXPECT_EQ(sampling.samples, 3U);
  EXPECT_EQ(sampling.seed, 4U);
  EXPECT_EQ(sampling.view, CUMULET_VIEW_WIREFRAME);
  EXPECT_EQ(sampling.preview, CUMULET_PREVIEW_OFF);

  const cumulet_display_desc display =
      DisplayDesc{.exposure_stops = -1.5F, .tone_map = ToneMap::clip, .background = Background::transparent};
  EXPECT_EQ(display.struct_size, sizeof display);
  EXPECT_EQ(display.exposure_stops, -1.5F);
  EXPECT_EQ(display.tone_map, CUMULET_TONE_MAP_CLIP);
  EXPECT_EQ(display.background, CUMULET_BACKGROUND_TRANSPARENT);

  const cumulet_camera_desc camera = CameraDesc{.eye = {1, 2, 3},
                                                .target = {4, 5, 6},
                                                .up = {7, 8, 9},
                                                .fovy_degrees = 10,
                                                .orthographic_height = 11,
                                                .near_plane = 12,
                                                .far_plane = 13,
                                                .depth = DepthConvention::reversed};
  EXPECT_EQ(camera.struct_size, sizeof camera);
  expect_same(camera.eye, Vector{1, 2, 3});
  expect_same(camera.target, Vector{4, 5, 6});
  expect_same(camera.up, Vector{7, 8, 9});
  EXPECT_EQ(camera.fovy_degrees, 10.0);
  EXPECT_EQ(camera.orthographic_height, 11.0);
  EXPECT_EQ(camera.near_plane, 12.0);
  EXPECT_EQ(camera.far_plane, 13.0);
  EXPECT_EQ(camera.depth, CUMULET_DEPTH_REVERSED);

  const cumulet_navigation_desc navigation =
      NavigationDesc{.style = NavigationStyle::maya, .fly = true, .speed = 2, .turntable_degrees_per_second = 3};
  EXPECT_EQ(navigation.struct_size, sizeof navigation);
  EXPECT_EQ(navigation.style, CUMULET_NAVIGATION_MAYA);
  EXPECT_EQ(navigation.fly, 1);
  EXPECT_EQ(navigation.speed, 2.0);
  EXPECT_EQ(navigation.turntable_degrees_per_second, 3.0);

  const cumulet_event event = Event{.type = EventType::key_down,
                                    .x = 1,
                                    .y = 2,
                                    .wheel = 3,
                                    .button = Button::right,
                                    .key = Key{'F'},
                                    .modifiers = Modifiers::shift | Modifiers::alt};
  EXPECT_EQ(event.struct_size, sizeof event);
  EXPECT_EQ(event.type, CUMULET_EVENT_KEY_DOWN);
  EXPECT_EQ(event.x, 1.0);
  EXPECT_EQ(event.y, 2.0);
  EXPECT_EQ(event.wheel, 3.0);
  EXPECT_EQ(event.button, CUMULET_BUTTON_RIGHT);
  EXPECT_EQ(event.key, 'F');
  EXPECT_EQ(event.modifiers, CUMULET_MODIFIER_SHIFT | CUMULET_MODIFIER_ALT);
  EXPECT_EQ(static_cast<int>(Key::keypad_7), CUMULET_KEY_KEYPAD_0 + 7);

  const cumulet_frame_desc frame = FrameDesc{.budget_ms = 1,
                                             .target = FrameTarget::texture,
                                             .framebuffer = 2,
                                             .width = 3,
                                             .height = 4,
                                             .viewport = {5, 6, 7, 8},
                                             .flip_y = true,
                                             .scale = 9,
                                             .format = 10,
                                             .color = ColorEncoding::hdr,
                                             .blend = BlendMode::replace,
                                             .write_depth = true,
                                             .depth_source = DepthSource::framebuffer,
                                             .depth_name = 11,
                                             .depth_flip_y = true,
                                             .depth_unchanged = true};
  EXPECT_EQ(frame.struct_size, sizeof frame);
  EXPECT_EQ(frame.budget_ms, 1.0);
  EXPECT_EQ(frame.target, CUMULET_TARGET_TEXTURE);
  EXPECT_EQ(frame.framebuffer, 2U);
  EXPECT_EQ(frame.width, 3U);
  EXPECT_EQ(frame.height, 4U);
  expect_same(frame.viewport, std::array{5, 6, 7, 8});
  EXPECT_EQ(frame.flip_y, 1);
  EXPECT_EQ(frame.scale, 9.0);
  EXPECT_EQ(frame.format, 10U);
  EXPECT_EQ(frame.color, CUMULET_COLOR_HDR);
  EXPECT_EQ(frame.blend, CUMULET_BLEND_REPLACE);
  EXPECT_EQ(frame.write_depth, 1);
  EXPECT_EQ(frame.depth_source, CUMULET_DEPTH_SOURCE_FRAMEBUFFER);
  EXPECT_EQ(frame.depth_name, 11U);
  EXPECT_EQ(frame.depth_flip_y, 1);
  EXPECT_EQ(frame.depth_unchanged, 1);

  Matrix matrix{};
  std::iota(matrix.begin(), matrix.end(), 1.0);
  const std::array<float, 3> values{1, 2, 3};
  const cumulet_dense_desc dense =
      DenseDesc{.values = values, .size = {1, 2, 3}, .index_to_world = matrix, .name = "a"};
  EXPECT_EQ(dense.struct_size, sizeof dense);
  EXPECT_EQ(dense.values, values.data());
  EXPECT_EQ(dense.value_count, 3U);
  expect_same(dense.size, std::array{1, 2, 3});
  expect_same(dense.index_to_world, matrix);
  EXPECT_STREQ(dense.name, "a");

  const std::vector<std::int32_t> origins(6);
  const std::vector<float> bricks(1024);
  const std::vector<std::uint64_t> active(16);
  const std::array<cumulet_tile, 3> tiles{};
  const cumulet_sparse_desc sparse = SparseDesc{.brick_origins = origins,
                                                .brick_values = bricks,
                                                .brick_active = active,
                                                .tiles = tiles,
                                                .background = 0.5F,
                                                .index_to_world = matrix,
                                                .name = "b"};
  EXPECT_EQ(sparse.struct_size, sizeof sparse);
  EXPECT_EQ(sparse.brick_origins, origins.data());
  EXPECT_EQ(sparse.brick_values, bricks.data());
  EXPECT_EQ(sparse.brick_active, active.data());
  EXPECT_EQ(sparse.brick_count, 2U);
  EXPECT_EQ(sparse.tiles, tiles.data());
  EXPECT_EQ(sparse.tile_count, 3U);
  EXPECT_EQ(sparse.background, 0.5F);
  expect_same(sparse.index_to_world, matrix);
  EXPECT_STREQ(sparse.name, "b");
}

TEST(CppSurfaces, FromHostTriangles) {
  const std::array<float, 9> positions = {0, 0, 0, 2, 0, 0, 0, 1, 0};
  const std::array<float, 9> normals = {0, 0, 1, 0, 0, 1, 0, 0, 1};
  const std::array<float, 12> colors = {1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1};
  const std::array<std::uint32_t, 6> indices = {0, 1, 2, 2, 1, 0};
  const MeshDesc desc{.positions = positions,
                      .normals = normals,
                      .colors = colors,
                      .indices = indices,
                      .to_world = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 5, 1},
                      .base_color = {0.1F, 0.2F, 0.3F, 0.4F},
                      .metallic = 0.5F,
                      .smoothness = 0.6F,
                      .emission = {7, 8, 9},
                      .double_sided = true,
                      .velocities = normals};
  const cumulet_mesh_desc c = desc;
  EXPECT_EQ(c.struct_size, sizeof c);
  EXPECT_EQ(c.positions, positions.data());
  EXPECT_EQ(c.normals, normals.data());
  EXPECT_EQ(c.colors, colors.data());
  EXPECT_EQ(c.vertex_count, 3U);
  EXPECT_EQ(c.indices, indices.data());
  EXPECT_EQ(c.index_count, 6U);
  expect_same(c.to_world, desc.to_world);
  expect_same(c.base_color, desc.base_color);
  EXPECT_EQ(c.metallic, 0.5F);
  EXPECT_EQ(c.smoothness, 0.6F);
  expect_same(c.emission, desc.emission);
  EXPECT_EQ(c.double_sided, 1);
  EXPECT_EQ(c.velocities, normals.data());
  const cumulet_mesh_desc bare = MeshDesc{.positions = positions};
  EXPECT_EQ(bare.normals, nullptr);
  EXPECT_EQ(bare.colors, nullptr);
  EXPECT_EQ(bare.velocities, nullptr);

  const std::array<MeshDesc, 2> meshes = {desc, MeshDesc{.positions = positions}};
  const Surfaces surfaces = Surfaces::from_triangles({.meshes = meshes, .name = "made"}).value();
  const SurfacesInfo info = surfaces.info().value();
  EXPECT_EQ(info.name.view(), "made");
  EXPECT_EQ(info.triangles, 3U);
  EXPECT_EQ(info.materials, 2U);
  EXPECT_EQ(info.meshes, 2U);
  EXPECT_EQ(info.primitives, 2U);
  EXPECT_EQ(info.textures, 0U);
  EXPECT_EQ(info.lights + info.cameras + info.animations, 0U);
  EXPECT_EQ(info.bounds.max, (Vector{4, 2, 5}));
  EXPECT_EQ(surfaces.animation(0).error().status, StatusCode::invalid_argument);

  EXPECT_TRUE(Surfaces::from_triangles({}));
  for (const MeshDesc& bad :
       {MeshDesc{.positions = std::span(positions).first(8)}, MeshDesc{.positions = positions, .normals = colors},
        MeshDesc{.positions = positions, .colors = positions}, MeshDesc{.positions = positions, .velocities = colors},
        MeshDesc{.positions = positions, .indices = std::span(indices).first(4)}}) {
    EXPECT_EQ(Surfaces::from_triangles({.meshes = {&bad, 1}}).error().status, StatusCode::invalid_argument);
  }
}

}  // namespace
