// TIFF stacks as volumes. The files are written by libtiff, or byte by byte where libtiff would not write them.

#include <gtest/gtest.h>
#include <tiffio.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "support/folder.hpp"
#include "support/volumes.hpp"
#include "volume/frame_import.hpp"
#include "volume/inspection.hpp"

namespace {

using namespace cumulet;
using glm::ivec3;
using test::value_at;
using volume::ScalarVolume;

constexpr ivec3 size{5, 4, 3};

float value_of(const ivec3& at) { return static_cast<float>(1 + at.x + 5 * at.y + 20 * at.z); }

/// How a file is written.
struct Format {
  const char* mode = "wl";
  std::uint16_t bits = 8;
  std::uint16_t sample_format = SAMPLEFORMAT_UINT;
  std::uint16_t compression = COMPRESSION_NONE;
  std::uint16_t predictor = 1;
  std::uint32_t rows_per_strip = 4;
  std::uint32_t tile = 0;  // 0: strips
  ivec3 size = ::size;
  std::function<void(TIFF*, int page)> more = {};  // further tags
};

/// Returns a rectangle of a slice, padded by zeros.
template <class T>
std::vector<T> rectangle(const ivec3& whole, int z, int x0, int y0, int columns, int rows) {
  std::vector<T> values;
  for (int y = y0; y < y0 + rows; ++y)
    for (int x = x0; x < x0 + columns; ++x)
      values.push_back(x < whole.x && y < whole.y ? static_cast<T>(value_of({x, y, z})) : T{});
  return values;
}

template <class T>
void write_page(TIFF* tiff, const Format& format, int z) {
  const int columns = format.size.x;
  const int rows = format.size.y;
  if (format.tile > 0) {
    const int side = static_cast<int>(format.tile);
    std::uint32_t number = 0;
    for (int y = 0; y < rows; y += side) {
      for (int x = 0; x < columns; x += side) {
        std::vector<T> tile = rectangle<T>(format.size, z, x, y, side, side);
        const auto bytes = static_cast<tmsize_t>(tile.size() * sizeof(T));
        ASSERT_EQ(TIFFWriteEncodedTile(tiff, number++, tile.data(), bytes), bytes);
      }
    }
    return;
  }
  const int strip_rows = static_cast<int>(format.rows_per_strip);
  std::uint32_t number = 0;
  for (int y = 0; y < rows; y += strip_rows) {
    std::vector<T> strip = rectangle<T>(format.size, z, 0, y, columns, std::min(strip_rows, rows - y));
    const auto bytes = static_cast<tmsize_t>(strip.size() * sizeof(T));
    ASSERT_EQ(TIFFWriteEncodedStrip(tiff, number++, strip.data(), bytes), bytes);
  }
}

template <class T>
void write_tiff(const std::string& file, const Format& format) {
  TIFF* tiff = TIFFOpen(file.c_str(), format.mode);
  ASSERT_NE(tiff, nullptr);
  for (int z = 0; z < format.size.z; ++z) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(format.size.x));
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(format.size.y));
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, format.bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, format.sample_format);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, format.compression);
    if (format.predictor > 1) TIFFSetField(tiff, TIFFTAG_PREDICTOR, format.predictor);
    if (format.tile > 0) {
      TIFFSetField(tiff, TIFFTAG_TILEWIDTH, format.tile);
      TIFFSetField(tiff, TIFFTAG_TILELENGTH, format.tile);
    } else {
      TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, format.rows_per_strip);
    }
    if (format.more) format.more(tiff, z);
    write_page<T>(tiff, format, z);
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
}

