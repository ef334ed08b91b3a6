// cumulet-render --info, as lines and as JSON, and the up axis that it chooses.

#include "info.hpp"

#include <gtest/gtest.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "support/folder.hpp"
#include "support/openvdb.hpp"
#include "up_axis.hpp"

namespace {

using cumulet::demo::SceneOptions;
using cumulet::demo::UpAxis;
using nlohmann::json;

openvdb::FloatGrid::Ptr box(const std::string& name) {
  auto grid = openvdb::FloatGrid::create(0.0F);
  grid->fill({{0, 0, 0}, {3, 1, 0}}, 0.5F);
  grid->tree().setValue({1, 1, 0}, 2.0F);
  grid->setName(name);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
  return grid;
}

class Info : public testing::Test {
 protected:
  static void SetUpTestSuite() { openvdb::initialize(); }

  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  [[nodiscard]] SceneOptions volume(const std::string& name) const {
    SceneOptions scene;
    scene.volume = path(name);
    return scene;
  }
  void write_vdb(const std::string& name, const openvdb::GridPtrVec& grids, const openvdb::MetaMap& meta = {}) const {
    openvdb::io::File(path(name)).write(grids, meta);
  }
  static std::string lines(const SceneOptions& scene) {
    std::ostringstream out;
    cumulet::demo::write_info(scene, false, out);
    return out.str();
  }
  static json info_of(const SceneOptions& scene) {
    std::ostringstream out;
    cumulet::demo::write_info(scene, true, out);
    return json::parse(out.str());
  }

