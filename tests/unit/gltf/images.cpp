// JPEG textures and URIs of glTF files.

#include <gtest/gtest.h>

#include <cstdio>
// After <cstdio>, which it needs.
#include <jpeglib.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/one_line.hpp"
#include "support/folder.hpp"
#include "support/gltf_import.hpp"
#include "support/gltf_model.hpp"
#include "support/gltf_seeds.hpp"
#include "surface/gltf_uri.hpp"

namespace cumulet::surface {
namespace {

namespace fs = std::filesystem;
using test::Bytes;
using test::GltfModel;
using test::has;
using test::imported;
using test::json;
using test::Lines;

struct Coding {
  J_COLOR_SPACE from = JCS_RGB;
  std::optional<J_COLOR_SPACE> to{};
  bool progressive = false;
  bool arithmetic = false;
  unsigned restart = 0;
  bool adobe = true;
  int sampling = 2;
};

/// side x side pixels of one color, with a dark square in the lower right quarter.
Bytes jpeg(std::uint32_t side, const std::vector<std::uint8_t>& color, const Coding& coding = {}) {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* packed = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &packed, &size);
  info.image_width = side;
  info.image_height = side;
  info.input_components = static_cast<int>(color.size());
  info.in_color_space = coding.from;
  jpeg_set_defaults(&info);
  if (coding.to) jpeg_set_colorspace(&info, *coding.to);
  jpeg_set_quality(&info, 95, TRUE);
  info.arith_code = coding.arithmetic ? TRUE : FALSE;
  info.restart_interval = coding.restart;
  if (!coding.adobe) info.write_Adobe_marker = FALSE;
  info.comp_info[0].h_samp_factor = coding.sampling;
  if (coding.progressive) jpeg_simple_progression(&info);
  jpeg_start_compress(&info, TRUE);
  for (std::uint32_t y = 0; y < side; ++y) {
    std::vector<std::uint8_t> row;
    for (std::uint32_t x = 0; x < side; ++x) {
      for (const std::uint8_t c : color) row.push_back(x >= side / 2 && y >= side / 2 ? c / 2 : c);
    }
    JSAMPROW rows = row.data();
    jpeg_write_scanlines(&info, &rows, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  Bytes file(packed, packed + size);
  std::free(packed);
  return file;
}

/// Inserts bytes before the last `back` bytes of a file, which end with the end marker.
Bytes with_tail(Bytes file, const Bytes& bytes, std::ptrdiff_t back = 2) {
  file.insert(file.end() - back, bytes.begin(), bytes.end());
  return file;
}

GltfModel textured(const json& image) {
  GltfModel model;
  model.add("images", image);
  model.add("textures", {{"source", 0}});
  model.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  model.show({{"attributes", {{"POSITION", model.triangle()}}}, {"material", 0}});
  return model;
}

struct Read {
  std::optional<Image> image;
  std::vector<std::string> warnings;
};

Read read(const Bytes& bytes) {
  Lines lines;
  const ScenePtr scene = imported(textured({{"uri", "data:image/jpeg;base64," + test::base64(bytes)}}), lines.log);
  Read read{{}, lines.warnings};
  if (!scene->images.empty()) read.image = scene->images[0];
  return read;
}

void expect_color(const Read& read, std::uint32_t x, std::uint32_t y, int r, int g, int b) {
  ASSERT_TRUE(read.image) << (read.warnings.empty() ? "" : read.warnings[0]);
  const std::uint8_t* at = &read.image->rgba[std::size_t{4} * (y * read.image->width + x)];
  EXPECT_NEAR(at[0], r, 4);
  EXPECT_NEAR(at[1], g, 4);
  EXPECT_NEAR(at[2], b, 4);
  EXPECT_EQ(at[3], 255);
}

TEST(GltfJpeg, ReadsWhatLibjpegReads) {
  for (const Coding& coding :
       {Coding{}, Coding{.progressive = true}, Coding{.progressive = true, .restart = 2}, Coding{.restart = 1},
        Coding{.arithmetic = true}, Coding{.sampling = 1}, Coding{.sampling = 4}, Coding{.to = JCS_RGB}}) {
    const Bytes whole = jpeg(64, {200, 40, 90}, coding);
    Bytes padded = whole;  // fill bytes before a marker
    padded.insert(padded.begin() + 2, {0xFF, 0xFF, 0xFF});
    Bytes restart = whole;  // a marker without a length in the header
    restart.insert(restart.begin() + 2, {0xFF, 0xD0});
    Bytes temporary = whole;
    temporary.insert(temporary.begin() + 2, {0xFF, 0x01});
    Bytes after = whole;
    after.insert(after.end(), 300, 0x55);
    std::vector<Bytes> files = {whole, padded, restart, temporary, after};
    // Arithmetic coding may omit the last bytes, so inserted bytes would be read as data.
    if (!coding.arithmetic) {
      for (const Bytes& tail :
           {Bytes{0xFF, 0xFF, 0xFF}, Bytes{0xFF, 0xD0}, Bytes{0xFF, 0x00}, Bytes{1, 2, 3, 4, 5, 6, 7}, Bytes(16, 0)}) {
        files.push_back(with_tail(whole, tail));
      }
    }
    for (const Bytes& file : files) {
      const Read got = read(file);
      expect_color(got, 5, 5, 200, 40, 90);
      expect_color(got, 60, 60, 100, 20, 45);
      EXPECT_TRUE(got.warnings.empty()) << got.warnings.at(0);
    }
  }
}

TEST(GltfJpeg, GrayAndCmykAreConverted) {
  expect_color(read(jpeg(32, {120}, {.from = JCS_GRAYSCALE})), 3, 3, 120, 120, 120);
  // Adobe's programs store complements.
  for (const J_COLOR_SPACE space : {JCS_CMYK, JCS_YCCK}) {
    expect_color(read(jpeg(32, {200, 40, 90, 255}, {.from = JCS_CMYK, .to = space, .sampling = 1})), 3, 3, 200, 40, 90);
    expect_color(read(jpeg(32, {200, 40, 90, 128}, {.from = JCS_CMYK, .to = space, .sampling = 1})), 3, 3, 100, 20, 45);
  }
  expect_color(read(jpeg(32, {55, 215, 165, 0}, {.from = JCS_CMYK, .to = JCS_CMYK, .adobe = false, .sampling = 1})), 3,
               3, 200, 40, 90);
}

TEST(GltfJpeg, DamagedImageIsReportedAndPartlyShown) {
  for (const Coding& coding : {Coding{}, Coding{.progressive = true}}) {
    const Bytes whole = jpeg(64, {200, 40, 90}, coding);
    // If only the end marker is missing, all pixels are read.
    const Read endless = read(Bytes(whole.begin(), whole.end() - 2));
    expect_color(endless, 5, 5, 200, 40, 90);
    EXPECT_EQ(endless.warnings.size(), coding.progressive ? 1U : 0U);
    bool damaged = false;
    for (std::size_t size = 0; size < whole.size() - 2; size += size < 40 ? 1 : 13) {
      const Read got = read(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)));
      if (got.image && got.warnings.empty()) continue;  // the cut is after the last needed block
      ASSERT_EQ(got.warnings.size(), 1U) << size;
      EXPECT_TRUE(has(got.warnings[0], got.image ? "image 0 is damaged and partly shown: " : "image 0 is ignored: "))
          << got.warnings[0];
      damaged |= got.image.has_value();
    }
    EXPECT_TRUE(damaged);
  }
  Bytes deep = jpeg(32, {200, 40, 90});
  for (std::size_t i = 0; i + 1 < deep.size(); ++i) {
    if (deep[i] == 0xFF && deep[i + 1] == 0xC0) deep[i + 4] = 12;
  }
  const Read got = read(deep);
  EXPECT_FALSE(got.image);
  ASSERT_EQ(got.warnings.size(), 1U);
  EXPECT_TRUE(has(got.warnings[0], "Unsupported JPEG data precision 12")) << got.warnings[0];
}

TEST(GltfJpeg, RandomBytesAreReadOrRejected) {
  const Bytes whole = jpeg(32, {200, 40, 90}, {.progressive = true, .restart = 1});
  std::uint32_t random = 1;
  for (int i = 0; i < 300; ++i) {
    Bytes file = whole;
    for (int k = 0; k < 3; ++k) {
      random = random * 1664525U + 1013904223U;
      file[2 + (random >> 8U) % (file.size() - 2)] = static_cast<std::uint8_t>(random >> 24U);
    }
    const Read got = read(file);
    EXPECT_TRUE(got.image || got.warnings.size() == 1) << i;
  }
}

TEST(GltfJpeg, ReadsTheSharedTestImages) {
  const fs::path trials = fs::path(CUMULET_SHARED_DATA) / "trials" / "jpeg-tails";
  if (!fs::exists(trials)) GTEST_SKIP() << "no shared data";
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(trials)) {
    if (entry.path().extension() != ".gltf") continue;
    Lines lines;
    const ScenePtr scene = import_gltf(entry.path().string(), lines.log);
    EXPECT_EQ(scene->images.size(), 1U) << entry.path();
    EXPECT_TRUE(lines.warnings.empty()) << entry.path() << lines.warnings.at(0);
    ++count;
  }
  EXPECT_GE(count, 12U);
}