std::string content_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class TiffStack : public testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  static ScalarVolume read(const std::string& file) { return volume::import_volume(file, "", {}); }
  template <class T>
  [[nodiscard]] ScalarVolume read_written(const Format& format) const {
    write_tiff<T>(path("a.tif"), format);
    return read(path("a.tif"));
  }
  /// The cause of a failure, without the file's name.
  static std::string refusal_of(const std::string& file) {
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
  static std::string refusal_of_bytes(const std::string& bytes) {
    try {
      auto content = std::make_unique<MemorySource>(std::as_bytes(std::span(bytes)));
      static_cast<void>(volume::import_frame(std::move(content), "pak:a", {}, {}));
    } catch (const Error& error) {
      const std::string line = error.what();
      EXPECT_EQ(line.rfind("pak:a: ", 0), 0U) << line;
      EXPECT_EQ(line.find('\n'), std::string::npos) << line;
      return line;
    }
    return "no error";
  }
  template <class T = std::uint8_t>
  [[nodiscard]] std::string refusal(const Format& format) const {
    write_tiff<T>(path("bad.tif"), format);
    return refusal_of(path("bad.tif"));
  }
  void write(const std::string& name, const std::string& content) const {
    std::ofstream(path(name), std::ios::binary) << content;
  }
  static void expect_values(const ScalarVolume& got, const ivec3& whole = size) {
    EXPECT_EQ(got.active_voxels, static_cast<std::uint64_t>(whole.x * whole.y * whole.z));
    for (int z = 0; z < whole.z; ++z) {
      for (int y = 0; y < whole.y; ++y) {
        for (int x = 0; x < whole.x; ++x) ASSERT_EQ(value_at(got, {x, y, z}), value_of({x, y, z}));
      }
    }
  }
  static std::string metadata_of(const std::string& file) {
    volume::Inspection inspection{FilePath(file)};
    EXPECT_EQ(inspection.format(), "TIFF");
    return inspection.metadata().empty() ? "" : inspection.metadata()[0].value;
  }

  test::Folder folder_;
};

TEST_F(TiffStack, PagesOfEachTypeAndEncoding) {
  expect_values(read_written<std::uint8_t>({}));
  expect_values(read_written<std::int8_t>({.sample_format = SAMPLEFORMAT_INT, .rows_per_strip = 3}));
  expect_values(read_written<std::uint16_t>({.mode = "wb", .bits = 16}));
  expect_values(read_written<std::uint16_t>({.mode = "wl8", .bits = 16, .compression = COMPRESSION_LZW}));
  expect_values(read_written<std::int16_t>({.mode = "wb8",
                                            .bits = 16,
                                            .sample_format = SAMPLEFORMAT_INT,
                                            .compression = COMPRESSION_ADOBE_DEFLATE,
                                            .predictor = 2,
                                            .rows_per_strip = 1}));
  // (In big-endian files, libtiff 4.5 writes the third predictor's bytes in the wrong order.)
  expect_values(read_written<float>({.mode = "wb", .bits = 32, .sample_format = SAMPLEFORMAT_IEEEFP}));
  expect_values(read_written<float>(
      {.bits = 32, .sample_format = SAMPLEFORMAT_IEEEFP, .compression = COMPRESSION_ADOBE_DEFLATE, .predictor = 3}));
  expect_values(read_written<std::uint8_t>({.compression = COMPRESSION_PACKBITS, .rows_per_strip = 2}));
  expect_values(read_written<std::uint8_t>({.compression = COMPRESSION_LZW, .tile = 16}));
  const ivec3 large{35, 20, 2};
  expect_values(read_written<std::uint16_t>({.bits = 16, .tile = 16, .size = large}), large);
}

TEST_F(TiffStack, OpensFromMemory) {
  write_tiff<std::uint8_t>(path("a.tif"), {});
  const std::string bytes = content_of(path("a.tif"));
  const auto frame =
      volume::import_frame(std::make_unique<MemorySource>(std::as_bytes(std::span(bytes))), "pak:a", {}, {});
  expect_values(frame.density);
}

