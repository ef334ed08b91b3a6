// Truncated and damaged volume files are refused with one line, and never crash.

#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC

#include <gtest/gtest.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>

#include <cstring>
#include <random>

#include "base/error.hpp"
#include "support/file_bytes.hpp"
#include "support/volume_import.hpp"
#include "volume/inspection.hpp"

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/lsan_interface.h>
#endif

namespace {

using cumulet::test::bytes_of;
using cumulet::test::expect_contract;
using cumulet::test::rich;
using cumulet::test::VolumeImport;
using cumulet::volume::import_volume;
using openvdb::FloatGrid;

TEST_F(VolumeImport, EveryTruncationIsOneClearLine) {
  const auto grid = rich(0.125F);
  const auto vdb = bytes_of(write({grid}));
  const auto nano_file = path("test.nvdb");
  std::vector<std::pair<std::string, std::string>> files{{"vdb", vdb}};
  for (const auto codec : {nanovdb::io::Codec::NONE, nanovdb::io::Codec::ZIP, nanovdb::io::Codec::BLOSC}) {
    nanovdb::io::writeGrid(nano_file.string(), nanovdb::openToNanoVDB(*grid), codec);
    files.emplace_back("nvdb", bytes_of(nano_file));
  }
  for (const auto& [extension, bytes] : files) {
    const std::size_t step = bytes.size() / 40;
    for (std::size_t size = 8; size < bytes.size(); size += size < 400 ? 7 : step) {
      const std::string what = refusal(write_bytes(bytes.substr(0, size), "cut." + extension));
      EXPECT_TRUE(what.find("truncated") != std::string::npos || what.find("damaged") != std::string::npos) << what;
    }
    refusal(write_bytes(bytes.substr(0, bytes.size() - 1), "cut." + extension));
  }
}

TEST_F(VolumeImport, DamagedFilesNeverCrash) {
#if defined(__SANITIZE_ADDRESS__)
  __lsan_disable();  // OpenVDB leaks the node that it was reading when its stream throws
#endif
  const auto grid = rich(0.125F);
  const auto vdb_file = path("whole.vdb");
  openvdb::io::File out(vdb_file.string());
  out.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK);
  out.write({grid});
  const auto nano_file = path("whole.nvdb");
  std::vector<std::string> files{bytes_of(vdb_file)};
  for (const auto codec : {nanovdb::io::Codec::NONE, nanovdb::io::Codec::ZIP, nanovdb::io::Codec::BLOSC}) {
    nanovdb::io::writeGrid(nano_file.string(), nanovdb::openToNanoVDB(*grid), codec);
    files.push_back(bytes_of(nano_file));
  }
  nanovdb::io::writeGrid(nano_file.string(),
                         nanovdb::openToNanoVDB<nanovdb::HostBuffer, openvdb::FloatTree, nanovdb::FpN>(*grid));
  files.push_back(bytes_of(nano_file));
  std::mt19937 random(11);
  int refused = 0;
  for (const std::string& whole : files) {
    for (int i = 0; i < 60; ++i) {
      std::string bytes = whole;
      // Half of the damage is in the headers, where it has the largest effect.
      for (int n = 0; n < 4; ++n) {
        const std::size_t range = i % 2 == 0 ? std::min<std::size_t>(bytes.size(), 1200) : bytes.size();
        bytes[8 + random() % (range - 8)] = static_cast<char>(random());
      }
      try {
        expect_contract(import_volume(write_bytes(bytes, "damaged"), "", {}));
      } catch (const cumulet::Error& e) {
        EXPECT_EQ(std::string(e.what()).find_first_of("\n\r\t"), std::string::npos);
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 30);
#if defined(__SANITIZE_ADDRESS__)
  __lsan_enable();
#endif
}

// OpenVDB writes beyond its buffer if the length of packed values is negative.
TEST_F(VolumeImport, DamagedCompressedLengthsAreReported) {
  const auto grid = FloatGrid::create();
  for (int i = 0; i < 40; ++i)
    grid->tree().setValue(openvdb::Coord(i % 7, i / 7, i % 3), 0.01F * static_cast<float>(i));
  auto vectors = openvdb::Vec3SGrid::create();
  vectors->fill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(5)), openvdb::Vec3f(1, 2, 3));
  for (const std::uint32_t compression : {openvdb::io::COMPRESS_ZIP, openvdb::io::COMPRESS_BLOSC}) {
    openvdb::io::File out(path("packed.vdb").string());
    out.setCompression(compression);
    out.write({grid, vectors});
    const std::string whole = bytes_of(path("packed.vdb"));
    int found = 0;
    for (std::size_t at = 200; at + 8 < whole.size(); ++at) {
      std::int64_t length = 0;
      std::memcpy(&length, whole.data() + at, sizeof length);
      // Lengths are in front of bytes that look like the start of zlib or Blosc data.
      const char first = compression == openvdb::io::COMPRESS_ZIP ? '\x78' : '\x02';
      if (length < 17 || length > 200'000 || whole[at + 8] != first || found > 5) continue;
      for (const std::int64_t wrong : {std::int64_t{-300'000}, std::int64_t{1} << 50U, length + 1}) {
        std::string bytes = whole;
        std::memcpy(bytes.data() + at, &wrong, sizeof wrong);
        try {
          cumulet::volume::Inspection inspection(write_bytes(bytes, "damaged.vdb"));
          for (std::size_t i = 0; i < inspection.grids().size(); ++i) {
            if (inspection.statistics(i).refusal.find("wrong size of compressed values") != std::string::npos) ++found;
          }
        } catch (const cumulet::Error&) {  // the patched bytes were another field of the file
        }
      }
    }
    EXPECT_GT(found, 5);
  }
}

}  // namespace