TEST(GltfUris, AreDecodedAsUrlsThenAsPlainNames) {
  using detail::paths_of;
  using Paths = std::vector<std::string>;
  EXPECT_EQ(paths_of("a.png"), Paths{"a.png"});
  EXPECT_EQ(paths_of("a%20b.png"), (Paths{"a b.png", "a%20b.png"}));
  EXPECT_EQ(paths_of("textures\\a.png"), (Paths{"textures\\a.png", "textures/a.png"}));
  EXPECT_EQ(paths_of("a.png?v=1#x"), (Paths{"a.png", "a.png?v=1", "a.png?v=1#x"}));
  EXPECT_EQ(paths_of("a%3Fb.png"), (Paths{"a?b.png", "a%3Fb.png"}));
  EXPECT_EQ(paths_of("C:\\a.png"), (Paths{"C:\\a.png", "C:/a.png"}));
}

class GltfFolder : public ::testing::Test {
 protected:
  void write(const fs::path& name, const Bytes& bytes) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  /// The red value of the texture's first pixel; nullopt if the texture is left out.
  std::optional<int> red(const std::string& uri) {
    lines_.warnings.clear();
    const ScenePtr scene = import_gltf(textured({{"uri", uri}}).gltf(), "made.gltf", folder_.path(), lines_.log);
    if (scene->images.empty()) return std::nullopt;
    return scene->images[0].rgba.at(0);
  }
  static Bytes png(std::uint8_t red) { return test::png(1, 1, 8, 2, {red, 0, 0}); }