TEST_F(TiffStack, VoxelSizeIsThatOfTheFile) {
  const auto expect_size = [](const ScalarVolume& got, const glm::dvec3& wanted) {
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(got.index_to_world[axis][axis], wanted[axis], 1e-7);
  };
  expect_size(read_written<std::uint8_t>({}), {1, 1, 1});
  EXPECT_EQ(metadata_of(path("a.tif")), "");
  const auto resolution = [](TIFF* tiff, int /*page*/) {
    TIFFSetField(tiff, TIFFTAG_XRESOLUTION, 50.0F);
    TIFFSetField(tiff, TIFFTAG_YRESOLUTION, 25.0F);
    TIFFSetField(tiff, TIFFTAG_RESOLUTIONUNIT, RESUNIT_CENTIMETER);
  };
  expect_size(read_written<std::uint8_t>({.more = resolution}), {0.02, 0.04, 0.02});
  EXPECT_EQ(metadata_of(path("a.tif")),
            "resolution tags, centimeter; the distance of slices is not given, and is that of columns");
  const auto image_j = [&](TIFF* tiff, int page) {
    resolution(tiff, page);
    TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, "ImageJ=1.53t\nimages=3\nslices=3\nunit=micron\nspacing=0.3\n");
  };
  expect_size(read_written<std::uint8_t>({.more = image_j}), {0.02, 0.04, 0.3});
  EXPECT_EQ(metadata_of(path("a.tif")), "resolution tags, micron");
  const auto ome = [&](TIFF* tiff, int /*page*/) {
    TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION,
                 "<?xml version=\"1.0\"?><OME><Image><Pixels SizeC=\"1\" SizeT=\"1\" PhysicalSizeX=\"0.5\" "
                 "PhysicalSizeY=\"0.25\" PhysicalSizeZ=\"2\"/></Image></OME>");
  };
  expect_size(read_written<std::uint8_t>({.more = ome}), {0.5, 0.25, 2});
  EXPECT_EQ(metadata_of(path("a.tif")), "PhysicalSize of OME, micrometer");
}

TEST_F(TiffStack, EachAxisOfOmeHasItsUnit) {
  const auto described = [](const std::string& attributes) {
    return Format{.more = [text = "<OME><Pixels" + attributes + "/></OME>"](TIFF* tiff, int /*page*/) {
      TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, text.c_str());
    }};
  };
  const auto expect_size = [](const ScalarVolume& got, const glm::dvec3& wanted) {
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(got.index_to_world[axis][axis], wanted[axis], 1e-7 * wanted[axis]);
  };
  const std::string x = " PhysicalSizeX='250'\n\tPhysicalSizeXUnit = 'nm'";
  const std::string y = "\r\nPhysicalSizeY=\"0.5\"";  // the default: micrometers
  expect_size(read_written<std::uint8_t>(described(
                  x + y + " PhysicalSizeYUnit=\"\xC2\xB5m\" PhysicalSizeZ=\"0.002\" PhysicalSizeZUnit=\"mm\"")),
              {250, 500, 2000});
  EXPECT_EQ(metadata_of(path("a.tif")), "PhysicalSize of OME, nm");
  expect_size(read_written<std::uint8_t>(described(x + y + " PhysicalSizeZ=\"1\" PhysicalSizeZUnit=\"&#181;m\"")),
              {250, 500, 1000});
  // A unit that is not converted is kept if it is that of all axes.
  expect_size(read_written<std::uint8_t>(
                  described(" PhysicalSizeX=\"2\" PhysicalSizeXUnit=\"pixel\" PhysicalSizeY=\"3\" "
                            "PhysicalSizeYUnit=\"pixel\" PhysicalSizeZ=\"4\" PhysicalSizeZUnit=\"pixel\"")),
              {2, 3, 4});
  EXPECT_EQ(refusal(described(x + y + " PhysicalSizeZ=\"4\" PhysicalSizeZUnit=\"pixel\"")),
            "has voxel sizes in nm and pixel; units that differ are converted if they are nm, \xC2\xB5m, mm, cm or m");
}

TEST_F(TiffStack, PagesAreAllSlicesOfTheDescription) {
  const auto described = [](const char* text, int pages) {
    return Format{.size = {5, 4, pages},
                  .more = [text](TIFF* tiff, int /*page*/) { TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, text); }};
  };
  constexpr const char* ome = "<OME><Pixels\nSizeC='1' SizeZ='3'/></OME>";
  constexpr const char* image_j = "ImageJ=1.53t\nimages=3\nslices=3\n";
  expect_values(read_written<std::uint8_t>(described(ome, 3)));
  expect_values(read_written<std::uint8_t>(described(image_j, 3)));
  EXPECT_EQ(refusal(described(ome, 1)), "has 1 page, and its description gives 3 slices");
  EXPECT_EQ(refusal(described(ome, 2)), "has 2 pages, and its description gives 3 slices");
  EXPECT_EQ(refusal(described(image_j, 2)), "has 2 pages, and its description gives 3 slices");
  EXPECT_EQ(refusal(described("<OME><Pixels\nSizeT='3'/></OME>", 3)), "has 3 time points; one is read");
}

