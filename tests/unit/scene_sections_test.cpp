// Sections of scene files: transforms, motion, cameras, sequences, models, light and the display.

#include "scene_file.hpp"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <settings.hpp>
#include <stdexcept>
#include <string>

#include "support/folder.hpp"
#include "support/scene_texts.hpp"

namespace {

using namespace cumulet::demo;
using cumulet::test::error_of;
using cumulet::test::section_error;
using cumulet::test::with;

// Linux has file names of any bytes, and JSON has none that are not UTF-8.
TEST(SceneFile, ANameThatIsNotUtf8IsNotSavedAsAnother) {
  const cumulet::test::Folder folder;
  SceneOptions scene;
  scene.volume = (folder / "cloud.vdb").string();
  const std::string path = (folder / "scene.json").string();
  save_scene(scene, path);
  using Name = std::string SceneOptions::*;
  for (const Name file : {Name{&SceneOptions::volume}, Name{&SceneOptions::environment}}) {
    SceneOptions other;
    other.*file = (folder / "wolke\xe9.vdb").string();
    try {
      save_scene(other, path);
      ADD_FAILURE();
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(error.what(), path + ": cannot name wolke\xe9.vdb, because that is not UTF-8");
    }
    EXPECT_TRUE(same_scene(load_scene(path), scene)) << "the old file remains";
  }
  // A name that is relative to the scene file lacks the folder.
  std::filesystem::create_directory(folder / "h\xe9");
  scene.volume = (folder / "h\xe9/cloud.vdb").string();
  const std::string beside = (folder / "h\xe9/scene.json").string();
  save_scene(scene, beside);
  EXPECT_EQ(load_scene(beside).volume, scene.volume);
}

TEST(SceneFile, TransformIsAMatrixOrTranslationRotationScale) {
  const SceneOptions parts = parse_scene(
      R"({"cumulet_scene": 2, "volumes": [{"translate": [5, 6, 7], "rotate_degrees": [90, 0, 90], "scale": [2, 3, 4]}]})",
      "s.json");
  // x, doubled, is rotated about z to y. y, tripled, is rotated about x to z. z, times 4, goes about x to -y, and about
  // z to x.
  const std::array<double, 16> expected = {0, 2, 0, 0, 0, 0, 3, 0, 4, 0, 0, 0, 5, 6, 7, 1};
  for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(parts.to_world[i], expected[i], 1e-12) << i;
  const SceneOptions scene = parse_scene(
      R"({"cumulet_scene": 2, "volumes": [{"places": [
          {"translate": [5, 6, 7], "rotate_degrees": [90, 0, 90], "scale": [2, 3, 4]}, {},
          [0, 2, 0, 0, 0, 0, 3, 0, 4, 0, 0, 0, 5, 6, 7, 1]]}]})",
      "s.json");
  EXPECT_EQ(scene.transforms, (std::vector<std::array<double, 16>>{
                                  parts.to_world, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, expected}));
  SceneOptions z_up = parts;
  z_up.up = UpAxis::z;
  const cumulet_volume_file_desc file = volume_file(z_up);
  // The file's up axis z becomes y before the instance transform.
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(file.to_world[8 + i], expected[4 + i], 1e-12) << i;
}

TEST(SceneFile, AnAlbedoOfOneIsSavedIfItIsGiven) {
  SceneOptions scene;
  scene.others.emplace_back().volume = "b.vdb";
  const auto again = [&] { return parse_scene(scene_text(scene, "s.json"), "s.json"); };
  EXPECT_FALSE(again().albedo_given || again().others.front().albedo_given) << "smoke would not be gray";
  scene.albedo_given = scene.others.front().albedo_given = true;
  EXPECT_TRUE(again().albedo_given && again().others.front().albedo_given);
  SceneOptions loaded;
  loaded.medium.density_scale = 2.0;
  EXPECT_TRUE(parse_scene(scene_text(loaded, "s.json"), "s.json").albedo_given) << "a cloud that was shown stays white";
}

