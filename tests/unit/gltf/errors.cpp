// The glTF importer with invalid, hostile and mutated files.

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "base/error.hpp"
#include "support/gltf_check.hpp"
#include "support/gltf_import.hpp"
#include "support/gltf_model.hpp"
#include "support/gltf_seeds.hpp"
#include "surface/gltf_import.hpp"

namespace cumulet::surface {
namespace {

using test::Bytes;
using test::GltfModel;
using test::has;
using test::imported;
using test::json;
using test::Lines;
using test::refused;
using test::triangle_model;

TEST(Gltf, UnknownRequiredExtensionsAreRejectedByName) {
  GltfModel model = triangle_model();
  model.root["extensionsRequired"] = {"KHR_texture_transform", "VENDOR_secret"};
  EXPECT_TRUE(has(refused(model, ErrorCode::unsupported), "VENDOR_secret"));
  model.root["extensionsRequired"] = json::array({"KHR_texture_basisu"});
  EXPECT_TRUE(has(refused(model, ErrorCode::unsupported), "KHR_texture_basisu"));
  model.root.erase("extensionsRequired");
  model.root["extensionsUsed"] = {"VENDOR_secret", "KHR_materials_ior", "KHR_materials_diffuse_transmission"};
  Lines lines;
  imported(model, lines.log);
  ASSERT_EQ(lines.warnings.size(), 1U);
  EXPECT_TRUE(has(lines.warnings[0], "KHR_materials_diffuse_transmission, VENDOR_secret")) << lines.warnings[0];
  EXPECT_FALSE(has(lines.warnings[0], "ior"));
}

TEST(Gltf, UnreadableTexturesAreDroppedWithAWarning) {
  const auto with = [](const json& texture, const json& image) {
    GltfModel model;
    if (!image.is_null()) model.add("images", image);
    model.add("textures", texture);
    model.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
    model.show({{"attributes", {{"POSITION", model.triangle()}}}, {"material", 0}});
    return model;
  };
  const auto line = [](const GltfModel& model) {
    Lines lines;
    const ScenePtr scene = imported(model, lines.log);
    EXPECT_EQ(scene->materials[0].base_color_texture.texture, -1);
    EXPECT_TRUE(scene->images.empty());
    EXPECT_EQ(lines.warnings.size(), 1U);
    return lines.warnings.empty() ? "" : lines.warnings[0];
  };
  const auto embedded = [&](const Bytes& bytes) {
    return with({{"source", 0}}, {{"uri", "data:image/png;base64," + test::base64(bytes)}});
  };
  EXPECT_TRUE(
      has(line(with({{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}}, nullptr)), "KHR_texture_basisu"));
  EXPECT_TRUE(has(line(with({{"source", 0}}, {{"uri", "none.png"}})), "none.png: no such file"));
  EXPECT_TRUE(has(line(with({{"source", 0}}, {{"name", "empty"}})), "neither a URI nor a buffer view"));
  EXPECT_TRUE(has(line(embedded({0xAB, 'K', 'T', 'X', ' ', '2', '0'})), "KTX2"));
  EXPECT_TRUE(has(line(embedded({'G', 'I', 'F', '8', '9', 'a', 0, 0, 0, 0})), "neither PNG, JPEG nor WebP"));
  EXPECT_TRUE(has(line(embedded(test::png(0, 1, 8, 2, {}))), "no pixels"));
  EXPECT_TRUE(has(line(embedded(test::png(1, 0x7FFFFFFF, 8, 2, {0, 0, 0}))), "exceed the limit"));
  EXPECT_TRUE(has(line(embedded(test::png(16000, 16000, 8, 6, {0, 0, 0, 0}))), "do not fit into its"));
  Bytes cut = test::png(2, 2, 8, 2, Bytes(12));
  cut.resize(50);
  EXPECT_TRUE(has(line(embedded(cut)), "cannot be decoded"));
  EXPECT_TRUE(has(line(embedded({0xFF, 0xD8, 0xFF, 0xE0, 0, 16})), "is a JPEG that cannot be read"));
  // uv set 2.
  GltfModel far = embedded(test::png(1, 1, 8, 2, {1, 2, 3}));
  far.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 2;
  EXPECT_TRUE(has(line(far), "TEXCOORD_2"));
  // An index out of range is an error.
  far.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 1;
  EXPECT_TRUE(has(refused(far), "there is no texture 1"));
  EXPECT_TRUE(has(refused(with({{"source", 3}}, nullptr)), "there is no image 3"));
  EXPECT_TRUE(has(refused(with({{"source", 0}, {"sampler", 1}}, {{"bufferView", 0}})), "there is no sampler 1"));
}

struct Hostile {
  const char* name;
  std::function<void(GltfModel&)> change;
  const char* cause;
};

TEST(Gltf, InvalidFilesGiveAOneLineError) {
  const auto accessor = [](GltfModel& m) -> json& { return m.root["accessors"][0]; };
  const auto primitive = [](GltfModel& m) -> json& { return m.root["meshes"][0]["primitives"][0]; };
  const Hostile cases[] = {
      {"no asset", [](GltfModel& m) { m.root.erase("asset"); }, "asset.version is missing"},
      {"asset is no object", [](GltfModel& m) { m.root["asset"] = 3; }, "asset is not an object"},
      {"nodes is no array", [](GltfModel& m) { m.root["nodes"] = json::object(); }, "nodes is not an array"},
      {"a node is no object", [](GltfModel& m) { m.root["nodes"][0] = 1; }, "nodes[0] is not an object"},
      {"negative index", [&](GltfModel& m) { primitive(m)["attributes"]["POSITION"] = -1; }, "is not an index"},
      {"index with a fraction", [&](GltfModel& m) { primitive(m)["attributes"]["POSITION"] = 0.5; }, "is not an index"},
      {"huge index", [&](GltfModel& m) { primitive(m)["attributes"]["POSITION"] = 5e9; }, "is not an index"},
      {"mode", [&](GltfModel& m) { primitive(m)["mode"] = 7; }, "mode 7 is unknown"},
      {"material", [&](GltfModel& m) { primitive(m)["material"] = 0; }, "there is no material 0"},
      {"no such accessor", [&](GltfModel& m) { primitive(m)["attributes"]["POSITION"] = 9; }, "there is no accessor 9"},
      {"no such indices", [&](GltfModel& m) { primitive(m)["indices"] = 9; }, "there is no accessor 9"},
      {"indices are floats", [&](GltfModel& m) { primitive(m)["indices"] = 0; }, "does not contain unsigned integers"},
      {"count beyond the view", [&](GltfModel& m) { accessor(m)["count"] = 4; }, "exceeds the 36 bytes"},
      {"count of 2^52", [&](GltfModel& m) { accessor(m)["count"] = std::uint64_t{1} << 52U; }, "2^32"},
      {"count of 2^60", [&](GltfModel& m) { accessor(m)["count"] = std::uint64_t{1} << 60U; }, "is not a size"},
      {"count of a billion without bytes",
       [&](GltfModel& m) {
         accessor(m).erase("bufferView");
         accessor(m)["count"] = 1000000000;
       },
       "without a buffer view exceed the limit"},
      {"offset", [&](GltfModel& m) { accessor(m)["byteOffset"] = (std::uint64_t{1} << 53U) - 1; }, "exceeds the "},
      {"element type", [&](GltfModel& m) { accessor(m)["type"] = "VEC2"; }, "wrong type of element"},
      {"component type", [&](GltfModel& m) { accessor(m)["componentType"] = 5124; }, "component type 5124"},
      {"double", [&](GltfModel& m) { accessor(m)["componentType"] = 5130; }, "component type 5130"},
      {"no such view", [&](GltfModel& m) { accessor(m)["bufferView"] = 1; }, "there is no buffer view 1"},
      {"view beyond the buffer", [](GltfModel& m) { m.root["bufferViews"][0]["byteOffset"] = 4; }, "exceeds the "},
      {"no such buffer", [](GltfModel& m) { m.root["bufferViews"][0]["buffer"] = 1; }, "there is no buffer 1"},
      {"stride", [](GltfModel& m) { m.root["bufferViews"][0]["byteStride"] = 8; }, "is too small"},
      {"stride of 2^31", [](GltfModel& m) { m.root["bufferViews"][0]["byteStride"] = 2147483648; }, "byteStride"},
      {"sparse beyond",
       [&](GltfModel& m) {
         accessor(m)["sparse"] = {{"count", 1},
                                  {"indices", {{"bufferView", 0}, {"byteOffset", 36}, {"componentType", 5125}}},
                                  {"values", {{"bufferView", 0}}}};
       },
       "exceeds the "},
      {"sparse index beyond",
       [&](GltfModel& m) {
         accessor(m)["sparse"] = {{"count", 1},
                                  {"indices", {{"bufferView", 0}, {"byteOffset", 12}, {"componentType", 5125}}},
                                  {"values", {{"bufferView", 0}}}};
       },
       "sparse indices"},
      {"sparse count",
       [&](GltfModel& m) {
         accessor(m)["sparse"] = {
             {"count", 99}, {"indices", {{"bufferView", 0}, {"componentType", 5125}}}, {"values", {{"bufferView", 0}}}};
       },
       "has malformed sparse storage"},
      {"its own child", [](GltfModel& m) { m.root["nodes"][0]["children"] = json::array({0}); }, "is its own ancestor"},
      {"two parents",
       [](GltfModel& m) {
         m.root["nodes"].push_back({{"children", json::array({0})}});
         m.root["nodes"].push_back({{"children", json::array({0})}});
       },
       "node 0 has two parents"},
      {"no such child", [](GltfModel& m) { m.root["nodes"][0]["children"] = json::array({7}); }, "there is no node 7"},
      {"no such mesh", [](GltfModel& m) { m.root["nodes"][0]["mesh"] = 7; }, "there is no mesh 7"},
      {"no such skin", [](GltfModel& m) { m.root["nodes"][0]["skin"] = 7; }, "there is no skin 7"},
      {"no such camera", [](GltfModel& m) { m.root["nodes"][0]["camera"] = 7; }, "there is no camera 7"},
      {"no such light", [](GltfModel& m) { m.root["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 7; },
       "there is no light 7"},
      {"matrix of 15", [](GltfModel& m) { m.root["nodes"][0]["matrix"] = std::vector<int>(15, 1); }, "16 numbers"},
      {"transform too large",
       [](GltfModel& m) {
         m.root["nodes"][0]["scale"] = {1e30, 1, 1};
       },
       "too large"},
      {"number beyond double", [](GltfModel& m) { m.root["nodes"][0]["scale"] = "@"; },
       "nodes[0].scale is not an array"},
      {"skin without joints",
       [](GltfModel& m) {
         m.add("skins", {{"joints", json::array()}});
       },
       "no joints"},
      {"joint",
       [](GltfModel& m) {
         m.add("skins", {{"joints", {5, 0}}});
       },
       "there is no node 5"},
      {"camera",
       [](GltfModel& m) {
         m.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", -1}, {"znear", 1}}}});
         m.root["nodes"][0]["camera"] = 0;
       },
       "malformed perspective"},
      {"animation of no node",
       [](GltfModel& m) {
         m.add("animations",
               {{"samplers", json::array({{{"input", 0}, {"output", 0}}})},
                {"channels", json::array({{{"sampler", 0}, {"target", {{"node", 5}, {"path", "scale"}}}}})}});
       },
       "there is no node 5"},
      {"animation of few keys",
       [](GltfModel& m) {
         const int input = m.scalars({0, 1, 2, 3});
         m.add("animations",
               {{"samplers", json::array({{{"input", input}, {"output", 0}}})},
                {"channels", json::array({{{"sampler", 0}, {"target", {{"node", 0}, {"path", "scale"}}}}})}});
       },
       "has 9 numbers, not 12"},
      {"times that fall",
       [](GltfModel& m) {
         const int input = m.scalars({0, 2, 1});
         m.add("animations",
               {{"samplers", json::array({{{"input", input}, {"output", 0}}})},
                {"channels", json::array({{{"sampler", 0}, {"target", {{"node", 0}, {"path", "scale"}}}}})}});
       },
       "times are not increasing"},
      {"version 1", [](GltfModel& m) { m.root["asset"]["version"] = "1.0"; }, "is glTF 1.0, not 2.0"},
      {"morph target of another size",
       [&](GltfModel& m) {
         primitive(m)["targets"] = json::array({{{"POSITION", m.vec3({0, 0, 0})}}});
       },
       "does not have one element per vertex"},
      {"attribute of another size",
       [&](GltfModel& m) {
         primitive(m)["attributes"]["NORMAL"] = m.vec3({0, 0, 1});
       },
       "has 1 elements for 3 vertices"},
      {"NaN",
       [&](GltfModel& m) {
         primitive(m)["attributes"]["POSITION"] = m.vec3({0, 0, 0, NAN, 0, 0, 0, 1, 0});
       },
       "POSITION is not finite"},
      {"infinity",
       [&](GltfModel& m) {
         primitive(m)["attributes"]["POSITION"] = m.vec3({0, 0, 0, INFINITY, 0, 0, 0, 1, 0});
       },
       "POSITION is not finite"},
      {"line breaks in names",
       [&](GltfModel& m) {
         m.root["materials"] = json::array({{{"alphaMode", "a\nb\r\n\tc"}}});
       },
       "\"a b c\" is unknown"},
  };
  for (const Hostile& hostile : cases) {
    SCOPED_TRACE(hostile.name);
    GltfModel model = triangle_model();
    hostile.change(model);
    const bool version = std::string_view(hostile.name) == "version 1";
    for (const Bytes& file : {model.gltf(), model.glb()}) {
      const std::string line = refused(file, version ? ErrorCode::unsupported : ErrorCode::file);
      EXPECT_TRUE(has(line, hostile.cause)) << line;
    }
  }
}

TEST(Gltf, InvalidContainersGiveAOneLineError) {
  const auto text = [](const std::string& content) { return Bytes(content.begin(), content.end()); };
  EXPECT_TRUE(has(refused(Bytes{}), "is empty"));
  EXPECT_TRUE(has(refused(text("{")), "is not JSON"));
  EXPECT_TRUE(has(refused(text("[]")), "JSON is not an object"));
  EXPECT_TRUE(has(refused(text("\x01\x02\xFF\xFE")), "is not JSON"));
  EXPECT_TRUE(has(refused(text(std::string(1000000, '['))), "nests deeper"));
  EXPECT_TRUE(has(refused(text(R"({"asset":{"version":"2.0"},"nodes":[{"scale":[1e999,1,1]}]})")), "is not JSON"));
  const Bytes whole = triangle_model().glb();
  for (std::size_t size = 0; size < whole.size(); size += size < 40 ? 1 : 7) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    refused(cut);
  }
  Bytes lengths = whole;
  lengths[12] = 0xFF;  // length of the JSON chunk
  lengths[15] = 0xFF;
  EXPECT_TRUE(has(refused(lengths), "ends within chunk 0"));
  Bytes swapped = whole;
  swapped[16] = 'X';
  EXPECT_TRUE(has(refused(swapped), "does not begin with a JSON chunk"));
  Bytes old = whole;
  old[4] = 1;
  EXPECT_TRUE(has(refused(old, ErrorCode::unsupported), "binary glTF 1"));
  // A byte order mark is accepted.
  Bytes marked = {0xEF, 0xBB, 0xBF};
  const Bytes plain = triangle_model().gltf();
  marked.insert(marked.end(), plain.begin(), plain.end());
  EXPECT_EQ(imported(marked)->triangle_count(), 1U);
}

TEST(Gltf, CompressedDataOfInvalidSizesIsRejected) {
  GltfModel huge = test::seed_meshopt();
  huge.root["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["count"] = 100000000;
  EXPECT_TRUE(has(refused(huge), "cannot hold 100000000 elements"));
  GltfModel odd = test::seed_meshopt();
  odd.root["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["byteStride"] = 6;
  EXPECT_TRUE(has(refused(odd), "EXT_meshopt_compression is malformed"));
  GltfModel cut = test::seed_meshopt();
  cut.root["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["byteLength"] = 20;
  EXPECT_TRUE(has(refused(cut), "cannot be decompressed"));
  GltfModel draco = test::seed_draco();
  draco.root["bufferViews"][0]["byteLength"] = 30;
  EXPECT_TRUE(has(refused(draco), "cannot be decompressed"));
}

TEST(Gltf, MissingDracoAttributesAreRejected) {
  GltfModel model = test::seed_draco();
  model.root["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 77;
  EXPECT_TRUE(has(refused(model), "there is no Draco attribute 77"));
}

TEST(Gltf, MemoryIsBounded) {
  // A thousand nodes with a mesh of 33 thousand vertices: 2.5 GiB of vertices from half a megabyte.
  GltfModel model;
  const test::Grid grid(180);
  const int mesh = model.add(
      "meshes",
      {{"primitives", json::array({{{"attributes", {{"POSITION", model.vec3(grid.positions)}}},
                                    {"indices", model.accessor<std::uint32_t>("SCALAR", 1, grid.indices)}}})}});
  for (int i = 0; i < 1000; ++i) model.add("nodes", {{"mesh", mesh}});
  GltfLimits limits;
  limits.memory = std::uint64_t{256} << 20U;
  EXPECT_TRUE(has(refused(model.glb(), ErrorCode::file, limits), "would need more than the 256 MiB"));
}

TEST(Gltf, CancelledImportsEnd) {
  Progress progress;
  progress.cancel();
  try {
    import_gltf(triangle_model().gltf(), "made.gltf", "", {}, &progress);
    FAIL() << "was imported";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
}

// --- mutations -------------------------------------------------------------------------------------------------------

/// Changes a file in one to four positions: bits, bytes, ranges, and numbers in its JSON.
Bytes mutated(const Bytes& from, std::mt19937& random) {
  constexpr const char* words[] = {"-1",   "0",    "1",     "2",     "255",  "65535", "4294967295", "9007199254740991",
                                   "1e38", "1e18", "-1e38", "0.5",   "null", "true",  "\"\"",       "[]",
                                   "{}",   "5120", "5126",  "[1,2]", "64",   "3"};
  Bytes bytes = from;
  const auto below = [&random](std::size_t n) { return n == 0 ? 0 : random() % n; };
  for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
    if (bytes.size() < 8) break;
    const auto at = static_cast<std::ptrdiff_t>(below(bytes.size()));
    switch (below(6)) {
      case 0:
        bytes[static_cast<std::size_t>(at)] ^= static_cast<std::uint8_t>(1U << below(8));
        break;
      case 1:
        bytes[static_cast<std::size_t>(at)] = static_cast<std::uint8_t>(random());
        break;
      case 2:
        bytes.resize(static_cast<std::size_t>(at));
        break;
      case 3: {  // overwrites a range with another
        const std::size_t length = 1 + below(16);
        const std::size_t source = below(bytes.size());
        for (std::size_t k = 0; k < length; ++k) {
          if (static_cast<std::size_t>(at) + k < bytes.size() && source + k < bytes.size()) {
            bytes[static_cast<std::size_t>(at) + k] = bytes[source + k];
          }
        }
        break;
      }
      default: {  // replaces the next number by another of the same length, padded with blanks
        auto digit = std::find_if(bytes.begin() + at, bytes.end(), [](std::uint8_t c) { return c >= '0' && c <= '9'; });
        auto end = std::find_if(digit, bytes.end(), [](std::uint8_t c) { return c < '0' || c > '9'; });
        const std::string word = words[below(std::size(words))];
        const auto offset = digit - bytes.begin();
        const auto length = end - digit;
        if (word.size() <= static_cast<std::size_t>(length)) {
          for (std::ptrdiff_t k = 0; k < length; ++k) {
            bytes[static_cast<std::size_t>(offset + k)] =
                static_cast<std::size_t>(k) < word.size() ? static_cast<std::uint8_t>(word[static_cast<std::size_t>(k)])
                                                          : ' ';
          }
        } else if (bytes[0] == '{') {  // text files may grow, because they store no length
          bytes.erase(digit, end);
          bytes.insert(bytes.begin() + offset, word.begin(), word.end());
        }
        break;
      }
    }
  }
  return bytes;
}

TEST(Gltf, MutatedFilesAreImportedOrGiveAOneLineError) {
  const GltfModel seeds[] = {test::seed_materials(), test::seed_animated(),
                             test::seed_draco(),     test::seed_meshopt(),
                             triangle_model(),       test::seed_pointers(),
                             test::seed_instances(), test::seed_webp(test::webp(8, 8, Bytes(256, 77), 50.0F))};
  GltfLimits limits;
  limits.memory = std::uint64_t{64} << 20U;
  limits.unbacked = 1U << 16U;
  limits.image_side = 1024;
  std::mt19937 random(7);
  std::size_t good = 0;
  std::size_t bad = 0;
  for (const GltfModel& seed : seeds) {
    for (const Bytes& file : {seed.gltf(), seed.glb()}) {
      for (int i = 0; i < 2000; ++i) {
        const Bytes changed = mutated(file, random);
        try {
          const ScenePtr scene = import_gltf(changed, "mutated", "/nowhere", {}, nullptr, limits);
          ++good;
          ASSERT_EQ(test::broken(*scene), "");
          for (const double time : {0.0, 0.6}) ASSERT_EQ(test::broken(*scene, scene->pose(time)), "");
        } catch (const Error& error) {
          ++bad;
          const std::string line = error.what();
          ASSERT_TRUE(line.starts_with("mutated: ")) << line;
          ASSERT_EQ(line.find_first_of("\n\r"), std::string::npos) << line;
        }
      }
    }
  }
  // Neither all nor none are valid. Otherwise the mutations would reach only the first check.
  EXPECT_GT(good, 1000U);
  EXPECT_GT(bad, 4000U);
}

}  // namespace
}  // namespace cumulet::surface