  test::Folder folder_;
  Lines lines_;
};

TEST_F(GltfFolder, FilesAreFoundByUriAndByName) {
  write("textures/x.png", png(1));
  write("a b.png", png(2));
  write("c%20d.png", png(3));
  write("é.png", png(4));
  write("e?f.png", png(5));
  write("shot:1.png", png(6));
  write("back\\slash.png", png(7));
  write("plus+and#.png", png(8));
  write("100%.png", png(9));
  EXPECT_EQ(red("textures/x.png"), 1);
  EXPECT_EQ(red("./textures/../textures/x.png"), 1);
  EXPECT_EQ(red("textures\\x.png"), 1);
  EXPECT_EQ(red("textures%5Cx.png"), 1);
  EXPECT_EQ(red(".\\textures\\x.png"), 1);
  EXPECT_EQ(red("textures/x.png?version=2"), 1);
  EXPECT_EQ(red("textures/x.png#part"), 1);
  EXPECT_EQ(red("textures%2Fx.png?a=b#c"), 1);
  EXPECT_EQ(red("a%20b.png"), 2);
  EXPECT_EQ(red("a b.png"), 2);
  EXPECT_EQ(red("c%20d.png"), 3);
  EXPECT_EQ(red("c%2520d.png"), 3);
  EXPECT_EQ(red("%C3%A9.png"), 4);
  EXPECT_EQ(red("é.png"), 4);
  EXPECT_EQ(red("e?f.png"), 5);
  EXPECT_EQ(red("e%3ff.png"), 5);
  EXPECT_EQ(red("shot%3A1.png"), 6);
  EXPECT_EQ(red("shot:1.png"), 6);
  EXPECT_EQ(red("back\\slash.png"), 7);
  EXPECT_EQ(red("plus+and#.png"), 8);
  EXPECT_EQ(red("100%.png"), 9);
  for (const auto& [uri, cause] :
       std::vector<std::pair<std::string, std::string>>{{"none.png", "none.png: no such file"},
                                                        {"none%20there.png?q", "none%20there.png?q: no such file"},
                                                        {"textures", "textures: is not a file"},
                                                        {"/etc/passwd", "not a relative path"},
                                                        {"%2Fetc/passwd", "not a relative path"},
                                                        {"\\\\server\\x.png", "not a relative path"},
                                                        {"C:\\x.png", "not a relative path"},
                                                        {"http://example.org/x.png", "not a relative path"},
                                                        {"a%00b", "not a relative path"},
                                                        {std::string(9000, 'a'), "no such file"}}) {
    EXPECT_EQ(red(uri), std::nullopt) << uri;
    ASSERT_EQ(lines_.warnings.size(), 1U) << uri;
    EXPECT_TRUE(has(lines_.warnings[0], cause)) << lines_.warnings[0];
  }
}

