// The state of a volume, which the sequence cache compares.

#include "settled.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include "support/folder.hpp"

namespace {

namespace fs = std::filesystem;
using cumulet::demo::volume_state;

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

}  // namespace