TEST_F(TiffStack, SmallerCopiesAreNoSlices) {
  const auto copy = [](TIFF* tiff, int page) {
    if (page == 1) TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, FILETYPE_REDUCEDIMAGE);
  };
  const ScalarVolume got = read_written<std::uint8_t>({.more = copy});
  EXPECT_EQ(got.bounds_max, ivec3(4, 3, 1));
  EXPECT_EQ(value_at(got, {2, 3, 1}), value_of({2, 3, 2}));
}

// ImageJ writes the slices of stacks above 4 GB behind their only page.
TEST_F(TiffStack, ImageJHasOnePageForManySlices) {
  const auto describe = [](TIFF* tiff, int /*page*/) {
    TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, "ImageJ=1.53t\nimages=3\nslices=3\n");
  };
  Format format{.mode = "wb", .bits = 16, .size = {5, 4, 1}, .more = describe};
  write_tiff<std::uint16_t>(path("a.tif"), format);
  TIFF* tiff = TIFFOpen(path("a.tif").c_str(), "r");
  const std::uint64_t first = TIFFGetStrileOffset(tiff, 0);
  TIFFClose(tiff);
  // The directory is behind the values, so that the slices after the first would overwrite it: the values are appended
  // again as a whole, and the page gets their position.
  std::string bytes = content_of(path("a.tif"));
  const auto big_endian = [](std::uint64_t number) {
    std::string text;
    for (int shift = 24; shift >= 0; shift -= 8) text += static_cast<char>(number >> static_cast<unsigned>(shift));
    return text;
  };
  const std::size_t at = bytes.rfind(big_endian(first));
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, 4, big_endian(bytes.size()));
  for (int z = 0; z < size.z; ++z) {
    for (const std::uint16_t value : rectangle<std::uint16_t>(size, z, 0, 0, size.x, size.y)) {
      bytes += static_cast<char>(value >> 8U);
      bytes += static_cast<char>(value & 0xFFU);
    }
  }
  write("large.tif", bytes);
  expect_values(read(path("large.tif")));
  write("large.tif", bytes.substr(0, bytes.size() - 1));
  EXPECT_EQ(refusal_of(path("large.tif")), "grid \"density\": the file is truncated: it has 59 of 60 values");
}

TEST_F(TiffStack, FilesOfAFolderAreSlices) {
  std::filesystem::create_directory(path("slices"));
  EXPECT_EQ(refusal_of(path("slices")), "is a directory");
  const auto write_slice = [&](const std::string& name, int z, const ivec3& of = size) {
    const std::string file = path("slices/" + name);
    TIFF* tiff = TIFFOpen(file.c_str(), "w");
    ASSERT_NE(tiff, nullptr);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(of.x));
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(of.y));
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    std::vector<std::uint16_t> values = rectangle<std::uint16_t>(of, z, 0, 0, of.x, of.y);
    TIFFWriteEncodedStrip(tiff, 0, values.data(), static_cast<tmsize_t>(values.size() * 2));
    TIFFClose(tiff);
  };
  write_slice("slice8.tif", 0);
  write_slice("slice9.TIFF", 1);
  write_slice("slice10.tif", 2);
  write("slices/notes.txt", "these are slices");
  write("slices/._slice8.tif", "of another system");
  expect_values(read(path("slices")));
  EXPECT_EQ(metadata_of(path("slices")), "");
  write_slice("slice11.tif", 0, {5, 3, 1});
  EXPECT_EQ(refusal_of(path("slices")),
            "slice11.tif has 5 x 3 pixels of uint16, and slice8.tif has 5 x 4 pixels of uint16");
  write_tiff<std::uint8_t>(path("slices/slice11.tif"), {});
  EXPECT_EQ(refusal_of(path("slices")), "slice11.tif: has 3 pages; in a folder, each file is one slice");
  const auto channels = [](TIFF* tiff, int /*page*/) {
    TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, "<OME><Pixels SizeC=\"2\" SizeT=\"1\"/></OME>");
  };
  write_tiff<std::uint16_t>(path("slices/slice11.tif"), {.bits = 16, .size = {5, 4, 1}, .more = channels});
  EXPECT_EQ(refusal_of(path("slices")), "slice11.tif: has 2 channels; one is read");
  write("slices/slice11.tif", "no TIFF");
  EXPECT_EQ(refusal_of(path("slices")).rfind("slice11.tif: ", 0), 0U) << refusal_of(path("slices"));
}