TEST_F(GltfFolder, DataUrisOfAllKindsHoldBytes) {
  std::string coded = test::base64(png(0xF7));
  std::string wrapped;
  for (std::size_t i = 0; i < coded.size(); i += 10) wrapped += coded.substr(i, 10) + "\r\n ";
  std::string percent;
  for (const char c : coded) {
    if (c == '+') {
      percent += "%2B";
    } else if (c == '/') {
      percent += "%2f";
    } else if (c == '=') {
      percent += "%3D";
    } else {
      percent += c;
    }
  }
  std::string unpadded = coded;
  while (unpadded.ends_with('=')) unpadded.pop_back();
  for (const std::string& uri :
       {"data:image/png;base64," + coded, "data:image/png;base64," + wrapped, "data:image/png;base64," + percent,
        "data:image/png;base64," + unpadded, "DATA:image/png;BASE64," + coded,
        "data:image/png;charset=utf-8;base64," + coded, "data:image/png;name=\"a,b;c\";base64," + coded,
        "data:;base64 ," + coded, "data:image/png;base64;x=y," + coded,
        "data:image/png;base64," + coded.substr(0, 8) + "%0D%0A" + coded.substr(8)}) {
    EXPECT_EQ(red(uri), 0xF7) << uri;
    EXPECT_TRUE(lines_.warnings.empty());
  }
  for (const auto& [uri, cause] :
       std::vector<std::pair<std::string, std::string>>{{"data:image/png;base64", "no data"},
                                                        {"data:;base64,AA=A", "not base64"},
                                                        {"data:;base64,%FF%00", "not base64"},
                                                        {"data:;base64,", "is neither PNG"}}) {
    EXPECT_EQ(red(uri), std::nullopt) << uri;
    ASSERT_EQ(lines_.warnings.size(), 1U);
    EXPECT_TRUE(has(lines_.warnings[0], cause)) << lines_.warnings[0];
  }
}

