// Volumes and environments of the C++ API from bytes in memory and from streams of the host.

#include <ImfRgbaFile.h>
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cumulet/cumulet.hpp>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include "support/file_bytes.hpp"
#include "support/folder.hpp"
#include "support/openvdb.hpp"
#include "support/radiance.hpp"

namespace {

using namespace cumulet;

TEST(CppContent, VolumesComeFromBytesAndStreams) {
  openvdb::initialize();
  const test::Folder folder;
  openvdb::GridPtrVec grids;
  for (const char* name : {"density", "other"}) {
    auto grid = openvdb::FloatGrid::create(0.0F);
    grid->setName(name);
    for (int i = 0; i < 900; ++i)
      grid->tree().setValue(openvdb::Coord(i % 31, i % 17, i % 13), 1.0F + 0.5F * static_cast<float>(i));
    grids.push_back(grid);
  }
  const std::string file = (folder / "cloud.vdb").string();
  openvdb::io::File(file).write(grids);
  const std::string content = test::bytes_of(file);
  const auto bytes = std::as_bytes(std::span(content));
  const Volume memory = Volume::from_memory(bytes, {.grid_name = "other"}).value();
  EXPECT_STREQ(memory.info()->name.c_str(), "other");
  const auto read = [&](std::uint64_t position, std::span<std::byte> to) -> std::size_t {
    std::ranges::copy(bytes.subspan(position, to.size()), to.begin());
    return to.size();
  };
  const Volume stream = Volume::from_stream(bytes.size(), read).value();
  EXPECT_EQ(stream.info()->active_voxels, memory.info()->active_voxels);
  EXPECT_STREQ(Volume::from_memory(bytes.first(10), {.path = "mine"}).error().message.c_str(),
               "mine: the file is truncated or damaged: unexpected end of file");
  EXPECT_STREQ(Environment::from_stream(bytes.size(), read, "mine").error().message.c_str(),
               "mine: neither a Radiance (.hdr) nor an OpenEXR file");
}

std::string open_exr_file(const test::Folder& folder) {
  const std::string file = (folder / "sky.exr").string();
  const std::vector<Imf::Rgba> pixels(8, Imf::Rgba(1.0F, 2.0F, 3.0F));
  Imf::RgbaOutputFile out(file.c_str(), 4, 2, Imf::WRITE_RGB);
  out.setFrameBuffer(pixels.data(), 1, 4);
  out.writePixels(2);
  return file;
}

TEST(CppContent, EnvironmentsComeFromBytesAndStreams) {
  const test::Folder folder;
  const std::string hdr = (folder / "sky.hdr").string();
  std::ofstream(hdr, std::ios::binary) << test::radiance_file(8, 4);
  for (const std::string& file : {hdr, open_exr_file(folder)}) {
    const std::string content = test::bytes_of(file);
    const auto bytes = std::as_bytes(std::span(content));
    const EnvironmentInfo whole = Environment::open(file)->info().value();
    const EnvironmentInfo memory = Environment::from_memory(bytes, "pak:sky")->info().value();
    std::uint64_t fails_from = bytes.size() + 1;
    const auto read = [&](std::uint64_t position, std::span<std::byte> to) -> std::size_t {
      if (position + to.size() >= fails_from) return 3;
      std::ranges::copy(bytes.subspan(position, to.size()), to.begin());
      return to.size();
    };
    const EnvironmentInfo stream = Environment::from_stream(bytes.size(), read)->info().value();
    EXPECT_EQ(memory.width, whole.width);
    EXPECT_EQ(memory.mean_radiance, whole.mean_radiance);
    EXPECT_EQ(stream.mean_radiance, whole.mean_radiance);
    EXPECT_STREQ(memory.name.c_str(), "pak:sky");
    EXPECT_STREQ(stream.name.c_str(), "stream");
    const auto cut = Environment::from_memory(bytes.first(bytes.size() - 5), "pak:sky");
    EXPECT_EQ(cut.error().status, StatusCode::file);
    EXPECT_EQ(std::string(cut.error().message.c_str()).rfind("pak:sky: ", 0), 0U) << cut.error().message.c_str();
    fails_from = 4;
    const auto failed = Environment::from_stream(bytes.size(), read, "pak:sky");
    EXPECT_EQ(std::string(failed.error().message.c_str()),
              "pak:sky: the host's stream returned 3 of " + std::to_string(bytes.size()) + " bytes at position 0");
  }
  EXPECT_STREQ(Environment::from_memory({}).error().message.c_str(), "memory: truncated Radiance file");
}

}  // namespace
