// Readers, writers and messages in a host whose locales group digits and use a decimal comma.

#include <gtest/gtest.h>
#include <stdlib.h>
#include <tiffio.h>

#include <clocale>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <cube_lut.hpp>
#include <fstream>
#include <locale>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>

#include "attributes.hpp"
#include "checkpoint.hpp"
#include "image.hpp"
#include "layers.hpp"
#include "light/environment_file.hpp"
#include "memory.hpp"
#include "options.hpp"
#include "scene_file.hpp"
#include "support/file_bytes.hpp"
#include "support/folder.hpp"
#include "support/gltf_import.hpp"
#include "support/vdb_files.hpp"
#include "volume/frame_import.hpp"
#include "volume/import_detail.hpp"
#include "volume/inspection.hpp"
#include "volume/memory.hpp"
#include "volume/volume.hpp"

namespace {

using namespace cumulet;
using test::bytes_of;
namespace fs = std::filesystem;

/// Formats 1234567.5 as 1.234.567,5.
class Grouping final : public std::numpunct<char> {
 protected:
  [[nodiscard]] char do_decimal_point() const override { return ','; }
  [[nodiscard]] char do_thousands_sep() const override { return '.'; }
  [[nodiscard]] std::string do_grouping() const override { return "\3"; }
};

/// Sets the process' locales during its lifetime.
class HostileLocales {
 public:
  /// also_c: sets the C locale in addition to C++'s.
  explicit HostileLocales(bool also_c) : cpp_(std::locale::global(std::locale(std::locale::classic(), new Grouping))) {
    const char* before = std::setlocale(LC_ALL, nullptr);
    c_ = before == nullptr ? "C" : before;
    if (!also_c) return;
    setenv("LOCPATH", CUMULET_LOCALES, 1);
    for (const char* name : {"cumulet_DE", "de_DE.UTF-8", "fr_FR.UTF-8"}) {
      has_comma_ = std::setlocale(LC_ALL, name) != nullptr;
      if (has_comma_) break;
    }
  }
  ~HostileLocales() {
    std::setlocale(LC_ALL, c_.c_str());
    std::locale::global(cpp_);
  }
  HostileLocales(const HostileLocales&) = delete;
  HostileLocales& operator=(const HostileLocales&) = delete;

  /// Whether the system has such a locale for C, too.
  [[nodiscard]] bool has_comma() const { return has_comma_; }

