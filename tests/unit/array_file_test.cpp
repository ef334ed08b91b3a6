// NRRD files, and raw files with a JSON description, as volumes.

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zlib.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/log.hpp"
#include "support/array_files.hpp"
#include "volume/frame_import.hpp"
#include "volume/inspection.hpp"

namespace {

using namespace cumulet;
using glm::ivec3;
using test::bytes_of;
using test::in_grid;
using test::value_of;
using volume::ScalarVolume;

class ArrayFile : public test::ArrayFile {};

std::string gzipped(const std::string& bytes) {
  z_stream zip{};
  EXPECT_EQ(deflateInit2(&zip, 6, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&zip, bytes.size()), '\0');
  std::string in = bytes;
  zip.next_in = reinterpret_cast<Bytef*>(in.data());
  zip.avail_in = static_cast<uInt>(in.size());
  zip.next_out = reinterpret_cast<Bytef*>(out.data());
  zip.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&zip, Z_FINISH), Z_STREAM_END);
  out.resize(zip.total_out);
  deflateEnd(&zip);
  return out;
}

std::string nrrd(const std::string& fields, const std::string& data, const std::string& sizes = "5 4 3") {
  return "NRRD0004\n# made by a test\ndimension: 3\nsizes: " + sizes + "\n" + fields + "\n" + data;
}

TEST_F(ArrayFile, NrrdValuesOfEachTypeAndEncoding) {
  const auto expect = [&](const std::string& fields, const std::string& data) {
    SCOPED_TRACE(fields);
    expect_values(read(write("a.nrrd", nrrd(fields, data))));
  };
  expect("type: uint8\nencoding: raw\n", bytes_of<std::uint8_t>());
  expect("type: signed short\nencoding: raw\nendian: little\n", bytes_of<std::int16_t>());
  expect("type: ushort\nencoding: raw\nendian: big\n", bytes_of<std::uint16_t>(true));
  expect("type: int\nencoding: gz\nendian: little\n", gzipped(bytes_of<std::int32_t>()));
  expect("type: unsigned int\nencoding: gzip\nendian: big\n", gzipped(bytes_of<std::uint32_t>(true)));
  expect("type: long long int\nencoding: raw\nendian: little\n", bytes_of<std::int64_t>());
  expect("type: float\nencoding: raw\nendian: big\n", bytes_of<float>(true));
  expect("type: double\nencoding: gzip\nendian: little\n", gzipped(bytes_of<double>()));
  std::string text;
  for (int i = 0; i < 60; ++i)
    text += std::to_string(value_of({i % 5, i / 5 % 4, i / 20})) + (i % 5 == 4 ? "\r\n" : " ");
  expect("Type: Float\nEncoding: ASCII\n", text);
  expect("type: uint8\nencoding: raw\nbyte skip: 3\n", "xyz" + bytes_of<std::uint8_t>());
  expect("type: uint8\nencoding: raw\nline skip: 2\n", "a\nb\n" + bytes_of<std::uint8_t>());
  expect("type: uint8\nencoding: raw\nbyte skip: -1\n", "anything" + bytes_of<std::uint8_t>());
}

TEST_F(ArrayFile, NrrdPlacesVoxels) {
  const std::string data = bytes_of<std::uint8_t>();
  ScalarVolume got = read(write("a.nrrd", nrrd("type: uint8\nencoding: raw\nspacings: 0.5 2 nan\n", data)));
  EXPECT_EQ(got.index_to_world, glm::dmat4(0.5, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1));
  got = read(write("a.nrrd", nrrd("type: uint8\r\nencoding: raw\r\nspace: left-posterior-superior\r\n"
                                  "space directions: (0,2,0) (-1.5, 0, 0) (0,0,3e0)\r\nspace origin: (7,+8,-9)\r\n\r",
                                  data)));
  EXPECT_EQ(got.index_to_world, glm::dmat4(0, 2, 0, 0, -1.5, 0, 0, 0, 0, 0, 3, 0, 7, 8, -9, 1));
  expect_values(got);
}