TEST(SceneFile, KeepsTheViewOfOpenColorIo) {
  SceneOptions scene;
  scene.volume = "/a/cloud.vdb";
  const SceneOptions without = scene;
  scene.ocio = {.config = "/p/show/config.ocio", .display = "sRGB", .view = "Film \"A\"", .input = "lin"};
  const auto again = [&](const std::string& path) { return parse_scene(scene_text(scene, path), path).ocio; };
  EXPECT_EQ(again("/p/s.json"), scene.ocio);
  EXPECT_NE(scene_text(scene, "/p/s.json").find("\"show/config.ocio\""), std::string::npos);
  EXPECT_EQ(again("/q/s.json"), scene.ocio);
  EXPECT_FALSE(same_scene(scene, without));
  scene.ocio = {.config = "ocio://default"};
  EXPECT_EQ(again("/p/s.json"), scene.ocio) << "no file";
  EXPECT_THROW(static_cast<void>(parse_scene(with(R"("display": {"ocio": {"view": "Film"}})"), "s.json")),
               std::runtime_error);
}

TEST(SceneFile, DefaultLightIsDaylight) {
  const auto lit = [](const std::string& more) {
    const SceneOptions scene = parse_scene(R"({"cumulet_scene": )" + more + "}", "s.json");
    return scene.light.sky == CUMULET_SKY_PHYSICAL;
  };
  EXPECT_TRUE(lit("2"));
  EXPECT_FALSE(lit(R"(2, "environment": {})"));
  EXPECT_FALSE(lit(R"(2, "lights": [])"));
  EXPECT_TRUE(lit("3"));
  EXPECT_FALSE(lit(R"(3, "sun_sky": {})"));
  EXPECT_FALSE(lit(R"(3, "environment": {})"));
  EXPECT_FALSE(lit(R"(3, "lights": [])"));
}

TEST(SceneFile, MotionRoundTrips) {
  const SceneOptions scene = parse_scene(
      R"({"cumulet_scene": 2, "picture": {"shutter_seconds": 0.02},
          "camera": {"eye": [1, 2, 9], "target": [0, 1, 0], "fovy_degrees": 30,
                     "open": {"eye": [0.5, 2, 9], "target": [0, 1, 0]}, "lens_radius": 0.25,
                     "close": {"fovy_degrees": 33, "target": [0, 1.5, 0]}},
          "volumes": [{"file": "a.vdb", "open": {"translate": [-1, 0, 0]}},
                      {"file": "b.vdb", "close": {"to_world": [1,0,0,0, 0,2,0,0, 0,0,1,0, 3,4,5,1]}}],
          "models": [{"file": "m.glb", "close": {"rotate_degrees": [0, 90, 0]}}]})",
      "s.json");
  EXPECT_EQ(scene.sampling.shutter_seconds, 0.02F);
  ASSERT_TRUE(scene.camera_open && scene.camera_close);
  EXPECT_EQ(scene.camera_open->eye[0], 0.5);
  EXPECT_EQ(scene.camera_open->fovy_degrees, 30.0) << "the camera's";
  EXPECT_EQ(scene.camera_close->eye[0], 1.0);
  EXPECT_EQ(scene.camera_close->fovy_degrees, 33.0);
  EXPECT_EQ(scene.camera_close->target[1], 1.5);
  EXPECT_EQ((*scene.shutter.open)[12], -1.0);
  EXPECT_FALSE(scene.shutter.close);
  EXPECT_EQ((*scene.others[0].shutter.close)[5], 2.0);
  ASSERT_EQ(scene.models.size(), 1U) << "beside the surfaces, which stand still";
  EXPECT_NEAR((*scene.models[0].shutter.close)[2], -1.0, 1e-15);
  EXPECT_TRUE(same_scene(scene, parse_scene(scene_text(scene, "s.json"), "s.json")));
  for (const auto change : std::vector<void (*)(SceneOptions&)>{
           [](SceneOptions& s) { s.camera_open.reset(); }, [](SceneOptions& s) { s.camera_close->eye[1] = 7.0; },
           [](SceneOptions& s) { s.shutter.open.reset(); }, [](SceneOptions& s) { s.models[0].shutter = {}; },
           [](SceneOptions& s) { s.sampling.shutter_seconds = 1.0F; }}) {
    SceneOptions other = scene;
    change(other);
    EXPECT_FALSE(same_scene(scene, other));
  }
  EXPECT_EQ(section_error(R"("camera": {"open": {"eye": [1, 2, 3], "target": [0, 0, 0]}})"),
            "dir/s.json: camera.open: needs a camera with eye and target");
  EXPECT_EQ(section_error(R"("camera": {"eye": [1, 2, 3], "target": [0, 0, 0], "close": {"orthographic_height": 3}})"),
            "dir/s.json: camera.close.orthographic_height: has another projection than the camera");
  EXPECT_EQ(section_error(R"("camera": {"eye": [1, 2, 3], "target": [0, 0, 0], "close": {"lens_radius": 3}})"),
            "dir/s.json: camera.close.lens_radius: there is no such setting");
  EXPECT_EQ(section_error(R"("volumes": [{"file": "a.vdb", "open": {"turn": 3}}])"),
            "dir/s.json: volumes[0].open.turn: there is no such setting");
  // Shutter transforms are relative to the instance transform.
  double to_world[16] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 5, 6, 7, 1};
  double open[16];
  double close[16];
  set_shutter(scene.shutter, to_world, open, close);
  EXPECT_EQ(open[0], 2.0);
  EXPECT_EQ(open[12], 4.0);
  EXPECT_EQ(close[15], 0.0) << "where it stands";
}