 private:
  std::locale cpp_;
  std::string c_;
  bool has_comma_ = false;
};

template <class Call>
std::string error_of(Call&& call) {
  try {
    call();
    return "";
  } catch (const std::exception& error) {
    return error.what();
  }
}

/// All texts that are read and written, by kind.
using Texts = std::map<std::string, std::string>;

void add_volumes(Texts& texts, const fs::path& folder) {
  const auto density = test::two_voxels("density", 1234.5F);
  density->insertMeta("voxels", openvdb::Int64Metadata(363344));
  density->insertMeta("count", openvdb::Int32Metadata(-1234567));
  density->insertMeta("scale", openvdb::FloatMetadata(1234.5F));
  density->insertMeta("step", openvdb::DoubleMetadata(0.25));
  density->insertMeta("box", openvdb::Vec3IMetadata(openvdb::Vec3i(1000, 20, -30000)));
  density->insertMeta("size", openvdb::Vec3DMetadata(openvdb::Vec3d(0.5, 1e9, 2.0)));
  density->insertMeta("frame", openvdb::Mat4DMetadata(openvdb::Mat4d::identity() * 1.5));
  density->insertMeta("note", openvdb::StringMetadata("1,5"));
  const auto velocity = openvdb::Vec3SGrid::create();
  velocity->setName("vel");
  velocity->tree().setValue(openvdb::Coord(1, 2, 3), openvdb::Vec3s(1e6F, 0, 0));
  const fs::path file = folder / "fields.vdb";
  openvdb::io::File(file.string()).write({density, test::two_voxels("temperature", 1234.5F), velocity});

  test::Messages messages;
  const volume::VolumeFrame frame = volume::import_frame(file, {}, messages.log);
  texts["largest value"] = std::to_string(frame.density.max_value == 1234.5F);
  for (const std::string& text : messages.warnings) texts["warnings of a volume"] += text + "\n";
  for (const std::string& text : messages.hints) texts["remarks on a volume"] += text + "\n";
  const volume::Inspection inspection(file);
  for (const volume::GridInfo& grid : inspection.grids()) {
    for (const volume::Metadata& entry : grid.metadata) {
      if (grid.name == "density") texts["metadata " + entry.name] = entry.value;
    }
  }
  const auto far = test::fog("density");
  far->tree().setValue(openvdb::Coord(-2000000000, 0, 0), 1.0F);
  far->tree().setValue(openvdb::Coord(2000000000, 0, 0), 1.0F);
  openvdb::io::File((folder / "far.vdb").string()).write({far});
  texts["a refused volume"] = error_of([&] { (void)volume::import_volume(folder / "far.vdb", "", {}); });
  texts["a voxel"] = volume::detail::to_string({12345, -6789, 0});
}

void write_stack(const fs::path& file) {
  const std::unique_ptr<TIFF, decltype(&TIFFClose)> tiff(TIFFOpen(file.c_str(), "w"), &TIFFClose);
  ASSERT_NE(tiff, nullptr);
  for (std::uint8_t value : {std::uint8_t{7}, std::uint8_t{9}}) {
    TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, 1);
    TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, 1);
    TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff.get(), TIFFTAG_XRESOLUTION, 4.0);
    TIFFSetField(tiff.get(), TIFFTAG_YRESOLUTION, 4.0);
    TIFFSetField(tiff.get(), TIFFTAG_IMAGEDESCRIPTION, "ImageJ=1.53\nimages=2\nslices=2\nspacing=1234.5\n");
    TIFFWriteScanline(tiff.get(), &value, 0, 0);
    TIFFWriteDirectory(tiff.get());
  }
}

void add_arrays(Texts& texts, const fs::path& folder) {
  std::ofstream(folder / "a.nrrd", std::ios::binary)
      << "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 1 1\nencoding: ascii\nspacings: 0.5 1.25 1234.5\n\n1.5 2.25\n";
  std::ofstream(folder / "a.vti", std::ios::binary)
      << R"(<VTKFile type="ImageData" byte_order="LittleEndian" header_type="UInt32">)"
      << R"(<ImageData WholeExtent="0 1 0 0 0 0" Origin="0.5 1234.5 0" Spacing="0.25 1 1.5">)"
      << R"(<Piece Extent="0 1 0 0 0 0"><PointData><DataArray type="UInt8" Name="density" format="appended" offset="0"/>)"
      << R"(</PointData></Piece></ImageData><AppendedData encoding="raw">_)" << std::string("\2\0\0\0\1\2", 6)
      << "</AppendedData></VTKFile>";
  std::ofstream(folder / "a.raw", std::ios::binary) << "\1\2";
  std::ofstream(folder / "a.raw.json")
      << R"({"type": "uint8", "size": [2, 1, 1], "spacing": [0.5, 1.25, 1234.5], "origin": [0.125, 0, 0]})";
  write_stack(folder / "a.tif");
  for (const char* name : {"a.nrrd", "a.vti", "a.raw", "a.tif"}) {
    std::string& text = texts[name];
    test::Messages messages;
    const volume::VolumeFrame frame = volume::import_frame(folder / name, {}, messages.log);
    text = std::to_string(std::lround(100.0F * frame.density.max_value));
    const glm::dmat4& matrix = frame.density.index_to_world;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 3; ++j) text += ' ' + std::to_string(std::lround(1000.0 * matrix[i][j]));
    }
    for (const auto& lines : {messages.warnings, messages.hints}) {
      for (const std::string& line : lines) text += '\n' + line;
    }
    const volume::Inspection inspection(folder / name);
    for (const volume::GridInfo& grid : inspection.grids()) {
      for (const volume::Metadata& entry : grid.metadata) text += '\n' + entry.name + '=' + entry.value;
    }
  }
  std::string points;
  for (int i = 0; i < 8; ++i) points += "0.5 0.25 1e-1\n";
  std::istringstream cube("LUT_3D_SIZE 2\nDOMAIN_MIN 0.25 0.25 0.25\n" + points);
  const demo::DisplayLut lut = demo::read_cube_lut(cube, "a.cube");
  texts["a.cube"] = std::to_string(std::lround(1000.0F * lut.domain_min));
  for (const float value : lut.values) texts["a.cube"] += ' ' + std::to_string(std::lround(1000.0F * value));
}