TEST_F(ArrayFile, NrrdHasDetachedValuesAndVectors) {
  write("values.bin", bytes_of<float>());
  const std::string detached =
      "NRRD0005\ntype: float\ndimension: 3\nsizes: 5 4 3\nencoding: raw\nendian: little\n"
      "data file: values.bin\n";
  expect_values(read(write("a.nhdr", detached)));
  EXPECT_EQ(refusal("NRRD0005\ntype: float\ndimension: 3\nsizes: 5 4 3\nencoding: raw\ndata file: no.bin\n"),
            "has its values in the file \"no.bin\": No such file or directory");
  try {
    const auto bytes = std::as_bytes(std::span(detached));
    static_cast<void>(volume::import_frame(std::make_unique<MemorySource>(bytes), "pak:a", {}, {}));
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "pak:a: has its values in the file \"values.bin\", but the data has no folder");
  }

  std::string vectors;
  for (int i = 0; i < 60; ++i) {
    for (const float part : {2.0F, 3.0F, 6.0F}) {
      std::array<char, 4> raw{};
      std::memcpy(raw.data(), &part, 4);
      vectors.append(raw.data(), 4);
    }
  }
  const std::string file = write("v.nrrd",
                                 "NRRD0004\ntype: float\ndimension: 4\nsizes: 3 5 4 3\nkinds: vector domain "
                                 "domain domain\nencoding: raw\nendian: little\n\n" +
                                     vectors);
  volume::Inspection inspection{FilePath(file)};
  ASSERT_EQ(inspection.grids().size(), 1U);
  EXPECT_EQ(inspection.grids()[0].name, "velocity");
  EXPECT_EQ(inspection.grids()[0].type, "vec3s");
  EXPECT_EQ(inspection.format(), "NRRD 0004");
  ASSERT_TRUE(inspection.statistics(0).values);
  EXPECT_EQ(inspection.statistics(0).values->max, 7.0F);
}

// ---- Values in several files ----

/// A header for three files of bytes, one for each slice.
std::string slices(const std::string& data_file, const std::string& encoding = "raw") {
  return "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 5 4 3\nencoding: " + encoding + "\n" + data_file;
}

std::string slice(std::size_t z) { return bytes_of<std::uint8_t>().substr(20 * z, 20); }

TEST_F(ArrayFile, NrrdHasValuesInSeveralFiles) {
  const auto expect = [&](const std::string& header) {
    SCOPED_TRACE(header);
    expect_values(read(write("a.nhdr", header)));
  };
  for (const std::size_t z : {0, 1, 2}) {
    write("s" + std::to_string(7 + z) + ".raw", slice(z));
    write("s" + std::to_string(7 + z) + ".gz", gzipped(slice(z)));
    write("padded0" + std::to_string(18 - 2 * z), "line\n\nxyz" + slice(z));
    write("100%_" + std::string(1, ' ') + std::to_string(z), slice(z));
    std::string text;
    for (const char value : slice(z)) text += std::to_string(static_cast<unsigned char>(value)) + " ";
    write("text" + std::to_string(z), text);
  }
  expect(slices("data file: s%d.raw 7 9 1\n"));
  expect(slices("datafile: s%01i.raw 7 9 1 2"));
  expect(slices("data file: s%d.gz 7 9 1\n", "gzip"));
  expect(slices("data file: text%u 0 2 1\n", "ascii"));
  expect(slices("line skip: 2\nbyte skip: 3\ndata file: padded%03d 18 14 -2\n"));
  expect(slices("byte skip: -1\ndata file: padded%03d 18 14 -2\n"));
  expect(slices("data file: LIST\ns7.raw\ns8.raw\r\ns9.raw\n"));
  expect(slices("data file: LIST\n100%_ 0\n100%_ 1\n" + (folder_ / "100%_ 2").string()));
  write("all", bytes_of<std::uint8_t>());
  expect(slices("data file: LIST 3\nall\n"));
  expect(slices("data file: all\n"));
  // One file for each row.
  for (std::size_t row = 0; row < 12; ++row) {
    write("row" + std::to_string(row), bytes_of<std::uint8_t>().substr(5 * row, 5));
  }
  expect(slices("data file: row%d 0 11 1 1\n"));
}