TEST(SceneFile, CamerasRoundTrip) {
  const std::string cameras = R"("cameras": [
      {"name": "front", "eye": [1, 2, 9], "target": [0, 1, 0], "fovy_degrees": 30, "lens_radius": 0.25,
       "focus_distance": 7, "open": {"eye": [0.5, 2, 9]}},
      {"name": "a \"plan\"", "eye": [0, 50, 0], "target": [0, 0, 0], "up": [0, 0, -1], "orthographic_height": 20},
      {"name": "wherever", "fovy_degrees": 50}])";
  const auto read = [&](const std::string& more) {
    return parse_scene(R"({"cumulet_scene": 2, )" + cameras + more + "}", "s.json");
  };
  const auto again = [](const SceneOptions& scene) { return parse_scene(scene_text(scene, "s.json"), "s.json"); };
  const SceneOptions scene = read(R"(, "camera": {"eye": [7, 8, 9], "target": [0, 0, 0]})");
  ASSERT_EQ(scene.cameras.size(), 3U);
  EXPECT_EQ(looked_through(scene), nullptr);
  using cumulet::settings::same;
  const SceneOptions reread = again(scene);
  EXPECT_TRUE(same_scene(scene, reread));
  ASSERT_EQ(reread.cameras.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(reread.cameras[i].name, scene.cameras[i].name);
    EXPECT_TRUE(same(reread.cameras[i].camera, scene.cameras[i].camera)) << i;
  }
  ASSERT_TRUE(reread.cameras[0].camera_open);
  EXPECT_EQ(reread.cameras[0].camera_open->eye[0], 0.5);
  EXPECT_EQ(reread.cameras[0].camera_open->fovy_degrees, 30.0) << "the camera's";
  EXPECT_EQ(reread.cameras[1].camera.orthographic_height, 20.0);
  EXPECT_EQ(reread.camera.eye[0], 7.0);

  // The camera is referenced by name, with all its settings. It is written by name until it is moved.
  const SceneOptions front = read(R"(, "camera": "front")");
  EXPECT_TRUE(same(front.camera, scene.cameras[0].camera));
  EXPECT_EQ(front.camera.lens_radius, 0.25);
  ASSERT_TRUE(front.camera_open);
  EXPECT_EQ(front.camera_open->eye[0], 0.5);
  EXPECT_EQ(looked_through(front), front.cameras.data());
  EXPECT_NE(scene_text(front, "s.json").find(R"("camera": "front")"), std::string::npos);
  EXPECT_TRUE(same_scene(front, again(front)));
  EXPECT_EQ(parse_scene(scene_text(front, "s.json", SceneFormat::first), "s.json").camera.eye[2], 9.0)
      << "the first version has no names";
  SceneOptions moved = front;
  moved.camera.eye[0] = 1.5;
  EXPECT_EQ(again(moved).camera.eye[0], 1.5);
  EXPECT_EQ(again(moved).cameras[0].camera.eye[0], 1.0);
  SceneOptions still = front;
  end_shutter(still);
  EXPECT_EQ(looked_through(still), nullptr);

  // Names affect the scene comparison, but not the image hash.
  SceneOptions renamed = scene;
  renamed.cameras[2].name = "anywhere";
  EXPECT_FALSE(same_scene(scene, renamed));
  EXPECT_EQ(scene_hash(scene), scene_hash(renamed));
  SceneOptions named = scene;
  look_through(named, "front");
  EXPECT_NE(scene_hash(scene), scene_hash(named));
  SceneOptions alone = named;
  alone.cameras.clear();
  EXPECT_EQ(scene_hash(named), scene_hash(alone));
}

