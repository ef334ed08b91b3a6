// Checkpoints: a saved file is read back exactly, and other files are rejected.

#include "checkpoint.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "file.hpp"
#include "support/folder.hpp"

namespace {

using namespace cumulet::demo;

class CheckpointFile : public ::testing::Test {
 protected:
  CheckpointFile() {
    options_.scene.volume = "cloud.vdb";
    // Arbitrary bytes, including line breaks and end markers.
    for (int i = 0; i < 1000; ++i) checkpoint_.accumulation.push_back(static_cast<std::byte>(i * 7 % 256));
    checkpoint_.of = checkpoint_of(options_);
    checkpoint_.driver = "llvmpipe (LLVM 15.0.6, 256 bits)";
  }
  [[nodiscard]] std::string path() const { return folder_ / "cloud.ck"; }
  std::string refusal() {
    try {
      static_cast<void>(read_checkpoint(path(), checkpoint_of(options_)));
      return "";
    } catch (const std::runtime_error& error) {
      const std::string said = error.what();
      EXPECT_EQ(said.find('\n'), std::string::npos);
      EXPECT_EQ(said.rfind(path() + ": ", 0), 0u) << said;
      return said.substr(path().size() + 2);
    }
  }

  cumulet::test::Folder folder_;
  RenderOptions options_;
  Checkpoint checkpoint_;
};

TEST_F(CheckpointFile, RoundTrips) {
  EXPECT_FALSE(read_checkpoint(path(), checkpoint_.of)) << "none is no error";
  write_checkpoint(path(), checkpoint_);
  const auto read = read_checkpoint(path(), checkpoint_.of);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->of, checkpoint_.of);
  EXPECT_EQ(read->driver, checkpoint_.driver);
  EXPECT_EQ(read->accumulation, checkpoint_.accumulation);
}

TEST_F(CheckpointFile, IsRejectedForAnotherImage) {
  write_checkpoint(path(), checkpoint_);
  EXPECT_EQ(refusal(), "");
  const auto differs = [&](auto change) {
    const RenderOptions before = options_;
    change();
    const std::string said = refusal();
    options_ = before;
    return said;
  };
  const std::string other = "is the checkpoint of another image: the ";
  cumulet_sampling_desc& sampling = options_.scene.sampling;
  EXPECT_EQ(differs([&] { options_.scene.width = 7; }), other + "size differs");
  EXPECT_EQ(differs([&] { sampling.seed = 7; }), other + "seed differs");
  EXPECT_EQ(differs([&] { sampling.first_sample = 7; }), other + "first sample differs");
  EXPECT_EQ(differs([&] { sampling.samples = 7; }), other + "number of samples differs");
  EXPECT_EQ(differs([&] { sampling.noise_target_percent = 7.0f; }), other + "noise target differs");
  EXPECT_EQ(differs([&] { options_.aovs = {CUMULET_AOV_VOLUME}; }), other + "volume AOV differs");
  EXPECT_EQ(differs([&] { options_.scene.medium.anisotropy = 0.5f; }), other + "scene differs");
  EXPECT_EQ(differs([&] { options_.scene.volume = "other.vdb"; }), other + "scene differs");
  EXPECT_EQ(differs([&] { options_.output = "elsewhere.exr"; }), "");
}

TEST_F(CheckpointFile, TruncatedOrDamagedFileIsReported) {
  write_checkpoint(path(), checkpoint_);
  const std::string whole = cumulet::image::read_file(path());
  const std::string damaged = "is not a checkpoint of cumulet-render, or is damaged; delete it to start over";
  for (std::size_t size = 0; size < whole.size(); size += size < 400 ? 1 : 97) {
    std::ofstream(path(), std::ios::binary) << whole.substr(0, size);
    ASSERT_EQ(refusal(), damaged) << size;
  }
  for (std::size_t at = 0; at < whole.size(); at += 13) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 1);
    std::ofstream(path(), std::ios::binary) << changed;
    ASSERT_EQ(refusal(), damaged) << at;
  }
  std::ofstream(path(), std::ios::binary) << whole << 'x';
  EXPECT_EQ(refusal(), damaged);
  std::filesystem::remove(path());
  std::filesystem::create_directory(path());
  EXPECT_EQ(refusal(), "Is a directory");
}

}  // namespace
