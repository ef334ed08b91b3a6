// The sequence cache, and the state of a volume, which it compares.

#include "settled.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <default_look.hpp>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "support/folder.hpp"

namespace {

namespace fs = std::filesystem;
using namespace cumulet::demo;

TEST(VolumeState, FolderHasThatOfItsSlices) {
  const cumulet::test::Folder folder;
  const fs::path slices = folder / "slices";
  fs::create_directory(slices);
  const auto write = [&](const std::string& name, const std::string& content) {
    std::ofstream(slices / name) << content;
  };
  write("a1.tif", "12");
  write("a2.TIFF", "345");
  const fs::file_time_type old = fs::file_time_type::clock::now() - std::chrono::hours(1);
  for (const char* name : {"a1.tif", "a2.TIFF"}) fs::last_write_time(slices / name, old);
  const std::string state = volume_state(slices.string());
  EXPECT_TRUE(state.starts_with("5 ")) << state;
  EXPECT_TRUE(state.ends_with(" slices")) << state;
  EXPECT_EQ(volume_state(slices.string() + "/"), state);
  write("notes.txt", "not a slice");
  EXPECT_EQ(volume_state(slices.string()), state);
  fs::last_write_time(slices / "a1.tif", old + std::chrono::seconds(2));
  const std::string changed = volume_state(slices.string());
  EXPECT_NE(changed, state);
  write("a3.tif", "6");
  fs::last_write_time(slices / "a3.tif", old);
  EXPECT_NE(volume_state(slices.string()), changed);
}

TEST(SequenceCache, KeepsTheLookOfAFireUnlessALookIsGiven) {
  const cumulet::test::Folder folder;
  const std::string volume = (folder / "fire.vdb").string();
  std::ofstream(volume) << "a volume";
  RenderOptions options;
  options.scene.volume = (folder / "fire.####.vdb").string();
  options.scene.set_daylight();
  options.sequence_cache = (folder / "cache").string();
  const std::vector<std::string> volumes = {volume};
  const SceneOptions given = options.scene;
  RenderOptions found = options;
  ASSERT_TRUE(take_dusk(found.scene));
  write_settled(found, given, volume_state(volume));

  RenderOptions again = options;
  ASSERT_TRUE(read_settled(again, volumes));
  EXPECT_EQ(again.scene.light.sun_elevation_degrees, found.scene.light.sun_elevation_degrees);
  EXPECT_EQ(again.scene.display.tone_map, CUMULET_TONE_MAP_FILMIC);
  EXPECT_EQ(again.scene.display.exposure_stops, dusk_exposure);
  // --tone-map neutral, the same scene
  RenderOptions chosen = options;
  chosen.default_look = false;
  EXPECT_FALSE(read_settled(chosen, volumes));
  EXPECT_TRUE(same_scene(chosen.scene, given));
}

}  // namespace
