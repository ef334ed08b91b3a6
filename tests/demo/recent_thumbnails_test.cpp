// Thumbnails of recent files, made by a program in place of cumulet-render.

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "recent_thumbnails.hpp"
#include "support/folder.hpp"

namespace {

using namespace cumulet::demo;
namespace fs = std::filesystem;

class RecentThumbnailsTest : public testing::Test {
 protected:
  /// Writes a file and returns its path.
  std::string file(const std::string& name, const std::string& content = "x") {
    std::ofstream(folder_ / name) << content;
    return (folder_ / name).string();
  }
  /// Returns the path of a shell script. Its arguments are: --thumbnail 256 -o PICTURE [--scene] FILE.
  std::string script(const std::string& commands) {
    const std::string path = file("cumulet-render", "#!/bin/sh\necho \"$@\" >>\"$0.calls\"\n" + commands + '\n');
    fs::permissions(path, fs::perms::owner_all);
    return path;
  }
  void finish(RecentThumbnails& thumbnails, const std::vector<std::string>& files) {
    do {
      thumbnails.follow(files, now_ += 10.0);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    } while (thumbnails.works());
  }
  [[nodiscard]] int calls() const {
    std::ifstream stream(folder_ / "cumulet-render.calls");
    int lines = 0;
    for (std::string line; std::getline(stream, line);) ++lines;
    return lines;
  }

  cumulet::test::Folder folder_;
  double now_ = 0.0;  // seconds
  std::string cache_ = (folder_ / "cache/thumbnails").string();
};

TEST_F(RecentThumbnailsTest, AreMadeOnceForVolumesModelsAndScenes) {
  const std::string program = script("echo \"$@\" >\"$4\"");
  const std::vector<std::string> files = {file("a.vdb"), file("b.glb"), file("c.json"), file("d.hdr"),
                                          (folder_ / "gone.vdb").string()};
  for (int i = 0; i < 2; ++i) {
    RecentThumbnails thumbnails(program, cache_);
    EXPECT_EQ(thumbnails.find(files[0]).empty(), i == 0);
    finish(thumbnails, files);
    for (int j = 0; j < 3; ++j) EXPECT_TRUE(fs::exists(thumbnails.find(files[j]))) << files[j];
    EXPECT_EQ(thumbnails.find(files[3]), "") << "environments have none";
    EXPECT_EQ(thumbnails.find(files[4]), "");
    std::string line;
    std::getline(std::ifstream(thumbnails.find(files[2])), line);
    EXPECT_TRUE(line.ends_with("--scene " + files[2])) << line;
  }
  EXPECT_EQ(calls(), 3);
}

TEST_F(RecentThumbnailsTest, AChangedFileHasANewOne) {
  RecentThumbnails thumbnails(script("cat \"$5\" >\"$4\""), cache_);
  const std::vector<std::string> files = {file("a.vdb", "first")};
  finish(thumbnails, files);
  const std::string first = thumbnails.find(files[0]);
  file("a.vdb", "second");
  EXPECT_EQ(thumbnails.find(files[0]), "");
  finish(thumbnails, files);
  EXPECT_NE(thumbnails.find(files[0]), first);
}

TEST_F(RecentThumbnailsTest, ASceneHasANewOneWhenAFileThatItUsesChanges) {
  RecentThumbnails thumbnails(script("echo >\"$4\""), cache_);
  for (const char* used : {"a.vdb", "b.vdb", "c.glb", "d.hdr", "frame_1.vdb", "frame_2.vdb"}) file(used);
  const std::vector<std::string> files = {file("scene.json", R"({"cumulet_scene": 3,
    "volumes": [{"file": "a.vdb"}, {"file": "b.vdb"}, {"file": "frame_#.vdb"}], "models": [{"file": "c.glb"}],
    "environment": {"file": "d.hdr"}})")};
  finish(thumbnails, files);
  std::string before = thumbnails.find(files[0]);
  EXPECT_NE(before, "");
  for (const char* used : {"a.vdb", "b.vdb", "c.glb", "d.hdr", "frame_2.vdb"}) {
    file(used, "changed");
    EXPECT_EQ(thumbnails.find(files[0]), "") << used;
    finish(thumbnails, files);
    const std::string now = thumbnails.find(files[0]);
    EXPECT_NE(now, "");
    EXPECT_NE(now, before);
    before = now;
  }
  fs::remove(folder_ / "b.vdb");
  EXPECT_EQ(thumbnails.find(files[0]), "") << "it is gone";
  file("scene.json", "damaged");
  finish(thumbnails, files);
  EXPECT_NE(thumbnails.find(files[0]), "");
}

TEST_F(RecentThumbnailsTest, OldOnesOfOtherFilesAreRemoved) {
  const std::vector<std::string> files = {file("a.vdb"), file("b.vdb")};
  const std::string program = script("echo >\"$4\"");
  RecentThumbnails first(program, cache_);
  finish(first, files);
  const auto longer_ago = [](const std::string& path, int days) {
    fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::hours(24 * days));
  };
  longer_ago(first.find(files[0]), 1000);
  const std::string kept = file("cache/thumbnails/notes.png");
  longer_ago(kept, 2000);
  for (int i = 0; i < 80; ++i) {
    std::string name = "cache/thumbnails/0123456789abcd00.png";
    name.replace(name.size() - 6, 2, std::to_string(10 + i));
    longer_ago(file(name), 1 + i);
  }
  RecentThumbnails second(program, cache_);
  finish(second, files);
  EXPECT_NE(second.find(files[0]), "") << "it is listed";
  EXPECT_TRUE(fs::exists(kept)) << "not a thumbnail";
  EXPECT_TRUE(fs::exists(folder_ / "cache/thumbnails/0123456789abcd10.png")) << "the newest one";
  EXPECT_FALSE(fs::exists(folder_ / "cache/thumbnails/0123456789abcd89.png")) << "the oldest one";
  EXPECT_EQ(std::distance(fs::directory_iterator(cache_), {}), 2 + 64 + 1);
}