 private:
  cumulet::test::Folder folder_;
};

void expect_line(const std::string& text, const std::string& line) {
  EXPECT_NE(("\n" + text).find("\n" + line + "\n"), std::string::npos) << line << "\nis not a line of\n" << text;
}

TEST_F(Info, NamesTheContentThatDecidesTheDefaultMedium) {
  const auto hot = [](const char* name, float value) {
    auto grid = box(name);
    grid->tree().setValue({2, 1, 0}, value);
    return grid;
  };
  const auto content = [&](const openvdb::GridPtrVec& grids) {
    write_vdb("content.vdb", grids);
    return info_of(volume("content.vdb"))["volume"]["content"].get<std::string>();
  };
  EXPECT_EQ(content({box("density")}), "cloud");
  EXPECT_EQ(content({box("density"), hot("temperature", 271.0F)}), "cloud") << "air";
  EXPECT_EQ(content({box("density"), hot("temperature", 400.0F)}), "smoke");
  EXPECT_EQ(content({box("density"), box("shadow")}), "smoke");
  EXPECT_EQ(content({box("density"), hot("temperature", 1800.0F)}), "fire");
  EXPECT_EQ(content({box("density"), box("heat")}), "fire") << "2 is 3000 kelvin";
  EXPECT_EQ(content({box("density"), box("flames")}), "fire");
  expect_line(lines(volume("content.vdb")), "content: fire");
}

TEST_F(Info, DescribesAVdb) {
  auto velocity = openvdb::Vec3SGrid::create(openvdb::Vec3s(0));
  velocity->tree().setValue({0, 0, 0}, openvdb::Vec3s(3, 4, 0));
  velocity->setName("vel");
  openvdb::MetaMap meta;
  meta.insertMeta("artist", openvdb::StringMetadata("a\nb"));
  write_vdb("two.vdb", {velocity, box("density")}, meta);

  const json all = info_of(volume("two.vdb"));
  EXPECT_FALSE(all.contains("surfaces"));
  const json& file = all["volume"];
  EXPECT_EQ(file["file"], path("two.vdb"));
  EXPECT_NE(file["format"].get<std::string>().find("OpenVDB"), std::string::npos);
  EXPECT_GT(file["bytes"], 100);
  const json artist = {{"name", "artist"}, {"type", "string"}, {"value", "a\nb"}};
  EXPECT_NE(std::find(file["metadata"].begin(), file["metadata"].end(), artist), file["metadata"].end());
  ASSERT_EQ(file["grids"].size(), 2U);
  const json& lengths = file["grids"][0];
  EXPECT_EQ(lengths["name"], "vel");
  EXPECT_EQ(lengths["values"], "lengths");
  EXPECT_EQ(lengths["channel"], "velocity");
  EXPECT_EQ(lengths["range"], json({5.0, 5.0}));
  EXPECT_FALSE(lengths["shown_by_default"].get<bool>());
  const json& density = file["grids"][1];
  EXPECT_EQ(density["name"], "density");
  EXPECT_TRUE(density["shown_by_default"].get<bool>());
  EXPECT_EQ(density["values"], "scalars");
  EXPECT_EQ(density["channel"], "density");
  EXPECT_EQ(density["active_voxels"], 8);
  EXPECT_EQ(density["voxel_min"], json({0, 0, 0}));
  EXPECT_EQ(density["voxel_max"], json({3, 1, 0}));
  EXPECT_EQ(density["range"], json({0.5, 2.0}));
  EXPECT_NEAR(density["mean"], (7 * 0.5 + 2.0) / 8, 1e-6);
  EXPECT_EQ(density["negative_voxels"], 0);
  EXPECT_EQ(density["non_finite_voxels"], 0);
  EXPECT_EQ(density["index_to_world"][0], 0.25);
  EXPECT_EQ(density["bounds_max"], json({0.875, 0.375, 0.125}));
  EXPECT_GT(density["memory_bytes"], 0);
  std::uint64_t counted = 0;
  for (const json& bin : density["histogram"]) counted += bin.get<std::uint64_t>();
  EXPECT_EQ(counted, 8U);

  const std::string text = lines(volume("two.vdb"));
  expect_line(text, "file: " + path("two.vdb"));
  expect_line(text, "  artist (string): a b");
  expect_line(text, "- density");
  expect_line(text, "    active_voxels: 8");
  expect_line(text, "    range: [0.5,2.0]");
  EXPECT_EQ(text.find("histogram"), std::string::npos);
}

TEST_F(Info, DescribesANanoVdb) {
  const auto handle = nanovdb::openToNanoVDB(*box("smoke"));
  nanovdb::io::writeGrid(path("one.nvdb"), handle);
  const json all = info_of(volume("one.nvdb"));
  EXPECT_NE(all["volume"]["format"].get<std::string>().find("NanoVDB"), std::string::npos);
  ASSERT_EQ(all["volume"]["grids"].size(), 1U);
  const json& grid = all["volume"]["grids"][0];
  EXPECT_EQ(grid["name"], "smoke");
  EXPECT_EQ(grid["active_voxels"], 8);
  EXPECT_EQ(grid["range"], json({0.5, 2.0}));
  expect_line(lines(volume("one.nvdb")), "- smoke");
}

TEST_F(Info, DescribesAScenesCameras) {
  write_vdb("one.vdb", {box("density")});
  SceneOptions scene = volume("one.vdb");
  EXPECT_FALSE(info_of(scene).contains("scene"));
  for (const char* name : {"front", "the side"}) scene.cameras.emplace_back().name = name;
  EXPECT_EQ(info_of(scene)["scene"], json::parse(R"({"cameras": [{"name": "front"}, {"name": "the side"}]})"));
  expect_line(lines(scene), "- the side");
}

TEST_F(Info, DescribesAModel) {
  // Two meshes, one of two primitives. The first is used twice, the other one not at all.
  std::ofstream(path("model.gltf")) << R"({
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
    "nodes": [{"mesh": 0}, {"mesh": 0, "translation": [5, 0, 0]}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 1},
                               {"attributes": {"POSITION": 0}, "mode": 0}]},
               {"primitives": [{"attributes": {"POSITION": 0}}]}],
    "materials": [{"name": "a"}, {"name": "b"}, {"name": "c"}],
    "images": [{"uri": "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAQAAAC1HAwCAAAAC0lEQVR42mNkYAAAAAYAAjCB0C8AAAAASUVORK5CYII="}],
    "textures": [{"source": 0}, {"source": 0}],
    "extensions": {"KHR_materials_variants": {"variants": [{"name": "day"}, {"name": "night"}]}},
    "animations": [{"name": "slide", "samplers": [{"input": 1, "output": 2}],
                    "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}],
    "accessors": [
      {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
      {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [2]},
      {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 8},
                    {"buffer": 0, "byteOffset": 44, "byteLength": 24}],
    "buffers": [{"uri": "data.bin", "byteLength": 68}]})";
  const std::array<float, 17> numbers = {-1, -1, 0, 1, -1, 0, 0, 1, 0, 0, 2, 0, 0, 0, 5, 0, 0};
  std::ofstream(path("data.bin"), std::ios::binary)
      .write(reinterpret_cast<const char*>(numbers.data()), sizeof numbers);
  SceneOptions scene;
  scene.surfaces = path("model.gltf");
  const json all = info_of(scene);
  EXPECT_FALSE(all.contains("volume"));
  const json& model = all["surfaces"];
  EXPECT_EQ(model["file"], path("model.gltf"));
  EXPECT_EQ(model["meshes"], 2);
  EXPECT_EQ(model["primitives"], 3);
  EXPECT_EQ(model["triangles"], 2) << "those that are shown";
  EXPECT_EQ(model["materials"], 3);
  EXPECT_EQ(model["textures"], 2);
  EXPECT_EQ(model["lights"], 0);
  EXPECT_EQ(model["cameras"], 0);
  EXPECT_EQ(model["bounds_max"], json({6.0, 1.0, 0.0}));
  EXPECT_EQ(model["animations"], json::array({{{"name", "slide"}, {"duration", 2.0}}}));
  EXPECT_EQ(model["variants"], json::array({{{"name", "day"}}, {{"name", "night"}}}));
  const std::string text = lines(scene);
  expect_line(text, "- night");
  expect_line(text, "meshes: 2");
  expect_line(text, "textures: 2");
  expect_line(text, "- slide");
  expect_line(text, "    duration: 2.0");
  // Both at once.
  write_vdb("box.vdb", {box("density")});
  scene.volume = path("box.vdb");
  const json both = info_of(scene);
  EXPECT_TRUE(both.contains("volume") && both.contains("surfaces"));
  scene.surfaces = path("none.glb");
  EXPECT_THROW(info_of(scene), std::runtime_error);
}

