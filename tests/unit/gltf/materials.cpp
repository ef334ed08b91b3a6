// glTF extensions for material layers, variants and specular-glossiness, tested with small files made here.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "assets/surface_asset.hpp"
#include "scene/model_source.hpp"
#include "support/gltf_check.hpp"
#include "support/gltf_import.hpp"
#include "support/gltf_model.hpp"
#include "support/gltf_seeds.hpp"
#include "surface/bvh.hpp"
#include "surface/specular_glossiness.hpp"

namespace cumulet::surface {
namespace {

using test::Bytes;
using test::GltfModel;
using test::has;
using test::imported;
using test::json;
using test::Lines;
using test::refused;

/// One triangle of a material with these extensions.
GltfModel layered_model(const json& extensions) {
  GltfModel model;
  model.root["extensionsUsed"] = json::array();
  for (const auto& [name, value] : extensions.items()) model.root["extensionsUsed"].push_back(name);
  model.root["extensionsRequired"] = model.root["extensionsUsed"];
  model.add("materials", {{"extensions", extensions}});
  model.show({{"attributes", {{"POSITION", model.triangle()}}}, {"material", 0}});
  return model;
}

TEST(GltfMaterialLayers, MissingPropertiesHaveTheExtensionsDefaults) {
  const json none = json::object();
  Lines lines;
  const ScenePtr scene = imported(layered_model({{"KHR_materials_volume", none},
                                                 {"KHR_materials_dispersion", none},
                                                 {"KHR_materials_sheen", none},
                                                 {"KHR_materials_anisotropy", none},
                                                 {"KHR_materials_iridescence", none}}),
                                  lines.log);
  EXPECT_TRUE(lines.warnings.empty());
  Material expected;
  EXPECT_EQ(scene->materials[0], expected);
  EXPECT_EQ(bsdf_variant(scene->materials[0]), BsdfVariant::basic);
  // An infinite or zero attenuation distance means no absorption.
  for (const char* distance : {"null", "0"}) {
    json volume = {{"thicknessFactor", 1}, {"attenuationColor", {0, 0.5, 1}}};
    if (std::string_view(distance) == "0") volume["attenuationDistance"] = 0;
    const ScenePtr clear = imported(layered_model({{"KHR_materials_volume", volume}}));
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(clear->materials[0].absorption[c], 0.0F, 1e-15F) << distance;
  }
}

TEST(GltfMaterialLayers, TransmissiveSurfacesBoundVolumesOnBothSides) {
  const json volume = {{"thicknessFactor", 0.5}};
  const json through = {{"transmissionFactor", 1}};
  const ScenePtr wall = imported(layered_model({{"KHR_materials_transmission", through}}));
  EXPECT_FALSE(bounds_volume(wall->materials[0]));
  EXPECT_EQ(triangle_flags(*wall, wall->pose(0.0))[0] & (TriangleFlags::ask | TriangleFlags::one_sided),
            TriangleFlags::ask | TriangleFlags::one_sided);
  const ScenePtr solid = imported(layered_model({{"KHR_materials_volume", volume}}));
  EXPECT_FALSE(bounds_volume(solid->materials[0]));  // it does not transmit
  const ScenePtr glass =
      imported(layered_model({{"KHR_materials_volume", volume}, {"KHR_materials_transmission", through}}));
  EXPECT_TRUE(bounds_volume(glass->materials[0]));
  EXPECT_EQ(triangle_flags(*glass, glass->pose(0.0))[0] & (TriangleFlags::ask | TriangleFlags::one_sided), 0U);
}

// The packed data of a model with these material extensions. shown: its triangle has the material.
scene::ModelSourcePtr source_of(const json& extensions, bool shown) {
  GltfModel model = layered_model(extensions);
  if (!shown) model.root["meshes"][0]["primitives"][0].erase("material");
  const ScenePtr scene = imported(model);
  Progress progress;
  return scene::make_model_source(scene, scene->pose(0.0), &progress);
}

TEST(GltfMaterialLayers, UnusedMaterialsDoNotSelectTheExtendedShaders) {
  const auto rich = [](const json& extensions, bool shown) { return source_of(extensions, shown)->bsdf; };
  const json sheen = {{"KHR_materials_sheen", {{"sheenColorFactor", {0, 0.1, 0}}}}};
  EXPECT_EQ(rich(sheen, true), BsdfVariant::extended);
  EXPECT_EQ(rich(sheen, false), BsdfVariant::basic);
  EXPECT_EQ(rich({{"KHR_materials_anisotropy", {{"anisotropyStrength", 0.1}}}}, true), BsdfVariant::extended);
  const json iridescence = {{"iridescenceFactor", 0.1}};
  EXPECT_EQ(rich({{"KHR_materials_iridescence", iridescence}}, true), BsdfVariant::iridescent);
  EXPECT_EQ(rich({{"KHR_materials_iridescence", iridescence}}, false), BsdfVariant::basic);
  EXPECT_EQ(
      rich({{"KHR_materials_iridescence", iridescence}, {"KHR_materials_sheen", sheen["KHR_materials_sheen"]}}, true),
      BsdfVariant::iridescent);
  EXPECT_EQ(rich({{"KHR_materials_transmission", {{"transmissionFactor", 0.1}}}}, true), BsdfVariant::extended);
  EXPECT_EQ(rich({{"KHR_materials_volume", {{"thicknessFactor", 1}}}}, true), BsdfVariant::basic);
  EXPECT_EQ(rich({{"KHR_materials_clearcoat", {{"clearcoatFactor", 1}}}}, true), BsdfVariant::basic);
}

TEST(GltfMaterialLayers, OnlyShownThinWallsThatTransmitAreClear) {
  const auto clear = [](const json& extensions, bool shown) { return source_of(extensions, shown)->clear_surfaces; };
  const json through = {{"transmissionFactor", 0.5}};
  EXPECT_TRUE(clear({{"KHR_materials_transmission", through}}, true));
  EXPECT_FALSE(clear({{"KHR_materials_transmission", through}}, false));
  EXPECT_FALSE(clear({{"KHR_materials_transmission", {{"transmissionFactor", 0}}}}, true));
  EXPECT_FALSE(
      clear({{"KHR_materials_transmission", through}, {"KHR_materials_volume", {{"thicknessFactor", 1}}}}, true));
  EXPECT_FALSE(clear({{"KHR_materials_iridescence", {{"iridescenceFactor", 1}}}}, true));
}

TEST(GltfMaterialLayers, AnisotropyHasTangentsWithoutANormalMap) {
  GltfModel model = layered_model({{"KHR_materials_anisotropy", {{"anisotropyStrength", 0.5}}}});
  // u increases along +y of the triangle.
  model.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = model.vec2({0, 0, 0, 1, 1, 0});
  const ScenePtr scene = imported(model);
  const Pose pose = scene->pose(0.0);
  EXPECT_EQ(test::broken(*scene, pose), "");
  test::near(glm::vec3(pose.vertices[0].tangent), {0, 1, 0});
  // A valid tangent exists even without texture coordinates.
  const ScenePtr bare = imported(layered_model({{"KHR_materials_anisotropy", {{"anisotropyStrength", 0.5}}}}));
  EXPECT_EQ(test::broken(*bare, bare->pose(0.0)), "");
}

TEST(GltfMaterialLayers, InvalidNumbersAreClampedOrGiveAOneLineError) {
  const auto line = [](const char* extension, const json& members) {
    return refused(layered_model({{extension, members}}));
  };
  EXPECT_TRUE(
      has(line("KHR_materials_volume", {{"attenuationColor", {1, 1}}}), "attenuationColor does not have 3 numbers"));
  EXPECT_TRUE(has(line("KHR_materials_volume", {{"thicknessFactor", "1"}}), "thicknessFactor is not a number"));
  EXPECT_TRUE(has(line("KHR_materials_volume", {{"thicknessTexture", 0}}), "thicknessTexture is not an object"));
  EXPECT_TRUE(has(line("KHR_materials_sheen", {{"sheenColorFactor", 1}}), "sheenColorFactor is not an array"));
  EXPECT_TRUE(has(line("KHR_materials_sheen", {{"sheenColorTexture", {{"index", 3}}}}), "there is no texture 3"));
  EXPECT_TRUE(has(line("KHR_materials_anisotropy", {{"anisotropyRotation", nullptr}}), "anisotropyRotation is not"));
  EXPECT_TRUE(has(line("KHR_materials_iridescence", {{"iridescenceIor", 0.5}}), "iridescenceIor is below 1"));
  EXPECT_TRUE(has(line("KHR_materials_dispersion", {{"dispersion", json::array()}}), "dispersion is not a number"));

  constexpr double huge = 1e300;
  const ScenePtr scene = imported(layered_model(
      {{"KHR_materials_transmission", {{"transmissionFactor", huge}}},
       {"KHR_materials_volume",
        {{"thicknessFactor", huge}, {"attenuationDistance", 1e-300}, {"attenuationColor", {0, -huge, huge}}}},
       {"KHR_materials_dispersion", {{"dispersion", huge}}},
       {"KHR_materials_sheen", {{"sheenColorFactor", {huge, -1, 0.5}}, {"sheenRoughnessFactor", huge}}},
       {"KHR_materials_anisotropy", {{"anisotropyStrength", -huge}, {"anisotropyRotation", huge}}},
       {"KHR_materials_iridescence",
        {{"iridescenceFactor", 7},
         {"iridescenceIor", huge},
         {"iridescenceThicknessMinimum", -huge},
         {"iridescenceThicknessMaximum", huge}}}}));
  EXPECT_EQ(test::broken(*scene), "");
  const Material& m = scene->materials[0];
  EXPECT_EQ(m.sheen_color, glm::vec3(1, 0, 0.5F));
  EXPECT_EQ(m.anisotropy, 0.0F);
  EXPECT_EQ(m.film_thinnest, 0.0F);
  EXPECT_EQ(m.iridescence, 1.0F);
}

TEST(GltfMaterialLayers, PreviewsUseTintedWallsAndIsotropicLobes) {
  GltfModel model =
      layered_model({{"KHR_materials_transmission", {{"transmissionFactor", 1}}},
                     {"KHR_materials_volume",
                      {{"thicknessFactor", 4}, {"attenuationDistance", 2}, {"attenuationColor", {1, 0.5, 0.1}}}},
                     {"KHR_materials_anisotropy", {{"anisotropyStrength", 0.8}}}});
  model.root["materials"][0]["pbrMetallicRoughness"] = {{"roughnessFactor", 0.5}};
  const ScenePtr scene = imported(model);
  Progress progress;
  const auto raster = scene::make_model_source(scene, scene->pose(0.0), &progress)->raster;
  EXPECT_EQ(raster->materials[0].pass, AlphaMode::blend);
  core::CmMaterial block{};
  std::memcpy(&block, raster->material_blocks.data(), sizeof block);
  test::near(glm::vec3(block.base_color), {1, 0.25F, 0.01F});
  // The mean of alphas: 0.25 across, and a mix of that and 1 along.
  EXPECT_NEAR(block.reflection.y, std::sqrt(std::sqrt(0.25 * (0.25 * 0.36 + 0.64))), 1e-5);
}

TEST(GltfMaterialLayers, FactorsCanBeAnimated) {
  GltfModel model = layered_model({{"KHR_materials_transmission", {{"transmissionFactor", 1}}},
                                   {"KHR_materials_volume", {{"thicknessFactor", 1}, {"attenuationDistance", 2}}},
                                   {"KHR_materials_sheen", json::object()},
                                   {"KHR_materials_anisotropy", {{"anisotropyStrength", 1}}},
                                   {"KHR_materials_iridescence", {{"iridescenceFactor", 1}}}});
  const std::string of = "/materials/0/extensions/KHR_materials_";
  animate(model, {{of + "volume/attenuationColor", 3, {1, 1, 1, 0, 0, 0}},
                  {of + "dispersion/dispersion", 1, {0, 2}},
                  {of + "sheen/sheenColorFactor", 3, {0, 0, 0, 2, 1, 0.5F}},
                  {of + "sheen/sheenRoughnessFactor", 1, {0, 1}},
                  {of + "anisotropy/anisotropyRotation", 1, {0, 4}},
                  {of + "iridescence/iridescenceIor", 1, {1, 2}},
                  {of + "iridescence/iridescenceThicknessMaximum", 1, {100, 500}}});
  Lines lines;
  const ScenePtr scene = imported(model, lines.log);
  EXPECT_TRUE(lines.warnings.empty());
  const Material m = scene->pose(0.5).materials.at(0);
  EXPECT_NEAR(m.absorption.x, 0.5 * std::log(2.0), 1e-6);
  EXPECT_FLOAT_EQ(m.dispersion, 1.0F);
  EXPECT_EQ(m.sheen_color, glm::vec3(1.0F, 0.5F, 0.25F));
  EXPECT_FLOAT_EQ(m.sheen_roughness, 0.5F);
  EXPECT_FLOAT_EQ(m.anisotropy_rotation, 2.0F);
  EXPECT_FLOAT_EQ(m.film_ior, 1.5F);
  EXPECT_FLOAT_EQ(m.film_thickest, 300.0F);
  // Properties that affect tangents or sidedness are not animated.
  animate(model, {{of + "volume/thicknessFactor", 1, {0, 1}}, {of + "anisotropy/anisotropyStrength", 1, {0, 1}}});
  const ScenePtr stays = imported(model, lines.log);
  ASSERT_EQ(lines.warnings.size(), 1U);
  EXPECT_TRUE(has(lines.warnings[0], "unsupported animated pointers")) << lines.warnings[0];
}

/// Two triangles. The first is red, or green and then blue in variants "day" and "night". Green is emissive and
/// alpha-tested.
GltfModel variant_model() {
  GltfModel model;
  model.root["extensionsUsed"] = {"KHR_materials_variants"};
  model.root["extensionsRequired"] = {"KHR_materials_variants"};
  model.root["extensions"]["KHR_materials_variants"]["variants"] =
      json::array({{{"name", "day"}}, {{"name", "night"}}});
  model.add("images", {{"bufferView", model.view(test::png(1, 1, 8, 2, {128, 128, 255}))}});
  model.add("textures", {{"source", 0}});
  const auto colored = [](const std::vector<double>& color) {
    return json{{"pbrMetallicRoughness", {{"baseColorFactor", color}}}};
  };
  model.add("materials", colored({1, 0, 0, 1}));
  json green = colored({0, 1, 0, 1});
  green.update({{"emissiveFactor", {0, 1, 0}}, {"alphaMode", "MASK"}, {"doubleSided", true}});
  model.add("materials", green);
  json blue = colored({0, 0, 1, 1});
  blue["normalTexture"] = {{"index", 0}};
  model.add("materials", blue);
  const json attributes = {{"POSITION", model.triangle()}, {"TEXCOORD_0", model.vec2({0, 1, 1, 1, 0, 0})}};
  json mappings = json::array();
  mappings.push_back({{"material", 1}, {"variants", {0}}});
  mappings.push_back({{"material", 2}, {"variants", {1}}});
  model.show({{"attributes", attributes},
              {"material", 0},
              {"extensions", {{"KHR_materials_variants", {{"mappings", mappings}}}}}});
  model.show({{"attributes", attributes}, {"material", 0}}, {{"translation", {2, 0, 0}}});
  return model;
}

TEST(GltfVariants, SelectedVariantSetsMaterials) {
  Lines lines;
  const ScenePtr scene = imported(variant_model(), lines.log);
  EXPECT_TRUE(lines.warnings.empty());
  ASSERT_EQ(scene->variants.size(), 2U);
  EXPECT_EQ(scene->variants[0].name, "day");
  EXPECT_EQ(scene->variants[0].materials, (std::vector<std::uint32_t>{1, 0}));
  EXPECT_EQ(scene->variants[1].name, "night");
  EXPECT_EQ(scene->variants[1].materials, (std::vector<std::uint32_t>{2, 0}));
  EXPECT_EQ(scene->draws[0].material, 0U);
  // Tangents exist because one variant has a normal map.
  EXPECT_EQ(glm::length(glm::vec3(scene->pose(0.0).vertices[0].tangent)), 1.0F);

  const viewer::SurfaceAsset asset(scene, "made");
  Progress progress;
  const auto shown = [&](std::uint32_t variant) { return asset.posed({0.0, 0, false, variant}, progress); };
  const scene::ModelSourcePtr none = shown(0);
  EXPECT_TRUE(none->emissive.empty());
  EXPECT_EQ(none->pose.chosen, std::vector<std::uint32_t>());
  const scene::ModelSourcePtr day = shown(1);
  EXPECT_EQ(day->pose.chosen, scene->variants[0].materials);
  EXPECT_EQ(day->emissive.size(), 1U);
  EXPECT_EQ(day->images, none->images);
  EXPECT_EQ(day->raster->pictures, none->raster->pictures);
  EXPECT_EQ(triangle_flags(*scene, day->pose)[0], static_cast<std::uint32_t>(TriangleFlags::ask));
  EXPECT_EQ(triangle_flags(*scene, none->pose)[0], static_cast<std::uint32_t>(TriangleFlags::one_sided));
  EXPECT_EQ(day->words[day->meshes.at(0).triangles].w, 1U);
  EXPECT_EQ(day->words[day->meshes.at(0).triangles + 1].w, 0U);
  // Equal to a source made directly, and switching back restores the first.
  Pose pose = scene->pose(0.0);
  pose.chosen = scene->variants[0].materials;
  EXPECT_EQ(day->words, scene::make_model_source(scene, pose, &progress)->words);
  EXPECT_EQ(shown(2)->words[none->meshes.at(0).triangles].w, 2U);
  EXPECT_EQ(shown(0)->words, none->words);
  EXPECT_EQ(shown(3)->words, none->words);  // an index out of range
}

TEST(GltfVariants, InvalidMappingsGiveAOneLineError) {
  const auto line = [](const json& mapping) {
    GltfModel model = variant_model();
    model.root["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] =
        json::array({mapping});
    return refused(model);
  };
  EXPECT_TRUE(has(line({{"material", 3}, {"variants", {0}}}), "there is no material 3"));
  EXPECT_TRUE(has(line({{"material", 1}, {"variants", {2}}}), "there is no variant 2"));
  EXPECT_TRUE(has(line({{"variants", {0}}}), "names no material"));
  EXPECT_TRUE(has(line({{"material", 1}}), "names no material, or no variants"));
}

/// KHR_materials_pbrSpecularGlossiness on a triangle.
GltfModel glossy_model(const json& glossiness) {
  GltfModel model;
  model.root["extensionsUsed"] = {"KHR_materials_pbrSpecularGlossiness"};
  model.add("images", {{"bufferView", model.view(test::png(2, 1, 8, 6, {255, 0, 0, 255, 60, 60, 60, 128}))}});
  model.add("images", {{"bufferView", model.view(test::png(1, 1, 8, 6, {255, 255, 255, 51}))}});
  model.add("textures", {{"source", 0}});
  model.add("textures", {{"source", 1}});
  model.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"roughnessFactor", 0.1}}},
                          {"extensions", {{"KHR_materials_pbrSpecularGlossiness", glossiness}}}});
  model.show({{"attributes", {{"POSITION", model.triangle()}}}, {"material", 0}});
  return model;
}