void add_surfaces(Texts& texts) {
  test::GltfModel model = test::triangle_model({{"translation", {1234.5, 0.25, -2.0}}}, {{"material", 0}});
  model.root["materials"] = test::json::array({{{"emissiveFactor", {0.0, 3.5, 1234.5}}}});
  test::Lines lines;
  const surface::ScenePtr scene = test::imported(model, lines.log);
  const glm::vec3 corner = test::corners(*scene, scene->pose(0.0))[0];
  texts["glTF numbers"] =
      std::to_string(std::lround(1000.0F * corner.x)) + " " + std::to_string(std::lround(100.0F * corner.y));
  for (const std::string& text : lines.warnings) texts["warnings of a model"] += text + "\n";
}

void add_pictures(Texts& texts, const fs::path& folder) {
  image::Image picture{1200, 1, {}};
  for (int i = 0; i < 4800; ++i) picture.rgba.push_back(static_cast<float>(i) * 0.37F);
  image::write_exr((folder / "a.exr").string(), picture);
  image::write_pfm((folder / "a.pfm").string(), picture);
  image::write_png((folder / "a.png").string(), picture);
  for (const char* name : {"a.exr", "a.pfm", "a.png"}) texts[name] = bytes_of(folder / name);
  for (const image::Image& read :
       {image::read_exr((folder / "a.exr").string()), image::read_pfm((folder / "a.pfm").string())}) {
    texts["pictures that were read"].append(reinterpret_cast<const char*>(read.rgba.data()),
                                            read.rgba.size() * sizeof(float));
  }
  texts["comments of a picture"] = image::attributes::comments_text("1.2.3", 1234.5);
  std::string header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1.5\n\n-Y 1 +X 2\n";
  std::ofstream(folder / "a.hdr", std::ios::binary) << header << std::string("\x80\x40\x20\x81\x80\x80\x80\x82", 8);
  for (const char* name : {"a.hdr", "a.exr"}) {
    const light::EnvironmentPixels pixels = light::read_environment((folder / name).string());
    texts["environments"] += std::to_string(pixels.width) + "x" + std::to_string(pixels.height) + " " +
                             std::to_string(std::lround(1e6 * double{pixels.values[1].x})) + "\n";
  }
}

demo::RenderOptions parsed(const fs::path& folder) {
  std::ostringstream out;
  const auto options = demo::parse_render_options(
      {"--size", "1280x720", "--spp", "1000", "--noise-target", "1.25", "--density-scale", "0.125", "--camera",
       "1.5,2000,3 0,0,0 35.5", (folder / "fields.vdb").string(), "-o", (folder / "o.png").string()},
      out);
  if (!options) throw std::logic_error("no options");
  return *options;
}

void add_scenes(Texts& texts, const fs::path& folder, const demo::RenderOptions& options) {
  texts["a scene file"] = demo::scene_text(options.scene, (folder / "s.json").string());
  demo::save_scene(options.scene, (folder / "s.json").string());
  texts["a scene file that was read"] =
      demo::scene_text(demo::load_scene((folder / "s.json").string()), (folder / "s.json").string());
  for (const auto& [name, value] : demo::checkpoint_of(options)) texts["a checkpoint"] += name + "=" + value + "\n";
  demo::Checkpoint checkpoint{demo::checkpoint_of(options), "driver", std::vector<std::byte>(2000)};
  demo::write_checkpoint((folder / "c.ck").string(), checkpoint);
  texts["a checkpoint's file"] = bytes_of(folder / "c.ck");
  texts["a checkpoint that was read"] =
      std::to_string(demo::read_checkpoint((folder / "c.ck").string(), checkpoint.of)->accumulation.size());
  texts["memory"] = demo::needs_text(options) + (demo::available_memory() ? "" : ", unknown");
}