TEST(SceneFile, CameraNamesAreUnique) {
  const std::string two = R"("cameras": [{"name": "a"}, {"name": "b"}], )";
  EXPECT_EQ(section_error(two + R"("camera": "c")"), R"(dir/s.json: camera: no camera "c"; the scene has "a", "b")");
  EXPECT_EQ(section_error(R"("camera": "c")"), R"(dir/s.json: camera: no camera "c"; the scene has none)");
  EXPECT_EQ(section_error(R"("cameras": [{"name": "a"}, {"name": "b"}, {"name": "a"}])"),
            R"(dir/s.json: cameras[2].name: "a" is also the name of another camera)");
  EXPECT_EQ(section_error(R"("cameras": [{}])"), "dir/s.json: cameras[0].name: is missing");
  EXPECT_EQ(section_error(R"("cameras": [{"name": ""}])"), "dir/s.json: cameras[0].name: is empty");
  EXPECT_EQ(section_error(R"("cameras": [{"name": 1}])"), "dir/s.json: cameras[0].name: is not a string");
  EXPECT_EQ(section_error(R"("cameras": ["a"])"), "dir/s.json: cameras[0] is not an object");
  EXPECT_EQ(section_error(R"("cameras": {})"), "dir/s.json: cameras: is not a list");
  EXPECT_EQ(section_error(R"("camera": 1)"), "dir/s.json: camera is not an object");
  EXPECT_EQ(section_error(R"("cameras": [{"name": "a", "eye": [0, 0, 1]}])"),
            "dir/s.json: cameras[0].target: is missing");
  EXPECT_EQ(section_error(R"("cameras": [{"name": "a", "fovy": 1}])"),
            "dir/s.json: cameras[0].fovy: there is no such setting");
  EXPECT_EQ(section_error(R"("cameras": [{"name": "a", "open": {"fovy_degrees": 3}}])"),
            "dir/s.json: cameras[0].open: needs a camera with eye and target");
  EXPECT_EQ(error_of(with(R"("cameras": [{"name": "a"}])")), "dir/s.json: cameras: there is no such setting");
  EXPECT_EQ(error_of(with(R"("camera": "a")")), "dir/s.json: camera is not an object");
}