/// The specular-glossiness form of a mixture of metal and dielectric, which the conversion has to separate.
detail::SpecularGlossiness mixture(const glm::vec3& color, float metallic) {
  const glm::vec3 specular = glm::mix(glm::vec3(0.04F), color, metallic);
  const float rest = 1.0F - std::max({specular.r, specular.g, specular.b});
  return {glm::vec4(color * (1.0F - metallic) * 0.96F / rest, 1.0F), specular, 0.25F};
}

TEST(GltfGlossiness, ConversionInvertsMetallicRoughness) {
  // For gray mixtures, the conversion is exact. For colored ones, it is exact only for pure metals and dielectrics.
  for (const float metallic : {0.0F, 0.25F, 0.5F, 0.9F, 1.0F}) {
    for (const float grey : {0.2F, 0.5F, 0.8F}) {
      if (grey < 0.25F && metallic > 0.0F && metallic < 1.0F) continue;  // ambiguous: two mixtures have these values
      const detail::MetallicRoughness made = detail::convert(mixture(glm::vec3(grey), metallic));
      EXPECT_NEAR(made.metallic, metallic, 2e-3F) << grey;
      EXPECT_FLOAT_EQ(made.roughness, 0.75F);
    }
  }
  const glm::vec3 gold(1.0F, 0.77F, 0.34F);
  const detail::MetallicRoughness metal = detail::convert({glm::vec4(0, 0, 0, 0.5F), gold, 1.0F});
  EXPECT_NEAR(metal.metallic, 1.0F, 1e-3F);
  test::near(glm::vec3(metal.base_color), gold, 2e-3F);
  EXPECT_EQ(metal.base_color.a, 0.5F);
  EXPECT_EQ(metal.roughness, 0.0F);
  const detail::MetallicRoughness plastic = detail::convert({glm::vec4(0.5F, 0.2F, 0.1F, 1), glm::vec3(0.04F), 0.5F});
  EXPECT_NEAR(plastic.metallic, 0.0F, 1e-5F);
  test::near(glm::vec3(plastic.base_color), {0.5F, 0.2F, 0.1F});
}