TEST_F(RecentThumbnailsTest, AFailureIsNotRepeatedForTheSameContent) {
  RecentThumbnails thumbnails(script("echo part >\"$4\"; exit 1"), cache_);
  const std::vector<std::string> files = {file("damaged.vdb"), file("other.vdb")};
  for (int i = 0; i < 3; ++i) finish(thumbnails, files);
  EXPECT_EQ(calls(), 2);
  EXPECT_EQ(thumbnails.find(files[0]), "");
  file("damaged.vdb", "mended");
  finish(thumbnails, files);
  EXPECT_EQ(calls(), 3);
}

TEST_F(RecentThumbnailsTest, StoppingEndsTheProgramAndLeavesNothing) {
  RecentThumbnails thumbnails(script("echo part >\"$4\"; exec sleep 60"), cache_);
  const std::vector<std::string> files = {file("a.vdb")};
  thumbnails.follow(files, 0.0);
  while (fs::is_empty(cache_)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(thumbnails.works());
  thumbnails.stop();
  EXPECT_FALSE(thumbnails.works());
  EXPECT_TRUE(fs::is_empty(cache_));
}

TEST_F(RecentThumbnailsTest, FilesAreLookedAtOncePerSecond) {
  RecentThumbnails thumbnails(script("cat \"$5\" >\"$4\""), cache_);
  const std::vector<std::string> files = {file("a.vdb")};
  finish(thumbnails, files);
  const double later = now_ + 10.0;
  EXPECT_TRUE(thumbnails.follow(files, later));
  fs::remove(thumbnails.find(files[0]));
  EXPECT_FALSE(thumbnails.follow(files, later + 0.5)) << "nothing is read in most frames";
  EXPECT_FALSE(thumbnails.works());
  EXPECT_TRUE(thumbnails.follow(std::vector<std::string>(), later + 0.6)) << "another list";
  EXPECT_TRUE(thumbnails.follow(files, later + 2.0));
  EXPECT_TRUE(thumbnails.works());
}

TEST_F(RecentThumbnailsTest, UnfinishedOnesOfEndedProgramsAreRemoved) {
  fs::create_directories(cache_);
  const std::string left = file("cache/thumbnails/0123456789abcdef.png.999999999.part");
  const std::string other = file("cache/thumbnails/0123456789abcdef.png." + std::to_string(::getpid()) + ".part");
  const std::string done = file("cache/thumbnails/0123456789abcdef.png");
  RecentThumbnails thumbnails(script("exit 1"), cache_);
  thumbnails.follow(std::vector<std::string>(), 0.0);
  EXPECT_FALSE(fs::exists(left));
  EXPECT_TRUE(fs::exists(other)) << "its program runs";
  EXPECT_TRUE(fs::exists(done));
}

TEST_F(RecentThumbnailsTest, WithoutProgramOrFolderThereAreNone) {
  const std::vector<std::string> files = {file("a.vdb")};
  RecentThumbnails no_program("", cache_);
  RecentThumbnails no_folder(script("exit 0"), "");
  for (RecentThumbnails* thumbnails : {&no_program, &no_folder}) {
    finish(*thumbnails, files);
    EXPECT_EQ(thumbnails->find(files[0]), "");
  }
  EXPECT_EQ(calls(), 0);
}

}  // namespace
