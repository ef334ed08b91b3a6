// Volumes of the C API from bytes in memory and from streams of the host.

#define NANOVDB_USE_ZIP

#include <cumulet/cumulet.h>
#include <gtest/gtest.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/openvdb.h>

#include <array>
#include <fstream>
#include <string>
#include <vector>

#include "support/c_host.hpp"
#include "support/file_bytes.hpp"
#include "support/folder.hpp"
#include "support/openvdb.hpp"
#include "support/volumes.hpp"
#include "viewer/c_handles.hpp"

namespace {

using namespace cumulet;
using openvdb::Coord;
using test::bytes_of;
using test::make_desc;
using test::VolumeRef;

/// A pak file: the content lies between other bytes.
struct Pak {
  explicit Pak(const std::string& content) : bytes("before" + content + "after"), size(content.size()) {}

  [[nodiscard]] cumulet_stream_desc stream() {
    auto desc = make_desc<cumulet_stream_desc>();
    desc.size = size;
    desc.read = [](void* user, std::uint64_t position, void* to, std::uint64_t count) -> std::uint64_t {
      return static_cast<Pak*>(user)->read(position, to, count);
    };
    desc.read_user = this;
    return desc;
  }

  std::uint64_t read(std::uint64_t position, void* to, std::uint64_t count) {
    // The library is not called in callbacks.
    EXPECT_EQ(cumulet_volume_from_memory("x", 1, nullptr, &none, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_LE(position + count, size);
    if (position + count > fails_from) return 3;
    bytes.copy(static_cast<char*>(to), count, 6 + position);
    return count;
  }

  std::string bytes;
  std::uint64_t size;
  std::uint64_t fails_from = ~std::uint64_t{0};
  cumulet_volume* none = nullptr;
};

class HostVolume : public testing::Test {
 protected:
  void SetUp() override {
    openvdb::initialize();
    for (const char* name : {"density", "other"}) {
      auto grid = openvdb::FloatGrid::create(0.0F);
      grid->setName(name);
      for (int i = 0; i < 40000; ++i) grid->tree().setValue(Coord(i % 61, i / 61 % 47, i % 97), static_cast<float>(i));
      grids_.push_back(grid);
    }
    vdb_ = (folder_ / "cloud.vdb").string();
    openvdb::io::File(vdb_).write(grids_);
    nvdb_ = (folder_ / "cloud.nvdb").string();
    nanovdb::io::writeGrid(nvdb_, nanovdb::openToNanoVDB(*openvdb::gridPtrCast<openvdb::FloatGrid>(grids_[0])),
                           nanovdb::io::Codec::ZIP);
  }
  static VolumeRef open(const std::string& file, const char* grid = nullptr) {
    cumulet_volume* out = nullptr;
    EXPECT_EQ(cumulet_volume_open(file.c_str(), grid, &out, nullptr, 0), CUMULET_OK);
    return VolumeRef(out);
  }
  static cumulet_volume_file_desc named(const char* name, const char* grid = nullptr) {
    auto desc = make_desc<cumulet_volume_file_desc>();
    desc.path = name;
    desc.grid_name = grid;
    return desc;
  }

  struct Answer {
    cumulet_status status;
    std::string line;
    VolumeRef volume;
  };
  template <class Call>
  static Answer answer(Call&& call) {
    std::array<char, 512> line{};
    cumulet_volume* out = nullptr;
    const cumulet_status status = call(&out, line.data(), line.size());
    EXPECT_EQ(std::string(line.data()).find('\n'), std::string::npos);
    return {status, line.data(), VolumeRef(out)};
  }
  static Answer from_memory(const std::string& content, const cumulet_volume_file_desc* desc = nullptr) {
    return answer(
        [&](auto... out) { return cumulet_volume_from_memory(content.data(), content.size(), desc, out...); });
  }
  static Answer from_stream(Pak& pak, const cumulet_volume_file_desc* desc = nullptr) {
    const cumulet_stream_desc stream = pak.stream();
    return answer([&](auto... out) { return cumulet_volume_from_stream(&stream, desc, out...); });
  }

  test::Folder folder_;
  openvdb::GridPtrVec grids_;
  std::string vdb_;
  std::string nvdb_;
};

TEST_F(HostVolume, BytesAndStreamsEqualFiles) {
  for (const std::string& file : {vdb_, nvdb_}) {
    const VolumeRef whole = open(file);
    const std::string content = bytes_of(file);
    const Answer memory = from_memory(content);
    ASSERT_EQ(memory.status, CUMULET_OK) << memory.line;
    test::expect_identical(memory.volume->asset->volume(), whole->asset->volume());
    Pak pak(content);
    const Answer stream = from_stream(pak);
    ASSERT_EQ(stream.status, CUMULET_OK) << stream.line;
    test::expect_identical(stream.volume->asset->volume(), whole->asset->volume());
  }
}

TEST_F(HostVolume, DescriptorsChooseGridsAndTransform) {
  cumulet_volume_file_desc desc = named("pak:cloud", "other");
  for (int i = 0; i < 4; ++i) desc.to_world[5 * i] = i < 3 ? 2.0 : 1.0;
  Pak pak(bytes_of(vdb_));
  const Answer stream = from_stream(pak, &desc);
  ASSERT_EQ(stream.status, CUMULET_OK) << stream.line;
  EXPECT_EQ(stream.volume->asset->volume().name, "other");
  EXPECT_EQ(stream.volume->asset->volume().index_to_world[0][0], 2.0);
}

TEST_F(HostVolume, BadContentIsOneLineWithTheHostsName) {
  const cumulet_volume_file_desc desc = named("pak:cloud");
  const std::string content = bytes_of(vdb_);
  const auto expect = [](const Answer& answer, const std::string& line) {
    EXPECT_EQ(answer.status, CUMULET_ERROR_FILE);
    EXPECT_EQ(answer.volume, nullptr);
    EXPECT_EQ(answer.line, line);
  };
  expect(from_memory("", &desc), "pak:cloud: is empty");
  expect(from_memory("#?RADIANCE\n", &desc), "pak:cloud: is not a VDB, NanoVDB, NRRD, VTK or TIFF file");
  expect(from_memory("abc"), "memory: is too short to be a VDB, NanoVDB, NRRD, VTK or TIFF file");
  const Answer cut = from_memory(content.substr(0, content.size() / 2), &desc);
  EXPECT_EQ(cut.status, CUMULET_ERROR_FILE);
  EXPECT_EQ(cut.line.rfind("pak:cloud: ", 0), 0U) << cut.line;
  Pak empty("");
  expect(from_stream(empty), "stream: is empty");
  for (const std::string& file : {vdb_, nvdb_}) {
    Pak pak(bytes_of(file));
    pak.fails_from = pak.size / 2;
    const Answer failed = from_stream(pak, &desc);
    EXPECT_EQ(failed.status, CUMULET_ERROR_FILE);
    EXPECT_NE(failed.line.find("pak:cloud: "), std::string::npos) << failed.line;
    EXPECT_NE(failed.line.find("the host's stream returned 3 of "), std::string::npos) << failed.line;
  }
}

TEST_F(HostVolume, InvalidArgumentsAreRefused) {
  const auto expect = [](const Answer& answer, const std::string& line) {
    EXPECT_EQ(answer.status, CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(answer.line, line);
  };
  const cumulet_volume_file_desc desc = named("pak:cloud");
  expect(answer([&](auto... out) { return cumulet_volume_from_memory(nullptr, 9, &desc, out...); }),
         "pak:cloud: bytes are NULL");
  expect(answer([&](auto... out) { return cumulet_volume_from_stream(nullptr, &desc, out...); }),
         "cumulet_stream_desc is NULL");
  auto stream = make_desc<cumulet_stream_desc>();
  stream.size = 8;
  expect(answer([&](auto... out) { return cumulet_volume_from_stream(&stream, &desc, out...); }),
         "cumulet_stream_desc.read is NULL");
  stream = Pak("").stream();
  stream.size = ~std::uint64_t{0};
  expect(answer([&](auto... out) { return cumulet_volume_from_stream(&stream, &desc, out...); }),
         "cumulet_stream_desc.size is above 2^62");
  EXPECT_EQ(cumulet_volume_from_memory("x", 1, &desc, nullptr, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_environment_from_memory("x", 1, nullptr, nullptr, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
}

}  // namespace