TEST_F(ArrayFile, BadListsOfFilesAreOneLine) {
  const auto cause = [&](const std::string& header) { return refusal(header, "bad.nhdr"); };
  for (const std::size_t z : {0, 1}) write("s" + std::to_string(z), slice(z));
  const std::string missing = "has its values in the file \"s2\": No such file or directory";
  EXPECT_EQ(cause(slices("data file: s%d 0 2 1\n")), missing);
  EXPECT_EQ(cause(slices("data file: LIST\ns0\ns1\ns2\n")), missing);
  EXPECT_EQ(cause(slices("data file: s%d 0 3 1\n")), "the number of its data files is 4 in place of 3");
  EXPECT_EQ(cause(slices("data file: s%d 2 0 1\n")), "the number of its data files is 0 in place of 3");
  EXPECT_EQ(cause(slices("data file: s%d 5 4 2 3\n")),
            "the number of its data files is 0, which does not divide its 3 slices");
  EXPECT_EQ(cause(slices("data file: s%d -2147483648 2147483647 1 3\n")), "has more than 1048576 data files");
  EXPECT_EQ(cause(slices("data file: LIST\ns0\n")), "the number of its data files is 1 in place of 3");
  EXPECT_EQ(cause(slices("data file: LIST 3\ns0\ns1\n")),
            "the number of its data files is 2, which does not divide its 3 slices");
  EXPECT_EQ(cause(slices("data file: LIST 4\ns0\n")), "has files of 4 axes in \"data file\"");
  EXPECT_EQ(cause(slices("data file: s%d 0 2 0\n")), "has the step 0 in \"data file\"");
  EXPECT_EQ(cause(slices("data file: s%d 0 two 1\n")), "cannot read 'two' in \"data file\"");
  for (const char* pattern : {"s%s", "s%", "s%d%d", "s%12", "s%*d"}) {
    EXPECT_EQ(cause(slices("data file: " + std::string(pattern) + " 0 2 1\n")),
              "has the pattern '" + std::string(pattern) + "' in \"data file\", which is not one of one number");
  }
  EXPECT_EQ(cause(slices("data file: s%999d 0 2 1\n")), "cannot read '999' in \"data file\"");
  write("s2", slice(2).substr(1));
  EXPECT_EQ(cause(slices("data file: s%d 0 2 1\n")), in_grid + "\"s2\": the file is truncated: it has 19 of 20 values");
  std::filesystem::create_directory(folder_ / "folder");
  EXPECT_EQ(cause(slices("data file: folder\n")), "has its values in the file \"folder\": is not a regular file");
  // It would wait for a writer.
  ASSERT_EQ(mkfifo((folder_ / "fifo").c_str(), 0600), 0);
  EXPECT_EQ(cause(slices("data file: fifo\n")), "has its values in the file \"fifo\": is not a regular file");
}

TEST_F(ArrayFile, NrrdSkipsDecodedBytes) {
  const std::string bytes = bytes_of<std::uint8_t>();
  const auto expect = [&](const std::string& fields, const std::string& data) {
    SCOPED_TRACE(fields);
    expect_values(read(write("a.nrrd", nrrd("type: uint8\n" + fields, data))));
  };
  expect("encoding: gzip\nbyte skip: 4\n", gzipped("head" + bytes));
  expect("encoding: gzip\nbyte skip: -1\n", gzipped("some head" + bytes));
  expect("encoding: gzip\nline skip: 1\nbyte skip: -4\n", "text\n" + gzipped("some head" + bytes + "end"));
  expect("encoding: raw\nbyte skip: -4\n", "some head" + bytes + "end");
  const std::string end = in_grid + "the file is truncated or damaged: unexpected end of file";
  EXPECT_EQ(refusal(nrrd("type: uint8\nencoding: gzip\nbyte skip: -2\n", gzipped(bytes))), end);
  EXPECT_EQ(refusal("NRRD0004\ntype: uint8\nsizes: 5 4 3\nencoding: raw\nbyte skip: -900\n\n" + bytes), end);
  EXPECT_EQ(refusal(nrrd("type: uint8\nencoding: ascii\nbyte skip: -1\n", "1 2 3")),
            "has a negative \"byte skip\" and is ascii");
}

