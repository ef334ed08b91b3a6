// The sample scenes of cumulet-demo, written by a program in place of cumulet-scene.

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <image.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "environment_view.hpp"
#include "samples.hpp"
#include "support/folder.hpp"

namespace {

using namespace cumulet::demo;

class SampleFilesTest : public ::testing::Test {
 protected:
  /// Returns the path of a shell script with these commands.
  std::string script(const std::string& commands) {
    const auto path = folder_ / "cumulet-scene";
    std::ofstream(path) << "#!/bin/sh\n" << commands << '\n';
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    return path.string();
  }
  static std::optional<std::string> wait(SampleFiles& files) {
    for (int i = 0; i < 1000; ++i) {
      if (auto scene = files.take()) return scene;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return std::nullopt;
  }

  cumulet::test::Folder folder_;
  std::string out_ = (folder_ / "samples").string();
  std::string all_ =
      "cd \"$1\" && touch sample.json cumulus.vdb mountains.glb sample_explosion.json explosion_0012.vdb";
};

TEST_F(SampleFilesTest, AreWrittenOnce) {
  const std::string program = script("mkdir \"$1\" && echo run >>\"$1/runs\" && " + all_);
  for (int i = 0; i < 2; ++i) {
    SampleFiles files(program, out_);
    EXPECT_FALSE(files.take());
    files.request("sample.json");
    EXPECT_EQ(files.writes(), i == 0);
    files.request("sample_explosion.json");  // replaces the other one
    EXPECT_EQ(wait(files), out_ + "/sample_explosion.json");
    EXPECT_FALSE(files.writes());
    EXPECT_FALSE(files.take());
  }
  EXPECT_EQ(std::filesystem::file_size(out_ + "/runs"), 4u);
}

TEST_F(SampleFilesTest, FailuresAreOneLine) {
  SampleFiles fails(script("exit 1"), out_);
  fails.request("sample.json");
  EXPECT_THROW(static_cast<void>(wait(fails)), std::runtime_error);
  EXPECT_FALSE(fails.take()) << "reported once";
  SampleFiles missing((folder_ / "missing").string(), out_);
  EXPECT_THROW(missing.request("sample.json"), std::runtime_error);
  EXPECT_FALSE(missing.take());
  SampleFiles none("", out_);
  EXPECT_FALSE(none.exist());
  EXPECT_THROW(none.request("sample.json"), std::runtime_error);
}

TEST_F(SampleFilesTest, ProgramEndsWithThem) {
  const std::string ended = (folder_ / "ended").string();
  {
    SampleFiles files(script("trap 'touch " + ended + "; exit' TERM; touch started; while :; do sleep 0.01; done"),
                      out_);
    files.request("sample.json");
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    EXPECT_FALSE(files.take());
  }
  EXPECT_TRUE(std::filesystem::exists(ended));
}

TEST(Samples, HavePictures) {
  for (const Sample& sample : samples()) {
    const auto pixels = cumulet::image::decode_png(sample.picture, sample.label);
    EXPECT_EQ(pixels.width, Thumbnail::width);
    EXPECT_EQ(pixels.height, Thumbnail::height);
    EXPECT_LT(sample.picture.size(), 60'000u);
  }
}

}  // namespace
