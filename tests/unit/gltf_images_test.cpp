// URIs of glTF files, and accessors without elements.

#include <gtest/gtest.h>

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

GltfModel textured(const json& image) {
  GltfModel model;
  model.add("images", image);
  model.add("textures", {{"source", 0}});
  model.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  model.show({{"attributes", {{"POSITION", model.triangle()}}}, {"material", 0}});
  return model;
}

TEST(GltfUris, AreUrlReferencesThenNames) {
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
  /// The red of the texture's first pixel; none: it is left out.
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

TEST(GltfCounts, AnAccessorOfNoElementsLosesWhatReadsIt) {
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
    EXPECT_TRUE(has(lines.warnings[0], "1 primitives are not drawn: an accessor of theirs has a count of 0"))
        << lines.warnings[0];
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
  EXPECT_TRUE(has(lines.warnings[0], "1 skins and animation channels are as at rest: an accessor"));
  EXPECT_TRUE(has(lines.warnings[1], "1 nodes are not drawn: an accessor of their instances"));
}

TEST(OneLine, HasNoRawBytes) {
  EXPECT_EQ(one_line(" two\r\n lines\t"), "two lines");
  EXPECT_EQ(one_line("\x1b[31mred\x7f!"), "[31mred !");
  EXPECT_EQ(one_line("na\xc3\xafve \xe2\x82\xac \xf0\x9f\x8c\x8b"), "na\xc3\xafve \xe2\x82\xac \xf0\x9f\x8c\x8b");
  EXPECT_EQ(one_line("a\xff\xfe"), "a\\xff\\xfe");
  EXPECT_EQ(one_line("cut \xe2\x82"), "cut \\xe2\\x82");
  EXPECT_EQ(one_line("\xc0\xaf \xed\xa0\x80 \xf5"), "\\xc0\\xaf \\xed\\xa0\\x80 \\xf5");
  EXPECT_EQ(one_line("a\xc2\x9b\xe2\x80\xa8z"), "a z");
  EXPECT_EQ(one_line("abcdef", 3), "abc...");
  EXPECT_EQ(one_line("a\xe2\x82\xac\xe2\x82\xac", 3), "a\xe2\x82\xac...");
}

TEST(GltfJson, ErrorsShowNoRawBytes) {
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
