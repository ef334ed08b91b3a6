// Unsaved changes of cumulet-demo and their recovery file.

#include <gtest/gtest.h>

#include <file.hpp>
#include <filesystem>
#include <fstream>
#include <string>

#include "preferences.hpp"
#include "recovery_file.hpp"
#include "support/folder.hpp"
#include "unsaved_changes.hpp"

namespace {

using namespace cumulet::demo;

SceneOptions bright() {
  SceneOptions scene;
  scene.display.exposure_stops = 1.0f;
  return scene;
}

TEST(RecoveryFileTest, RemainsAfterACrashUntilItIsTakenOver) {
  const cumulet::test::Folder folder;
  const std::string state = (folder / "state" / "cumulet").string();
  {
    RecoveryFile killed(state);
    EXPECT_FALSE(killed.left());
    killed.write(bright(), "/a/scene.json");
  }
  {
    RecoveryFile later(state);
    ASSERT_TRUE(later.left());
    EXPECT_EQ(later.left()->scene_path, "/a/scene.json");
    later.remove();
    later.write(SceneOptions(), "");  // into another file
    later.remove();
  }
  RecoveryFile recovered(state);
  ASSERT_TRUE(recovered.left());
  const std::string copy = recovered.left()->path;
  EXPECT_TRUE(same_scene(load_scene(copy), bright()));
  recovered.take_over();
  EXPECT_FALSE(recovered.left());
  EXPECT_TRUE(std::filesystem::exists(copy));
  recovered.remove();
  EXPECT_FALSE(std::filesystem::exists(copy));
}

TEST(RecoveryFileTest, EachRunningProgramHasItsOwn) {
  const cumulet::test::Folder folder;
  RecoveryFile first(folder.path().string());
  RecoveryFile second(folder.path().string());
  first.write(bright(), "/a/first.json");
  second.write(SceneOptions(), "/a/second.json");
  EXPECT_FALSE(RecoveryFile(folder.path().string()).left()) << "their programs are running";
  second.remove();
  EXPECT_FALSE(RecoveryFile(folder.path().string()).left());
}

TEST(RecoveryFileTest, NoFolderIsNoError) {
  for (const char* folder : {"", "/proc/nowhere"}) {
    RecoveryFile none(folder);
    EXPECT_FALSE(none.left());
    EXPECT_NO_THROW(none.write(bright(), ""));
    EXPECT_NO_THROW(none.remove());
  }
}

TEST(UnsavedChangesTest, AreThoseOfTheSceneAndNotOfTheView) {
  SceneOptions scene;
  scene.camera.eye[2] = 5.0;
  UnsavedChanges changes("", 60.0, scene);
  scene.camera.eye[0] = 3.0;
  changes.follow(scene, 2.0);
  EXPECT_FALSE(changes.any());
  scene.camera.fovy_degrees = 20.0;
  changes.follow(scene, 3.0);
  EXPECT_TRUE(changes.any());
  EXPECT_EQ(changes.due(), 63.0);
  scene.camera.fovy_degrees = 0.0;
  changes.follow(scene, 4.0);
  EXPECT_FALSE(changes.any()) << "an undone change is none";
  changes.reset(bright());
  changes.follow(scene, 5.0);
  EXPECT_TRUE(changes.any());
}

TEST(UnsavedChangesTest, AreTheUsersAlone) {
  SceneOptions scene;
  UnsavedChanges changes("", 60.0, scene);
  SceneOptions loaded = scene;
  loaded.volume = "/a/cloud.vdb";
  loaded.medium.density_scale = 2.0;
  changes.take_program_change(scene, loaded);
  changes.follow(loaded, 1.0);
  EXPECT_FALSE(changes.any()) << "loading a file changes the scene";
  SceneOptions brighter = loaded;
  brighter.display.exposure_stops = 0.5f;
  changes.follow(brighter, 2.0);
  EXPECT_TRUE(changes.any());
}

TEST(UnsavedChangesTest, OfTheUserRemainWhenALoadEndsLater) {
  SceneOptions edited;
  UnsavedChanges changes("", 60.0, edited);
  edited.display.exposure_stops = 0.5f;
  SceneOptions loaded = edited;
  loaded.medium.density_scale = 2.0;
  changes.take_program_change(edited, loaded);
  changes.follow(loaded, 1.0);
  EXPECT_TRUE(changes.any());
}

TEST(UnsavedChangesTest, AreCopiedWhenDue) {
  const cumulet::test::Folder folder;
  const auto copy = folder / "recovery-1.json";
  UnsavedChanges changes(folder.path().string(), 60.0, SceneOptions());
  changes.follow(SceneOptions(), 0.0);
  changes.follow(bright(), 10.0);
  changes.autosave(bright(), "", 69.0);
  EXPECT_FALSE(std::filesystem::exists(copy));
  changes.autosave(bright(), "", 70.0);
  EXPECT_TRUE(std::filesystem::exists(copy));
  EXPECT_EQ(changes.due(), 130.0);
  std::ofstream(copy) << "old";
  changes.autosave(bright(), "", 130.0);
  EXPECT_EQ(cumulet::image::read_file(copy.string()), "old") << "the same scene is not written again";
  changes.follow(SceneOptions(), 131.0);
  EXPECT_FALSE(std::filesystem::exists(copy)) << "without changes there is no copy";
}

TEST(Preferences, ScenesDoNotDisplaceOtherFiles) {
  Preferences preferences;
  for (int i = 0; i < 12; ++i) preferences.remember("/a/" + std::to_string(i) + ".json");
  for (int i = 0; i < 15; ++i) preferences.remember("/a/" + std::to_string(i) + ".vdb");
  ASSERT_EQ(preferences.recent.size(), 20u);
  EXPECT_EQ(preferences.recent[0], "/a/14.vdb");
  EXPECT_EQ(preferences.recent[10], "/a/11.json");
}

}  // namespace