TEST(GltfGlossiness, FactorsWithoutTexturesAreConverted) {
  const ScenePtr scene = imported(glossy_model(
      {{"diffuseFactor", {0.5, 0.2, 0.1, 0.5}}, {"specularFactor", {0.04, 0.04, 0.04}}, {"glossinessFactor", 0.75}}));
  const Material& m = scene->materials[0];
  test::near(glm::vec3(m.base_color), {0.5F, 0.2F, 0.1F});
  EXPECT_EQ(m.base_color.a, 0.5F);
  EXPECT_NEAR(m.metallic, 0.0F, 1e-5F);
  EXPECT_FLOAT_EQ(m.roughness, 0.25F);
  EXPECT_EQ(m.base_color_texture.texture, -1);  // the core material's texture is ignored too
  // The defaults give a mirror.
  const Material mirror = imported(glossy_model(json::object()))->materials[0];
  EXPECT_NEAR(mirror.metallic, 1.0F, 1e-6F);
  EXPECT_EQ(mirror.roughness, 0.0F);
  test::near(glm::vec3(mirror.base_color), glm::vec3(1.0F));
}

TEST(GltfGlossiness, TexelsAreConverted) {
  const json transform = {{"KHR_texture_transform", {{"offset", {0.5, 0.25}}}}};
  const ScenePtr scene =
      imported(glossy_model({{"specularFactor", {0.04, 0.04, 0.04}},
                             {"diffuseTexture", {{"index", 0}, {"extensions", transform}}},
                             {"specularGlossinessTexture", {{"index", 1}, {"extensions", transform}}}}));
  const Material& m = scene->materials[0];
  EXPECT_EQ(m.base_color, glm::vec4(1.0F));
  EXPECT_EQ(m.metallic, 1.0F);
  EXPECT_EQ(m.roughness, 1.0F);
  EXPECT_EQ(m.base_color_texture.transform[2], glm::vec2(0.5F, 0.25F));
  EXPECT_EQ(m.metallic_roughness_texture.transform, m.base_color_texture.transform);
  ASSERT_EQ(scene->images.size(), 2U);  // the source images are dropped
  const auto image = [&](const TextureUse& use) -> const Image& {
    return scene->images[scene->textures.at(static_cast<std::size_t>(use.texture)).image];
  };
  EXPECT_EQ(image(m.base_color_texture).rgba, (std::vector<std::uint8_t>{255, 0, 0, 255, 60, 60, 60, 128}));
  EXPECT_EQ(image(m.metallic_roughness_texture).rgba, (std::vector<std::uint8_t>{0, 204, 0, 255, 0, 204, 0, 255}));

  // A metal by its texture: black diffuse, the specular color is the base color.
  const ScenePtr metal =
      imported(glossy_model({{"diffuseFactor", {0, 0, 0, 1}}, {"specularGlossinessTexture", {{"index", 0}}}}));
  const Material& red = metal->materials[0];
  ASSERT_EQ(metal->images.size(), 2U);
  const Image& base = metal->images[0];
  const Image& rough = metal->images[1];
  EXPECT_EQ(red.base_color_texture.texture, 0);
  EXPECT_NEAR(base.rgba[0], 255, 1);
  EXPECT_NEAR(base.rgba[1], 0, 1);
  EXPECT_EQ(base.rgba[3], 255);
  EXPECT_NEAR(rough.rgba[2], 255, 1);
  EXPECT_EQ(rough.rgba[1], 0);
  EXPECT_EQ(rough.rgba[5], 127);
}

