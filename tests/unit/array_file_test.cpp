// NRRD files, VTK images, and raw files with a JSON description, as volumes.

#include <gtest/gtest.h>
#include <zlib.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "support/folder.hpp"
#include "support/volumes.hpp"
#include "volume/array_file.hpp"
#include "volume/frame_import.hpp"
#include "volume/inspection.hpp"

namespace {

using namespace cumulet;
using glm::ivec3;
using test::value_at;
using volume::ScalarVolume;

constexpr ivec3 size{5, 4, 3};
const std::string in_grid = "grid \"density\": ";

float value_of(const ivec3& at) { return static_cast<float>(1 + at.x + 10 * at.y + 50 * at.z); }

template <class T>
std::string bytes_of(bool swapped = false) {
  std::string bytes;
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        const T value = static_cast<T>(value_of({x, y, z}));
        std::array<char, sizeof(T)> raw{};
        std::memcpy(raw.data(), &value, sizeof value);
        bytes.append(swapped ? std::string(raw.rbegin(), raw.rend()) : std::string(raw.begin(), raw.end()));
      }
    }
  }
  return bytes;
}

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

class ArrayFile : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& content) const {
    const std::string file = (folder_ / name).string();
    std::ofstream(file, std::ios::binary) << content;
    return file;
  }
  static ScalarVolume read(const std::string& file) { return volume::import_volume(file, "", {}); }
  /// The cause of a failure, without the file's name.
  [[nodiscard]] std::string refusal(const std::string& content, const std::string& name = "bad.nrrd") const {
    const std::string file = write(name, content);
    try {
      read(file);
    } catch (const Error& error) {
      const std::string line = error.what();
      EXPECT_EQ(line.rfind(file + ": ", 0), 0U) << line;
      EXPECT_EQ(line.find('\n'), std::string::npos) << line;
      EXPECT_EQ(error.code(), ErrorCode::file);
      return line.substr(file.size() + 2);
    }
    return "no error";
  }
  static void expect_values(const ScalarVolume& got) {
    EXPECT_EQ(got.active_voxels, 60U);
    for (int z = 0; z < size.z; ++z) {
      for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) ASSERT_EQ(value_at(got, {x, y, z}), value_of({x, y, z}));
      }
    }
  }

  test::Folder folder_;
};

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
  expect("type: float\nencoding: ascii\n", text);
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

// ---- VTK ----

std::string number_bytes(std::uint64_t number, std::size_t bytes) {
  std::string text;
  for (std::size_t i = 0; i < bytes; ++i) text += static_cast<char>(number >> (8 * i) & 0xFFU);
  return text;
}

std::string zlib_block(const std::string& bytes) {
  std::string out(compressBound(bytes.size()), '\0');
  uLongf size_of_out = out.size();
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(out.data()), &size_of_out, reinterpret_cast<const Bytef*>(bytes.data()),
                     bytes.size()),
            Z_OK);
  out.resize(size_of_out);
  return out;
}

/// An array in blocks of 64 bytes.
std::string in_blocks(const std::string& bytes) {
  constexpr std::size_t block = 64;
  std::string table;
  std::string blocks;
  const std::size_t count = (bytes.size() + block - 1) / block;
  table += number_bytes(count, 8) + number_bytes(block, 8) + number_bytes(bytes.size() % block, 8);
  for (std::size_t i = 0; i < count; ++i) {
    const std::string packed = zlib_block(bytes.substr(i * block, block));
    table += number_bytes(packed.size(), 8);
    blocks += packed;
  }
  return table + blocks;
}

std::string vti(const std::string& file, const std::string& arrays, const std::string& data,
                const std::string& extent = "2 6 0 3 0 2") {
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\" " + file +
         ">\n <ImageData WholeExtent=\"" + extent + "\" Origin=\"1 2 3\" Spacing=\"0.5 2 1\">\n" +
         "<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" format=\"ascii\">1</DataArray></FieldData>" +
         "  <Piece Extent=\"" + extent + "\">" + arrays + "</Piece></ImageData>\n<AppendedData encoding=\"raw\">\n _" +
         data + "\n</AppendedData></VTKFile>";
}

TEST_F(ArrayFile, VtkImagesHavePointsAndCells) {
  const std::string floats = bytes_of<float>();
  const std::string first = "junk" + number_bytes(floats.size(), 4) + floats;
  const std::string points =
      "<PointData Scalars='density'><DataArray type=\"Float32\" Name=\"density\" "
      "format=\"appended\" offset=\"4\"/></PointData>";
  ScalarVolume got = read(write("a.vti", vti("header_type=\"UInt32\"", points, first)));
  expect_values(got);
  EXPECT_EQ(got.index_to_world, glm::dmat4(0.5, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 2, 2, 3, 1));

  const std::string cells =
      "<CellData><DataArray type=\"UInt16\" Name=\"density\" NumberOfComponents=\"1\" "
      "format=\"appended\" offset=\"0\"></DataArray></CellData>";
  const std::string file = write("b.vti", vti("header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"", cells,
                                              in_blocks(bytes_of<std::uint16_t>()), "0 5 0 4 0 3"));
  got = read(file);
  expect_values(got);
  EXPECT_EQ(got.index_to_world[3], glm::dvec4(1.25, 3, 3.5, 1));
}

TEST_F(ArrayFile, BadVtkImagesAreOneLine) {
  const auto points = [](const std::string& attributes) {
    return "<PointData><DataArray Name=\"density\" " + attributes + "/></PointData>";
  };
  const std::string zlib = "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"";
  const std::string appended = points("type=\"UInt8\" format=\"appended\" offset=\"0\"");
  EXPECT_EQ(refusal(vti("compressor=\"vtkLZ4DataCompressor\"", appended, "")),
            "is compressed by vtkLZ4DataCompressor; vtkZLibDataCompressor is supported");
  EXPECT_EQ(refusal(vti("", points("type=\"UInt8\" format=\"binary\""), "")),
            "has an array in the format binary; only arrays that are appended as raw bytes are read");
  EXPECT_EQ(refusal(vti("", points("type=\"String\" format=\"appended\" offset=\"0\""), "")),
            "has no array of 1 or 3 components");
  EXPECT_EQ(refusal(vti("", appended, "", "2 x 0 3 0 2")), "cannot read Extent=\"2 x 0 3 0 2\"");
  EXPECT_EQ(refusal(vti("", appended, "", "2 1 0 3 0 2")), "its size is (0, 4, 3); each side is from 1 to 1048576");
  EXPECT_EQ(refusal("<VTKFile type=\"PolyData\">"), "is a VTK file of the type PolyData, not ImageData");
  EXPECT_EQ(refusal("<?xml?><VTKFile type=\"ImageData\"><PointData>" + appended),
            "has no appended data; only arrays that are appended as raw bytes are read");
  EXPECT_NE(refusal(vti(zlib, appended, in_blocks(bytes_of<std::uint8_t>()).substr(0, 30))), "no error");
  std::string damaged = in_blocks(bytes_of<std::uint8_t>());
  damaged[36] = static_cast<char>(damaged[36] ^ 0x55);
  EXPECT_EQ(refusal(vti(zlib, appended, damaged)),
            in_grid + "the file is damaged: its compressed values cannot be decoded");
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