Texts all_texts(const fs::path& folder, const demo::RenderOptions& options) {
  Texts texts;
  add_volumes(texts, folder);
  add_arrays(texts, folder);
  add_surfaces(texts);
  add_pictures(texts, folder);
  add_scenes(texts, folder, options);
  return texts;
}

void expect_same(const Texts& texts, const Texts& wanted) {
  ASSERT_EQ(texts.size(), wanted.size());
  for (const auto& [name, text] : wanted) EXPECT_EQ(texts.at(name), text) << name;
}

class Locales : public ::testing::Test {
 protected:
  void SetUp() override {
    openvdb::initialize();
    options_ = parsed(folder_.path());
    classic_ = all_texts(folder_.path(), options_);
  }

  test::Folder folder_;
  demo::RenderOptions options_;
  Texts classic_;
};

TEST_F(Locales, CAndCppLocalesDoNotAffectFiles) {
  const HostileLocales hostile(true);
  if (!hostile.has_comma()) GTEST_SKIP() << "SKIPPED: no locale of C with a decimal comma is here";
  expect_same(all_texts(folder_.path(), options_), classic_);
}

TEST_F(Locales, CppLocaleDoesNotAffectFiles) {
  const HostileLocales hostile(false);
  std::ostringstream grouped;
  grouped << 1234567;
  ASSERT_EQ(grouped.str(), "1.234.567");
  const Texts texts = all_texts(folder_.path(), parsed(folder_.path()));
  expect_same(texts, classic_);

  EXPECT_EQ(texts.at("a.nrrd").rfind("225 500 0 0 0 1250 0 0 0 1234500 ", 0), 0U) << texts.at("a.nrrd");
  EXPECT_EQ(texts.at("a.vti").rfind("200 250 0 0 0 1000 0 0 0 1500 500 1234500 0", 0), 0U) << texts.at("a.vti");
  EXPECT_EQ(texts.at("a.raw").rfind("200 500 0 0 0 1250 0 0 0 1234500 125 0 0", 0), 0U) << texts.at("a.raw");
  EXPECT_NE(texts.at("a.tif").find("1234500"), std::string::npos) << texts.at("a.tif");
  EXPECT_EQ(texts.at("a.cube").rfind("250 500 250 100 ", 0), 0U) << texts.at("a.cube");
  EXPECT_EQ(texts.at("metadata voxels"), "363344");
  EXPECT_EQ(texts.at("metadata count"), "-1234567");
  EXPECT_EQ(texts.at("metadata scale"), "1234.5");
  EXPECT_EQ(texts.at("metadata box"), "[1000, 20, -30000]");
  EXPECT_EQ(texts.at("metadata size"), "[0.5, 1e+09, 2]");
  EXPECT_HAS(texts.at("metadata frame"), "[[1.500000, 0.000000, 0.000000, 0.000000],\n [");
  EXPECT_HAS(texts.at("remarks on a volume"), "has values above 20");
  EXPECT_HAS(texts.at("warnings of a volume"), " above 65504 voxels per second");
  EXPECT_HAS(texts.at("a refused volume"), "span 4000000001 x 1 x 1 voxels");
  EXPECT_HAS(texts.at("warnings of a model"), "emissiveFactor[1] is 3.5, more than the glTF limit of 1");
  EXPECT_HAS(texts.at("a scene file"), "0.125");
  EXPECT_HAS(texts.at("comments of a picture"), "1234.5 samples");
}

}  // namespace