class UpAxes : public Info {
 protected:
  UpAxes() {
    openvdb::MetaMap blender;
    blender.insertMeta("creator", openvdb::StringMetadata("Blender/Smoke"));
    write_vdb("blender.vdb", {box("density")}, blender);
    openvdb::MetaMap other;
    other.insertMeta("creator", openvdb::StringMetadata("Houdini"));
    write_vdb("other.vdb", {box("density")}, other);
    const auto signed_by_mantaflow = box("density");
    signed_by_mantaflow->insertMeta("file_base_resolution", openvdb::Vec3IMetadata(openvdb::Vec3i(64)));
    write_vdb("mantaflow.vdb", {box("shadow"), signed_by_mantaflow});
  }

  // Parses the arguments of cumulet-render and chooses the up axis. Returns the axis and the printed lines.
  static std::pair<UpAxis, std::string> chosen(std::vector<std::string> arguments,
                                               const std::optional<cumulet::demo::FramePlan>& plan = std::nullopt) {
    std::ostringstream out;
    for (const char* argument : {"-o", "a.exr"}) arguments.emplace_back(argument);
    auto options = cumulet::demo::parse_render_options(std::move(arguments), out);
    testing::internal::CaptureStderr();
    cumulet::demo::choose_up_axis(options.value(), plan);
    return {options->scene.up, testing::internal::GetCapturedStderr()};
  }
};

TEST_F(UpAxes, MetadataNamesThem) {
  for (const char* name : {"blender.vdb", "mantaflow.vdb"})
    EXPECT_EQ(cumulet::demo::known_up_axis(path(name)), UpAxis::z) << name;
  for (const char* name : {"other.vdb", "missing.vdb"})
    EXPECT_EQ(cumulet::demo::known_up_axis(path(name)), UpAxis::y) << name;
}

// A fire of Mantaflow lay on its side in the first picture.
TEST_F(UpAxes, FirstPicturesStandUpright) {
  for (const char* name : {"blender.vdb", "mantaflow.vdb"}) {
    const auto [up, lines] = chosen({path(name)});
    EXPECT_EQ(up, UpAxis::z) << name;
    EXPECT_EQ(lines.find(path(name) + ": Z is up, as its metadata says: using --up z"), 0U) << lines;
    EXPECT_EQ(std::ranges::count(lines, '\n'), 1) << lines;
  }
  EXPECT_EQ(chosen({path("other.vdb")}), std::pair(UpAxis::y, std::string()));
  EXPECT_EQ(chosen({path("missing.vdb")}), std::pair(UpAxis::y, std::string()));
}

TEST_F(UpAxes, GivenSettingsKeepTheFilesAxes) {
  EXPECT_EQ(chosen({path("blender.vdb"), "--up", "y"}), std::pair(UpAxis::y, std::string()));
  EXPECT_EQ(chosen({path("blender.vdb"), "--up", "z"}), std::pair(UpAxis::z, std::string()));
  EXPECT_EQ(chosen({path("blender.vdb"), "--info"}), std::pair(UpAxis::y, std::string()));
  const std::string scene = path("scene.json");
  std::ofstream(scene) << R"({"cumulet_scene": 3})";
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--camera", "0,0,9 0,0,0 40"}, {"--scene", scene}, {scene}}) {
    std::vector<std::string> arguments = {"--volume", path("blender.vdb")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto [up, lines] = chosen(arguments);
    EXPECT_EQ(up, UpAxis::y) << more.front();
    EXPECT_EQ(lines.find(path("blender.vdb") + ": "), 0U) << lines;
    EXPECT_NE(lines.find("try --up z"), std::string::npos) << lines;
  }
}

// All frames have the axis of the first file that can be read.
TEST_F(UpAxes, SequencesHaveOneAxis) {
  cumulet::demo::FramePlan plan;
  plan.analyzed_by = {path("missing.vdb"), path("mantaflow.vdb"), path("other.vdb")};
  EXPECT_EQ(chosen({path("####.vdb")}, plan).first, UpAxis::z);
  plan.analyzed_by = {path("other.vdb"), path("mantaflow.vdb")};
  EXPECT_EQ(chosen({path("####.vdb")}, plan), std::pair(UpAxis::y, std::string()));
}

}  // namespace