TEST(SceneFile, VariantsAreFoundByNameThenByNumber) {
  SceneOptions scene;
  scene.surfaces = "shoe.glb";
  const auto number = [&](const std::string& wanted, const std::vector<std::string>& names) {
    scene.surface_variant = wanted;
    return variant_number(scene.surfaces, scene.surface_variant, names);
  };
  const std::vector<std::string> names = {"beach", "1", "street"};
  EXPECT_EQ(number("", names), 0U);
  EXPECT_EQ(number("street", names), 3U);
  EXPECT_EQ(number("1", names), 2U);
  EXPECT_EQ(number("0", names), 1U);
  EXPECT_EQ(number("2", names), 3U);
  const auto refusal = [&](const std::string& wanted, const std::vector<std::string>& of) -> std::string {
    try {
      number(wanted, of);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal("Beach", names), R"(shoe.glb: no material variant "Beach"; the file has "beach", "1", "street")");
  for (const char* wanted : {"3", "-1", "0x", "4294967296"}) EXPECT_NE(refusal(wanted, names), "") << wanted;
  EXPECT_EQ(refusal("0", {}), R"(shoe.glb: no material variant "0"; the file has none)");
}

TEST(SceneFile, SequenceRoundTrips) {
  const auto text = [](const std::string& sequence) {
    return R"({"cumulet_scene": 2, "volumes": [{"file": "fire.####.vdb"}], "sequence": )" + sequence + "}";
  };
  const SceneOptions scene =
      parse_scene(text(R"({"frames_per_second": 12.5, "offset_seconds": -1, "repeat": "ping-pong", "first_frame": 3,
                           "last_frame": 40, "frame": 7})"),
                  "/folder/scene.json");
  EXPECT_EQ(scene.volume, "/folder/fire.####.vdb");
  EXPECT_EQ(scene.sequence.playback.frames_per_second, 12.5);
  EXPECT_EQ(scene.sequence.playback.offset_seconds, -1.0);
  EXPECT_EQ(scene.sequence.playback.repeat, CUMULET_REPEAT_PING_PONG);
  EXPECT_EQ(scene.sequence.first, 3);
  EXPECT_EQ(scene.sequence.last, 40);
  EXPECT_EQ(scene.sequence.frame, 7);
  const SceneOptions again = parse_scene(scene_text(scene, "/folder/scene.json"), "/folder/scene.json");
  EXPECT_TRUE(same_scene(scene, again));
  EXPECT_EQ(again.sequence.frame, 7);
  // The current frame does not count as a change of the scene, the playback settings do.
  SceneOptions other = scene;
  other.sequence.frame = 8;
  EXPECT_TRUE(same_scene(scene, other));
  other.sequence.last = 8;
  EXPECT_FALSE(same_scene(scene, other));
  // Defaults are not written.
  EXPECT_EQ(scene_text(SceneOptions(), "scene.json").find("sequence"), std::string::npos);
  const auto refused = [&](const std::string& sequence) {
    try {
      static_cast<void>(parse_scene(text(sequence), "scene.json"));
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string("is taken");
  };
  EXPECT_EQ(refused(R"({"repeat": "bounce"})").rfind("scene.json: sequence.repeat: ", 0), 0U);
  EXPECT_EQ(refused(R"({"frames_per_second": 0})").rfind("scene.json: sequence.frames_per_second: ", 0), 0U);
  EXPECT_EQ(refused(R"({"frame": -1e8})").rfind("scene.json: sequence.frame: ", 0), 0U);
  EXPECT_EQ(refused(R"({"first_frame": 9, "last_frame": 8})"),
            "scene.json: sequence.last_frame: is less than sequence.first_frame");
  EXPECT_EQ(refused(R"({"speed": 2})"), "scene.json: sequence.speed: there is no such setting");
}

TEST(SceneFile, SequenceMayHaveNegativeFrames) {
  const SceneOptions scene = parse_scene(R"({"cumulet_scene": 2, "volumes": [{"file": "fire.####.vdb"}],
                                            "sequence": {"first_frame": -20, "last_frame": -3, "frame": -7.25}})",
                                         "/folder/scene.json");
  EXPECT_EQ(scene.sequence.first, -20);
  EXPECT_EQ(scene.sequence.last, -3);
  EXPECT_EQ(scene.sequence.frame, Moment(-8, 750));
  const SceneOptions again = parse_scene(scene_text(scene, "/folder/scene.json"), "/folder/scene.json");
  EXPECT_EQ(again.sequence, scene.sequence);
}

TEST(SceneFile, EachVolumeMayBeASequence) {
  const auto read = [](const std::string& sequence) {
    return parse_scene(R"({"cumulet_scene": 2, "volumes": [{"file": "a.vdb"}, {"file": "fire.####.vdb", "sequence": )" +
                           sequence + "}]}",
                       "/folder/scene.json");
  };
  const SceneOptions scene = read(R"({"frames_per_second": 12, "between": "advect", "subframes": 8, "frame": 3.5})");
  ASSERT_EQ(scene.others.size(), 1U);
  const SceneSequence& sequence = scene.others[0].sequence;
  EXPECT_EQ(sequence.playback.frames_per_second, 12.0);
  EXPECT_EQ(sequence.playback.interpolation, CUMULET_FRAME_INTERPOLATION_ADVECT);
  EXPECT_EQ(sequence.playback.subframes, 8U);
  EXPECT_EQ(sequence.frame, Moment(3, 500));
  EXPECT_EQ(scene.sequence, SceneSequence());
  const SceneOptions again = parse_scene(scene_text(scene, "/folder/scene.json"), "/folder/scene.json");
  EXPECT_TRUE(same_scene(scene, again));
  EXPECT_EQ(again.others[0].sequence, sequence);
  try {
    static_cast<void>(read(R"({"repeat": "bounce"})"));
    FAIL() << "it was taken";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()).rfind("/folder/scene.json: volumes[1].sequence.repeat: ", 0), 0U)
        << error.what();
  }
}