TEST(GltfCounts, EmptyAccessorDropsItsPrimitive) {
  const auto two = [](const std::function<void(GltfModel&)>& change) {
    GltfModel model = test::triangle_model();
    change(model);
    model.show({{"attributes", {{"POSITION", model.triangle()}}}});
    return model;
  };
  const auto primitive = [](GltfModel& m) -> json& { return m.root["meshes"][0]["primitives"][0]; };
  const json nothing = {{"componentType", 5126}, {"count", 0}, {"type", "VEC3"}};
  const json no_index = {{"componentType", 5125}, {"count", 0}, {"type", "SCALAR"}};
  for (const auto& change : std::vector<std::function<void(GltfModel&)>>{
           [&](GltfModel& m) { m.root["accessors"][0]["count"] = 0; },
           [&](GltfModel& m) { primitive(m)["attributes"]["POSITION"] = m.add("accessors", nothing); },
           [&](GltfModel& m) { primitive(m)["attributes"]["NORMAL"] = m.add("accessors", nothing); },
           [&](GltfModel& m) { primitive(m)["indices"] = m.add("accessors", no_index); },
           [&](GltfModel& m) {
             primitive(m)["targets"] = json::array({{{"POSITION", m.add("accessors", nothing)}}});
           }}) {
    Lines lines;
    EXPECT_EQ(imported(two(change), lines.log)->triangle_count(), 1U);
    ASSERT_EQ(lines.warnings.size(), 1U);
    EXPECT_TRUE(has(lines.warnings[0], "1 primitives are ignored: an accessor has a count of 0")) << lines.warnings[0];
  }
  Lines lines;
  const GltfModel moved = two([&](GltfModel& m) {
    const int none = m.add("accessors", nothing);
    m.add("animations", {{"samplers", json::array({{{"input", none}, {"output", none}}})},
                         {"channels", json::array({{{"sampler", 0}, {"target", {{"node", 0}, {"path", "scale"}}}}})}});
    m.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = none;
  });
  EXPECT_EQ(imported(moved, lines.log)->triangle_count(), 1U);
  ASSERT_EQ(lines.warnings.size(), 2U);
  EXPECT_TRUE(has(lines.warnings[0], "1 skins and animation channels are ignored: an accessor"));
  EXPECT_TRUE(has(lines.warnings[1], "1 nodes are ignored: an accessor of their instances"));
}

TEST(OneLine, EscapesRawBytes) {
  EXPECT_EQ(one_line(" two\r\n lines\t"), "two lines");
  EXPECT_EQ(one_line("\x1b[31mred\x7f!"), "[31mred !");
  EXPECT_EQ(one_line("na\xc3\xafve \xe2\x82\xac \xf0\x9f\x8c\x8b"), "na\xc3\xafve \xe2\x82\xac \xf0\x9f\x8c\x8b");
  EXPECT_EQ(one_line("a\xff\xfe"), "a\\xff\\xfe");
  EXPECT_EQ(one_line("cut \xe2\x82"), "cut \\xe2\\x82");
  EXPECT_EQ(one_line("\xc0\xaf \xed\xa0\x80 \xf5"), "\\xc0\\xaf \\xed\\xa0\\x80 \\xf5");
  EXPECT_EQ(one_line("a\xc2\x9b\xe2\x80\xa8z"), "a z");
  EXPECT_EQ(one_line("abcdef", 3), "abc...");
  EXPECT_EQ(one_line("abc", 3), "abc");
  EXPECT_EQ(one_line("a\xe2\x82\xac\xe2\x82\xac", 3), "a\xe2\x82\xac...");
}

TEST(GltfJson, ErrorsEscapeRawBytes) {
  for (const std::string& text :
       {std::string("\x89PNG\r\n\x1a\n"), std::string("{\"asset\": \"\xff\xfe\x01\"}"), std::string("\x01\x02\xFF\xFE"),
        std::string("{\"a\x1b[2J\": 1}"), std::string("{\"a\": \x9b}"), std::string("{\"a\": tru\xe2\x82")}) {
    const std::string line = test::refused(Bytes(text.begin(), text.end()));
    EXPECT_TRUE(has(line, "is not JSON")) << line;
    for (const char c : line) EXPECT_TRUE(c >= ' ' && c < '\x7f') << line;
  }
}

}  // namespace
}  // namespace cumulet::surface