TEST(GltfGlossiness, UnsupportedTexturesAreReported) {
  Lines lines;
  imported(glossy_model(
               {{"diffuseTexture", {{"index", 0}}}, {"specularGlossinessTexture", {{"index", 1}, {"texCoord", 1}}}}),
           lines.log);
  ASSERT_EQ(lines.warnings.size(), 2U);
  EXPECT_TRUE(has(lines.warnings[0], "has different UV sets or texture transforms for specular-glossiness and diffuse"))
      << lines.warnings[0];
  EXPECT_TRUE(has(lines.warnings[1], "KHR_materials_pbrSpecularGlossiness is converted to")) << lines.warnings[1];
  EXPECT_TRUE(has(refused(glossy_model({{"specularGlossinessTexture", {{"index", 7}}}})), "there is no texture 7"));
  GltfModel broken = glossy_model({{"diffuseFactor", {0.5, 0.5, 0.5, 1}},
                                   {"specularFactor", {0.04, 0.04, 0.04}},
                                   {"diffuseTexture", {{"index", 0}}}});
  broken.root["images"][0] = {{"uri", "none.png"}};
  const ScenePtr scene = imported(broken);
  test::near(glm::vec3(scene->materials[0].base_color), glm::vec3(0.5F));
  EXPECT_EQ(scene->materials[0].base_color_texture.texture, -1);
}

TEST(GltfGlossiness, MemoryIsBounded) {
  GltfModel model = glossy_model({{"diffuseTexture", {{"index", 0}}}});
  model.root["images"][0] = {{"bufferView", model.view(test::webp(1024, 1024, Bytes(std::size_t{4} << 20U, 9)))}};
  GltfLimits limits;
  limits.memory = 6U << 20U;
  Lines lines;
  EXPECT_TRUE(imported(model.gltf(), lines.log, limits)->images.empty());
  ASSERT_EQ(lines.warnings.size(), 2U);
  EXPECT_TRUE(has(lines.warnings[0], "material 0 is rendered without textures: images of")) << lines.warnings[0];
}

}  // namespace
}  // namespace cumulet::surface