TEST_F(ArrayFile, NrrdAxesWithoutSpace) {
  const std::string bytes = bytes_of<std::uint8_t>();
  const auto of_sizes = [&](const std::string& sizes, const std::string& fields) {
    return nrrd("type: uint8\nencoding: raw\n" + fields, bytes, sizes);
  };
  // An axis of one entry behind those of space.
  expect_values(read(write("a.nrrd", of_sizes("5 4 3 1", ""))));
  const std::string last = "space directions: (2,0,0) (0,3,0) (0,0,4) none\n";
  const ScalarVolume got = read(write("a.nrrd", of_sizes("1 20 3 1", last)));
  EXPECT_EQ(got.bounds_max, ivec3(0, 19, 2));
  EXPECT_EQ(got.index_to_world, glm::dmat4(2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 4, 0, 0, 0, 0, 1));
  // A picture is no volume of three columns.
  EXPECT_EQ(refusal(of_sizes("3 5 4", "kinds: RGB-color domain domain\n")),
            "has 2 axes and one of the kind 'RGB-color' before them; 3 axes are read");
  EXPECT_EQ(refusal(of_sizes("5 4 1 3", "")), "has 4 axes; 3 are read, and before them an axis of 1 or 3 components");
}

TEST_F(ArrayFile, WarnsOfNegativeValues) {
  const auto warnings = [&](const std::string& text) {
    std::vector<std::string> lines;
    const Log log([&](LogLevel, const char* message) { lines.emplace_back(message); });
    const std::string file = write("a.nrrd", nrrd("type: short\nencoding: ascii\n", text, "2 1 2"));
    static_cast<void>(volume::import_volume(file, "", log));
    std::string all;
    for (const std::string& line : lines) all += line.substr(file.size() + 2) + "\n";
    return all;
  };
  // Air, water and bone of a scanner.
  EXPECT_EQ(warnings("-1000 0 -3 700\n"), in_grid + "2 negative voxels clamped to 0\n");
  EXPECT_EQ(warnings("-1 -2 -3 0\n"), in_grid + "3 negative voxels clamped to 0, and no value is above 0\n");
}

