// Files that are dropped on the window of cumulet-demo together.

#include "dropped_files.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "support/folder.hpp"

namespace {

using cumulet::demo::Action;
using cumulet::demo::DroppedFiles;
using cumulet::demo::open_dropped;
using Commands = std::vector<std::pair<Action, std::string>>;

Commands commands_of(const DroppedFiles& dropped) {
  Commands commands;
  for (const auto& command : dropped.commands) commands.emplace_back(command.action, command.text);
  return commands;
}

TEST(DroppedFilesTest, FirstOfEachKindIsOpenedAndTheOthersAreAdded) {
  const DroppedFiles dropped = open_dropped({"/b.glb", "/a.vdb", "/sky.hdr", "/c.NVDB", "/d.gltf", "/sky.exr"});
  EXPECT_EQ(commands_of(dropped), (Commands{{Action::open, "/sky.hdr"},
                                            {Action::open, "/a.vdb"},
                                            {Action::add_volume, "/c.NVDB"},
                                            {Action::open, "/b.glb"},
                                            {Action::add_model, "/d.gltf"}}));
  EXPECT_EQ(dropped.left_out, std::vector<std::string>{"/sky.exr"});
}

TEST(DroppedFilesTest, FilesAreAddedToADroppedScene) {
  const DroppedFiles dropped = open_dropped({"/a.vdb", "/one.json", "/b.glb", "/two.json"});
  EXPECT_EQ(commands_of(dropped),
            (Commands{{Action::open, "/one.json"}, {Action::add_volume, "/a.vdb"}, {Action::add_model, "/b.glb"}}));
  EXPECT_EQ(dropped.left_out, std::vector<std::string>{"/two.json"});
}

TEST(DroppedFilesTest, FramesOfASequenceAreOpenedAsTheSequence) {
  const cumulet::test::Folder folder;
  std::vector<std::string> frames;
  for (const char* name : {"fire_08.vdb", "fire_09.vdb", "fire_10.vdb"}) {
    frames.push_back((folder / name).string());
    std::ofstream(frames.back()) << "voxels";
  }
  const std::string sequence = (folder / "fire_##.vdb").string();
  EXPECT_EQ(commands_of(open_dropped({frames[2], frames[0]})), (Commands{{Action::open, sequence}}));
  EXPECT_TRUE(open_dropped({frames[2], frames[0]}).plays);
  EXPECT_FALSE(open_dropped({frames[1]}).plays);
  EXPECT_FALSE(open_dropped({"/one.json", frames[2], frames[0]}).plays) << "the scene says which frame is shown";
  // A single frame is a volume, and so is another file beside frames.
  EXPECT_EQ(commands_of(open_dropped({frames[1]})), (Commands{{Action::open, frames[1]}}));
  EXPECT_EQ(commands_of(open_dropped({frames[1], "/a.vdb"})),
            (Commands{{Action::open, frames[1]}, {Action::add_volume, "/a.vdb"}}));
}

}  // namespace