TEST(SceneFile, ModelsRoundTrip) {
  SceneOptions scene;
  scene.surfaces = "/data/town.glb";
  scene.surface.lighting = CUMULET_SURFACE_LIGHTING_DIRECT;
  scene.models.push_back({"/data/tree.glb"});
  SceneModel& fox = scene.models.emplace_back();
  fox.file = "/elsewhere/fox.glb";
  fox.name = "a fox";
  fox.to_world = {2, 0, 0, 0, 0, -2, 0, 0, 0, 0.5, 2, 0, 1, 2, 3, 1};
  fox.visible = false;
  fox.shadow_only = true;
  fox.time = 1.25;
  fox.animation = 2;
  fox.variant = "red";
  fox.double_sided = true;
  const std::string path = "/data/scene.json";
  const SceneOptions read = parse_scene(scene_text(scene, path), path);
  EXPECT_EQ(read.surfaces, scene.surfaces);
  EXPECT_EQ(read.models, scene.models);
  EXPECT_TRUE(same_scene(read, scene));
  // Version 1 files contain no models, and can still be read.
  const SceneOptions first = parse_scene(scene_text(scene, path, SceneFormat::first), path);
  EXPECT_EQ(first.surfaces, scene.surfaces);
  EXPECT_TRUE(first.models.empty());
  // Each setting affects scene and image hash. The name affects only the scene.
  for (const auto& change : std::vector<std::function<void(SceneModel&)>>{
           [](SceneModel& m) { m.file = "/data/other.glb"; }, [](SceneModel& m) { m.to_world[12] = 9; },
           [](SceneModel& m) { m.visible = true; }, [](SceneModel& m) { m.shadow_only = false; },
           [](SceneModel& m) { m.time = 0; }, [](SceneModel& m) { m.variant = "blue"; }}) {
    SceneOptions other = scene;
    change(other.models[1]);
    EXPECT_FALSE(same_scene(scene, other));
    EXPECT_NE(scene_hash(scene), scene_hash(other));
  }
  SceneOptions renamed = scene;
  renamed.models[1].name = "another fox";
  EXPECT_FALSE(same_scene(scene, renamed));
  EXPECT_EQ(scene_hash(scene), scene_hash(renamed));
  // Without surfaces, the first model is the first surface entry of the file, with the surface lighting.
  scene.surfaces.clear();
  const SceneOptions alone = parse_scene(scene_text(scene, path), path);
  EXPECT_TRUE(alone.surfaces.empty());
  EXPECT_EQ(alone.models, scene.models);
  EXPECT_EQ(alone.surface.lighting, CUMULET_SURFACE_LIGHTING_DIRECT);
}

TEST(SceneFile, AnimationTimeAppliesToAllModels) {
  SceneOptions scene;
  scene.models.resize(2);
  set_animation_time(scene, 1.5);
  EXPECT_EQ(scene.models[0].time, 1.5);
  EXPECT_EQ(scene.models[1].time, 1.5);
  EXPECT_EQ(scene.surface.time, 0.0) << "without surfaces, a scene file could not be read with it";
  scene.surfaces = "/data/town.glb";
  set_animation_time(scene, 2.5);
  EXPECT_EQ(scene.surface.time, 2.5);
  set_animation_time(scene, -1.0);
  EXPECT_EQ(scene.surface.time, 0.0);
  EXPECT_EQ(scene.models[1].time, 0.0);
}

TEST(SceneFile, ModelTransformIsTranslationRotationScale) {
  const SceneOptions scene = parse_scene(
      R"({"cumulet_scene": 2, "models": [{"file": "a.glb", "translate": [1, 2, 3], "rotate_degrees": [0, 90, 0],
          "scale": [2, 2, 2]}, {"file": "b.glb", "translate": [4, 0, 0]}]})",
      "/data/scene.json");
  EXPECT_EQ(scene.surfaces, "");
  ASSERT_EQ(scene.models.size(), 2U);
  EXPECT_EQ(scene.models[0].file, "/data/a.glb");
  constexpr std::array<double, 16> turned{0, 0, -2, 0, 0, 2, 0, 0, 2, 0, 0, 0, 1, 2, 3, 1};
  for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(scene.models[0].to_world.at(i), turned.at(i), 1e-12) << i;
  EXPECT_EQ(scene.models[1].to_world[12], 4.0);
}

}  // namespace