TEST_F(ArrayFile, BadNrrdIsOneLine) {
  const std::string data = bytes_of<std::uint8_t>();
  EXPECT_EQ(refusal(nrrd("type: uint8\nencoding: raw\n", data.substr(0, 59))),
            in_grid + "the file is truncated: it has 59 of 60 values");
  EXPECT_EQ(refusal(nrrd("type: uint8\nencoding: raw\n", data, "5 4 300000000")),
            "its size is (5, 4, 300000000); each side is from 1 to 1048576");
  EXPECT_EQ(refusal(nrrd("type: uint8\nencoding: raw\n", data, "1048576 1048576 1048576")),
            in_grid + "the file is truncated: it has 60 of 1152921504606846976 values");
  EXPECT_EQ(refusal(nrrd("type: block\nencoding: raw\n", data)), "has the type 'block', which is not supported");
  EXPECT_EQ(refusal(nrrd("type: uint8\nencoding: bzip2\n", data)),
            "has the encoding 'bzip2'; raw, gzip and ascii are supported");
  EXPECT_EQ(refusal(nrrd("encoding: raw\n", data)), "its header has no \"type\"");
  EXPECT_EQ(refusal(nrrd("type: uint8\nencoding: raw\n", data, "5 4")),
            "has 2 axes; 3 are read, and before them an axis of 1 or 3 components");
  EXPECT_EQ(refusal(nrrd("type: uint8\nencoding: raw\n", data, "5 x 3")), "cannot read 'x' in \"sizes\"");
  EXPECT_EQ(refusal(nrrd("type: uint8\nencoding: raw\nspace origin: (1,2)\n", data)),
            "\"space origin\" has '(1,2)' in place of (x,y,z)");
  EXPECT_EQ(refusal(nrrd("type: uint8\nencoding: raw\nspace directions: (1,0,0) (2,0,0) (0,0,1)\n", data)),
            in_grid + "its transform is singular");
  EXPECT_EQ(refusal(nrrd("type: uint8\nencoding: raw\nnonsense\n", data)),
            "its header has the line 'nonsense', which is not a field");
  EXPECT_EQ(refusal(nrrd("type: uint8\nencoding: ascii\n", "1 2 three 4" + std::string(200, ' '))),
            in_grid + "cannot read the value 'three'");
  EXPECT_EQ(refusal("NRRD0004\ntype: uint8\nsizes: 5 4 3\nencoding: raw"),
            "the file is truncated or damaged: unexpected end of file");
  std::string damaged = gzipped(data);
  damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 0x55);
  EXPECT_NE(refusal(nrrd("type: uint8\nencoding: gzip\n", damaged)), "no error");
}

TEST_F(ArrayFile, RawFilesHaveADescription) {
  const std::string data = bytes_of<std::uint16_t>();
  const std::string file = write("engine.raw", data);
  EXPECT_EQ(refusal(data, "engine.raw"), "has no description beside it: engine.raw.json or engine.json");
  write("engine.json", R"({"name": "Engine", "type": "uint16", "size": [5, 4, 3], "spacing": [1, 2, 0.5],
                           "origin": [7, 8, 9], "url": "nowhere"})");
  const ScalarVolume got = read(file);
  expect_values(got);
  EXPECT_EQ(got.index_to_world, glm::dmat4(1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0.5, 0, 7, 8, 9, 1));
  // This description is preferred.
  write("engine.raw.json", R"({"type": "uint8", "size": [2, 2, 2], "offset": 4, "endian": "big"})");
  EXPECT_EQ(read(file).bounds_max, ivec3(0, 1, 1));
}

TEST_F(ArrayFile, BadDescriptionsAreOneLine) {
  const auto expect = [&](const std::string& json, const std::string& cause) {
    write("a.json", json);
    EXPECT_EQ(refusal(bytes_of<std::uint8_t>(), "a.raw"), cause) << json;
  };
  expect("", "a.json: is not a JSON object");
  expect("[1, 2]", "a.json: is not a JSON object");
  expect(R"({"size": [5, 4, 3]})", "a.json: has no \"type\"");
  expect(R"({"type": "int24", "size": [5, 4, 3]})", "a.json: has the type 'int24', which is not supported");
  expect(R"({"type": "uint8"})", "a.json: has no \"size\"");
  expect(R"({"type": "uint8", "size": [5, 4]})", "a.json: \"size\" is not three numbers");
  expect(R"({"type": "uint8", "size": [5, 4, -3]})", "a.json: \"size\" is out of range");
  expect(R"({"type": "uint8", "size": [5, 4, 3], "endian": "middle"})", "a.json: \"endian\" is neither little nor big");
  expect(R"({"type": "uint8", "size": [5, 4, 3], "offset": -1})", "a.json: \"offset\" is not a number of bytes");
  expect(R"({"type": "uint8", "size": [5, 4, 4]})", in_grid + "the file is truncated: it has 60 of 80 values");
  expect(R"({"type": "uint8", "size": [5, 4, 3], "offset": 1000})",
         in_grid + "the file is truncated: it has 0 of 60 values");
}

}  // namespace