TEST_F(TiffStack, OtherImagesAreOneLine) {
  const auto with = [](std::uint32_t tag, int value) {
    return Format{.more = [tag, value](TIFF* tiff, int /*page*/) { TIFFSetField(tiff, tag, value); }};
  };
  const auto described = [](const char* text) {
    return Format{.more = [text](TIFF* tiff, int /*page*/) { TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, text); }};
  };
  EXPECT_EQ(refusal(with(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISWHITE)), "has values whose 0 is white; make 0 black");
  const auto colored = [](TIFF* tiff, int /*page*/) {
    std::vector<std::uint16_t> map(256);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_PALETTE);
    TIFFSetField(tiff, TIFFTAG_COLORMAP, map.data(), map.data(), map.data());
  };
  EXPECT_EQ(refusal({.more = colored}), "has a color palette; values without a palette are read");
  EXPECT_EQ(refusal(with(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MASK)),
            "has the photometric interpretation 4; gray values are read");
  EXPECT_EQ(refusal(with(TIFFTAG_ORIENTATION, ORIENTATION_BOTLEFT)),
            "has the orientation 4; 1 (first row at the top) is read");
  EXPECT_EQ(refusal<std::uint32_t>({.bits = 32}),
            "has unsigned values of 32 bits; integers of 8 and 16 bits and floats of 32 bits are read");
  EXPECT_EQ(refusal<double>({.bits = 64, .sample_format = SAMPLEFORMAT_IEEEFP}),
            "has float values of 64 bits; integers of 8 and 16 bits and floats of 32 bits are read");
  EXPECT_EQ(refusal({.compression = COMPRESSION_ZSTD}), "is compressed by ZSTD; LZW, deflate and PackBits are read");
  EXPECT_EQ(refusal(described("ImageJ=1.53t\nimages=3\nchannels=3\n")), "has 3 channels; one is read");
  EXPECT_EQ(refusal(described("<OME><Pixels SizeC=\"1\" SizeT=\"3\"/></OME>")), "has 3 time points; one is read");
  EXPECT_EQ(refusal({.rows_per_strip = 2,
                     .size = {5, 2, 3},
                     .more =
                         [](TIFF* tiff, int page) {
                           if (page == 2) TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 6);
                         }}),
            "page 3 has 6 x 2 pixels of uint8, and the first page has 5 x 2 pixels of uint8");
  const auto three = [](TIFF* tiff, int /*page*/) {
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 3);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
  };
  EXPECT_EQ(refusal({.more = three}), "has 3 values per pixel; one is read");
}

TEST_F(TiffStack, DamagedFilesAreOneLine) {
  for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE}) {
    write_tiff<std::uint16_t>(
        path("a.tif"), {.bits = 16, .compression = static_cast<std::uint16_t>(compression), .rows_per_strip = 2});
    const std::string whole = content_of(path("a.tif"));
    for (std::size_t bytes = 4; bytes < whole.size(); ++bytes)
      EXPECT_NE(refusal_of_bytes(whole.substr(0, bytes)), "no error") << bytes;
    for (std::size_t i = 0; i < whole.size(); ++i) {
      for (const char bits : {'\x01', '\x80', '\x7f'}) {
        std::string damaged = whole;
        damaged[i] = static_cast<char>(damaged[i] ^ bits);
        static_cast<void>(refusal_of_bytes(damaged));  // read, or refused by one line
      }
    }
  }
}

}  // namespace
