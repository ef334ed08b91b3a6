#pragma once

// glTF files that together use all features the importer reads: for round trips, mutations and fuzzing.

#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <meshoptimizer.h>
#include <webp/encode.h>
#include <zlib.h>

#include <cmath>
#include <memory>
#include <optional>

#include "support/gltf_model.hpp"

namespace cumulet::test {

/// A PNG of these rows (without filter bytes); color type 0 gray, 2 RGB, 6 RGBA.
inline Bytes png(std::uint32_t width, std::uint32_t height, std::uint8_t depth, std::uint8_t color_type,
                 const Bytes& rows) {
  Bytes file = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  const auto word = [](Bytes& to, std::uint32_t value) {
    for (int k = 3; k >= 0; --k) to.push_back(static_cast<std::uint8_t>(value >> (8U * static_cast<unsigned>(k))));
  };
  const auto chunk = [&](const char* type, const Bytes& content) {
    word(file, static_cast<std::uint32_t>(content.size()));
    Bytes body(type, type + 4);
    body.insert(body.end(), content.begin(), content.end());
    file.insert(file.end(), body.begin(), body.end());
    word(file, static_cast<std::uint32_t>(crc32(0, body.data(), static_cast<uInt>(body.size()))));
  };
  Bytes header;
  word(header, width);
  word(header, height);
  header.insert(header.end(), {depth, color_type, 0, 0, 0});
  chunk("IHDR", header);
  Bytes raw;
  const std::size_t row = std::max<std::size_t>(rows.size() / std::max(height, 1U), 1);
  for (std::size_t y = 0; y * row < rows.size(); ++y) {
    raw.push_back(0);
    raw.insert(raw.end(), rows.begin() + static_cast<std::ptrdiff_t>(y * row),
               rows.begin() + static_cast<std::ptrdiff_t>((y + 1) * row));
  }
  uLongf size = compressBound(raw.size());
  Bytes packed(size);
  compress(packed.data(), &size, raw.data(), raw.size());
  packed.resize(size);
  chunk("IDAT", packed);
  chunk("IEND", {});
  return file;
}

/// 8 x 8 pixels of about (200, 40, 90).
inline std::string jpeg_base64() {
  return "/9j/4AAQSkZJRgABAQAAAQABAAD/"
         "2wCEAAYEBQYFBAYGBQYHBwYIChAKCgkJChQODwwQFxQYGBcUFhYaHSUfGhsjHBYWICwgIyYnKSopGR8tMC"
         "0oMCUoKSgBBwcHCggKEwoKEygaFhooKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKP/"
         "AABEIAAgACAMB"
         "IgACEQEDEQH/"
         "xAGiAAABBQEBAQEBAQAAAAAAAAAAAQIDBAUGBwgJCgsQAAIBAwMCBAMFBQQEAAABfQECAwAEEQUSITFBBhNRYQcicRQygZGhCC"
         "NCscEVUtHwJDNicoIJChYXGBkaJSYnKCkqNDU2Nzg5OkNERUZHSElKU1RVVldYWVpjZGVmZ2hpanN0dXZ3eHl6g4SFhoeIiYqSk5SVlpeYmZq"
         "i"
         "o6Slpqeoqaqys7S1tre4ubrCw8TFxsfIycrS09TV1tfY2drh4uPk5ebn6Onq8fLz9PX29/"
         "j5+gEAAwEBAQEBAQEBAQAAAAAAAAECAwQFBgcICQ"
         "oLEQACAQIEBAMEBwUEBAABAncAAQIDEQQFITEGEkFRB2FxEyIygQgUQpGhscEJIzNS8BVictEKFiQ04SXxFxgZGiYnKCkqNTY3ODk6Q0RFRkd"
         "I"
         "SUpTVFVWV1hZWmNkZWZnaGlqc3R1dnd4eXqCg4SFhoeIiYqSk5SVlpeYmZqio6Slpqeoqaqys7S1tre4ubrCw8TFxsfIycrS09TV1tfY2dri4"
         "+"
         "Tl5ufo6ery8/T19vf4+fr/2gAMAwEAAhEDEQA/AORoooqT9XP/2Q==";
}

/// A lossless WebP of these rows of RGBA. With a quality (0 to 100), a lossy one.
inline Bytes webp(std::uint32_t width, std::uint32_t height, const Bytes& rgba,
                  std::optional<float> quality = std::nullopt) {
  std::uint8_t* packed = nullptr;
  const int w = static_cast<int>(width);
  const int h = static_cast<int>(height);
  const std::size_t size = quality ? WebPEncodeRGBA(rgba.data(), w, h, 4 * w, *quality, &packed)
                                   : WebPEncodeLosslessRGBA(rgba.data(), w, h, 4 * w, &packed);
  Bytes file(packed, packed + size);
  WebPFree(packed);
  return file;
}

/// A triangle with materials that use every property, textures, samplers, two cameras and three lights.
inline GltfModel seed_materials() {
  GltfModel model;
  json& root = model.root;
  root["extensionsUsed"] = {
      "KHR_lights_punctual",        "KHR_materials_unlit",      "KHR_materials_emissive_strength",
      "KHR_materials_ior",          "KHR_materials_specular",   "KHR_materials_clearcoat",
      "KHR_materials_transmission", "KHR_texture_transform",    "KHR_materials_pbrSpecularGlossiness",
      "KHR_node_visibility",        "KHR_materials_volume",     "KHR_materials_dispersion",
      "KHR_materials_sheen",        "KHR_materials_anisotropy", "KHR_materials_iridescence"};
  model.add("images", {{"bufferView", model.view(png(2, 1, 8, 6, {255, 0, 0, 255, 0, 255, 0, 128}))},
                       {"mimeType", "image/png"},
                       {"name", "two"}});
  model.add("images", {{"uri", "data:image/jpeg;base64," + jpeg_base64()}});
  model.add("images", {{"bufferView", model.view(png(1, 1, 16, 2, {0x80, 0x00, 0x00, 0x7F, 0xFF, 0xFF}))},
                       {"mimeType", "image/png"}});
  model.add("samplers", {{"magFilter", 9728}, {"minFilter", 9985}, {"wrapS", 33071}, {"wrapT", 33648}});
  model.add("textures", {{"source", 0}, {"sampler", 0}});
  model.add("textures", {{"source", 1}});
  model.add("textures", {{"source", 2}});
  const json turned = {
      {"index", 0},
      {"extensions",
       {{"KHR_texture_transform", {{"offset", {0.5, 0.25}}, {"rotation", 0.5}, {"scale", {2, 3}}, {"texCoord", 1}}}}}};
  const json jpeg = {{"index", 1}};
  const json wide = {{"index", 2}};
  model.add("materials",
            {{"name", "everything"},
             {"pbrMetallicRoughness",
              {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}},
               {"baseColorTexture", turned},
               {"metallicFactor", 0.25},
               {"roughnessFactor", 0.75},
               {"metallicRoughnessTexture", jpeg}}},
             {"normalTexture", {{"index", 2}, {"scale", 0.5}}},
             {"occlusionTexture", {{"index", 1}, {"strength", 0.6}}},
             {"emissiveFactor", {0.5, 1, 0}},
             {"emissiveTexture", wide},
             {"alphaMode", "MASK"},
             {"alphaCutoff", 0.3},
             {"doubleSided", true},
             {"extensions",
              {{"KHR_materials_emissive_strength", {{"emissiveStrength", 8}}},
               {"KHR_materials_ior", {{"ior", 1.33}}},
               {"KHR_materials_specular",
                {{"specularFactor", 0.7},
                 {"specularColorFactor", {0.9, 0.8, 0.7}},
                 {"specularTexture", jpeg},
                 {"specularColorTexture", turned}}},
               {"KHR_materials_clearcoat",
                {{"clearcoatFactor", 0.8},
                 {"clearcoatRoughnessFactor", 0.15},
                 {"clearcoatTexture", jpeg},
                 {"clearcoatRoughnessTexture", wide}}},
               {"KHR_materials_transmission", {{"transmissionFactor", 0.35}, {"transmissionTexture", jpeg}}},
               {"KHR_materials_volume",
                {{"thicknessFactor", 2},
                 {"thicknessTexture", jpeg},
                 {"attenuationDistance", 0.5},
                 {"attenuationColor", {1, 0.5, 0.25}}}},
               {"KHR_materials_dispersion", {{"dispersion", 0.36}}},
               {"KHR_materials_sheen",
                {{"sheenColorFactor", {0.3, 0.2, 0.1}},
                 {"sheenColorTexture", turned},
                 {"sheenRoughnessFactor", 0.45},
                 {"sheenRoughnessTexture", jpeg}}},
               {"KHR_materials_anisotropy",
                {{"anisotropyStrength", 0.65}, {"anisotropyRotation", 1.57}, {"anisotropyTexture", wide}}},
               {"KHR_materials_iridescence",
                {{"iridescenceFactor", 0.55},
                 {"iridescenceTexture", jpeg},
                 {"iridescenceIor", 1.8},
                 {"iridescenceThicknessMinimum", 150},
                 {"iridescenceThicknessMaximum", 650},
                 {"iridescenceThicknessTexture", turned}}}}}});
  model.add("materials", {{"alphaMode", "BLEND"}, {"extensions", {{"KHR_materials_unlit", json::object()}}}});
  model.add("materials", {{"extensions",
                           {{"KHR_materials_pbrSpecularGlossiness",
                             {{"diffuseFactor", {0.4, 0.5, 0.6, 1}},
                              {"specularFactor", {0.08, 0.04, 0.02}},
                              {"glossinessFactor", 0.75},
                              {"diffuseTexture", wide}}}}}});
  root["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "directional"}, {"color", {1, 0.5, 0.25}}, {"intensity", 4}},
      {{"type", "point"}, {"range", 7}},
      {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.1}, {"outerConeAngle", 0.2}}}, {"intensity", 2}}};
  model.add("cameras", {{"type", "perspective"},
                        {"name", "eye"},
                        {"perspective", {{"yfov", 0.6}, {"znear", 0.5}, {"aspectRatio", 1.5}, {"zfar", 90}}}});
  model.add("cameras",
            {{"type", "orthographic"}, {"orthographic", {{"xmag", 4}, {"ymag", 2}, {"znear", 0}, {"zfar", 10}}}});
  const json triangle = {
      {"attributes",
       {{"POSITION", model.triangle()},
        {"NORMAL", model.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1})},
        {"TEXCOORD_0", model.vec2({0, 1, 1, 1, 0, 0})},
        {"TEXCOORD_1",
         model.accessor<std::uint16_t>("VEC2", 2, {0, 65535, 65535, 65535, 0, 0}, {{"normalized", true}})},
        {"COLOR_0",
         model.accessor<std::uint8_t>("VEC4", 4, {255, 0, 51, 255, 0, 0, 0, 0, 1, 2, 3, 4}, {{"normalized", true}})}}},
      {"material", 0}};
  json second = triangle;
  second["material"] = 1;
  json third = triangle;
  third["material"] = 2;
  const int mesh = model.add("meshes", {{"primitives", {triangle, second, third}}});
  model.add("nodes", {{"mesh", mesh}, {"children", {1, 2, 3, 4, 5}}, {"translation", {1, 2, 3}}});
  const auto light = [](int i) { return json{{"KHR_lights_punctual", {{"light", i}}}}; };
  // 90 degrees about y: -z becomes -x.
  model.add("nodes", {{"camera", 0}, {"rotation", {0, 0.70710678, 0, 0.70710678}}, {"extensions", light(0)}});
  model.add("nodes", {{"camera", 1}, {"scale", {2, 2, 2}}, {"extensions", light(2)}});
  model.add("nodes", {{"translation", {0, 5, 0}}, {"extensions", light(1)}});
  model.add("nodes", {{"matrix", {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, -2, 0, 0, 0, 0, 1}}, {"mesh", mesh}});
  model.add("nodes", {{"name", "nothing"}, {"extensions", {{"KHR_node_visibility", {{"visible", false}}}}}});
  root["scenes"] = json::array({{{"nodes", json::array({0})}}});
  root["scene"] = 0;
  return model;
}

/// A skinned, morphed strip with sparse targets and every kind of animation.
inline GltfModel seed_animated() {
  GltfModel model;
  const int base = model.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
  json target = {{"count", 4}, {"componentType", 5126}, {"type", "VEC3"}};
  target["sparse"] = {{"count", 2},
                      {"indices", {{"bufferView", model.view({1, 3})}, {"componentType", 5121}}},
                      {"values", {{"bufferView", model.view(bytes_of<float>({0, 0, 1, 0, 0, 2}))}}}};
  const int moved = model.add("accessors", target);
  json sparse = model.root["accessors"][static_cast<std::size_t>(base)];
  sparse["sparse"] = {{"count", 1},
                      {"indices", {{"bufferView", model.view(bytes_of<std::uint16_t>({3}))}, {"componentType", 5123}}},
                      {"values", {{"bufferView", model.view(bytes_of<float>({2, 2, 0}))}}}};
  const int positions = model.add("accessors", sparse);
  const int normals = model.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
  const int tilted = model.vec3({1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  const json primitive = {
      {"attributes",
       {{"POSITION", positions},
        {"NORMAL", normals},
        {"JOINTS_0", model.accessor<std::uint8_t>("VEC4", 4, {0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0})},
        {"WEIGHTS_0", model.accessor<float>("VEC4", 4, {1, 0, 0, 0, 0.5F, 0.5F, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0})}}},
      {"indices", model.accessor<std::uint16_t>("SCALAR", 1, {0, 1, 2, 3})},
      {"mode", 5},
      {"targets", {{{"POSITION", moved}, {"NORMAL", tilted}}, {{"POSITION", moved}}}}};
  const int mesh = model.add("meshes", {{"primitives", json::array({primitive})}, {"weights", {0.5, 0}}});
  std::vector<float> bind(32, 0.0F);
  for (std::size_t m = 0; m < 2; ++m) {
    for (std::size_t k = 0; k < 4; ++k) bind[16 * m + 5 * k] = 1.0F;
  }
  bind[16 + 13] = -1.0F;  // joint 1 is at (0, 1, 0)
  model.add("skins", {{"joints", {1, 2}}, {"inverseBindMatrices", model.accessor<float>("MAT4", 16, bind)}});
  model.add("nodes", {{"mesh", mesh}, {"skin", 0}, {"translation", {100, 100, 100}}});
  model.add("nodes", {{"children", json::array({2})}});
  model.add("nodes", {{"translation", {0, 1, 0}}});
  const int times = model.scalars({0, 1, 2});
  const auto sampler = [&](const char* kind, int output) {
    return json{{"input", times}, {"output", output}, {"interpolation", kind}};
  };
  const auto channel = [](int s, int node, const char* path) {
    return json{{"sampler", s}, {"target", {{"node", node}, {"path", path}}}};
  };
  // In-tangent, value, out-tangent of three keys.
  const int cubic = model.vec3({0, 0, 0, 0, 1, 0, 3, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 2, 1, 0, 0, 0, 0});
  const int turns = model.accessor<std::int16_t>("VEC4", 4, {0, 0, 0, 32767, 0, 0, 23170, 23170, 0, 0, 32767, 0},
                                                 {{"normalized", true}});
  const int sizes = model.vec3({1, 1, 1, 2, 2, 2, 3, 3, 3});
  const int weights = model.scalars({0, 0, 1, 0, 0, 1});
  model.add(
      "animations",
      {{"name", "all"},
       {"samplers",
        {sampler("CUBICSPLINE", cubic), sampler("LINEAR", turns), sampler("STEP", sizes), sampler("LINEAR", weights)}},
       {"channels",
        {channel(0, 2, "translation"), channel(1, 2, "rotation"), channel(2, 1, "scale"), channel(3, 0, "weights")}}});
  model.add("animations", {{"samplers", json::array({sampler("LINEAR", sizes)})},
                           {"channels", json::array({channel(0, 1, "translation")})}});
  return model;
}

/// An animation with one key per second, targeted by KHR_animation_pointer.
struct Pointing {
  std::string pointer;
  std::size_t width;
  std::vector<float> values;
  const char* interpolation = "LINEAR";
};
inline void animate(GltfModel& model, const std::vector<Pointing>& pointings) {
  json animation = {{"name", "pointers"}, {"samplers", json::array()}, {"channels", json::array()}};
  const char* types[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
  for (const Pointing& pointing : pointings) {
    const bool cubic = pointing.interpolation == std::string_view("CUBICSPLINE");
    const std::size_t keys = pointing.values.size() / pointing.width / (cubic ? 3 : 1);
    std::vector<float> times;
    for (std::size_t k = 0; k < keys; ++k) times.push_back(static_cast<float>(k));
    animation["channels"].push_back(
        {{"sampler", animation["samplers"].size()},
         {"target",
          {{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", pointing.pointer}}}}}}}});
    animation["samplers"].push_back({{"input", model.scalars(times)},
                                     {"output", model.accessor(types[pointing.width], pointing.width, pointing.values)},
                                     {"interpolation", pointing.interpolation}});
  }
  model.root["extensionsUsed"].push_back("KHR_animation_pointer");
  model.add("animations", animation);
}

/// seed_materials() with animated properties.
inline GltfModel seed_pointers() {
  GltfModel model = seed_materials();
  const std::string first = "/materials/0/";
  animate(model,
          {{first + "pbrMetallicRoughness/baseColorFactor", 4, {0, 0, 0, 0, 1, 0.5F, 0.25F, 1}},
           {first + "emissiveFactor", 3, {0, 0, 0, 1, 1, 1}},
           {first + "extensions/KHR_materials_emissive_strength/emissiveStrength", 1, {1, 9}},
           {first + "pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/offset", 2, {0, 0, 1, 2}},
           {"/extensions/KHR_lights_punctual/lights/1/intensity", 1, {1, 3}},
           {"/nodes/4/extensions/KHR_node_visibility/visible", 1, {0, 1}, "STEP"},
           {"/nodes/1/rotation", 4, {0, 0, 0, 1, 0, 1, 0, 0}}});
  return model;
}

/// A triangle with three instance transforms.
inline GltfModel seed_instances() {
  GltfModel model;
  model.root["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  const json attributes = {{"TRANSLATION", model.vec3({0, 0, 0, 1, 0, 0, 2, 0, 0})},
                           {"ROTATION", model.accessor<float>("VEC4", 4, {0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0})},
                           {"SCALE", model.vec3({1, 1, 1, -1, 1, 1, 2, 2, 2})},
                           {"_ID", model.accessor<std::uint8_t>("SCALAR", 1, {1, 2, 3})}};
  model.show({{"attributes", {{"POSITION", model.triangle()}}}},
             {{"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", attributes}}}}}});
  return model;
}

/// A grid of (n + 1)^2 vertices in the unit square at z = 0, its triangles facing +z.
struct Grid {
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;

  explicit Grid(std::uint32_t n) {
    for (std::uint32_t y = 0; y <= n; ++y) {
      for (std::uint32_t x = 0; x <= n; ++x) {
        positions.insert(positions.end(), {static_cast<float>(x) / static_cast<float>(n),
                                           static_cast<float>(y) / static_cast<float>(n), 0.0F});
      }
    }
    for (std::uint32_t y = 0; y < n; ++y) {
      for (std::uint32_t x = 0; x < n; ++x) {
        const std::uint32_t a = y * (n + 1) + x;
        const std::uint32_t c = a + n + 1;
        indices.insert(indices.end(), {a, a + 1, c, a + 1, c + 1, c});
      }
    }
  }
};

/// One mesh of 2 n^2 triangles with a normal map and without tangents. Such a mesh takes the longest to import.
inline GltfModel seed_tangents(std::uint32_t n) {
  const Grid grid(n);
  std::vector<float> positions, normals, uvs;
  for (std::size_t i = 0; i < grid.positions.size(); i += 3) {
    const float u = grid.positions[i];
    const float v = grid.positions[i + 1];
    positions.insert(positions.end(), {u, v, 0.02F * std::sin(40.0F * u) * std::cos(50.0F * v)});
    normals.insert(normals.end(), {0.0F, 0.0F, 1.0F});
    uvs.insert(uvs.end(), {u, v});
  }
  GltfModel model;
  model.add("images", {{"bufferView", model.view(png(1, 1, 8, 2, {128, 128, 255}))}, {"mimeType", "image/png"}});
  model.add("textures", {{"source", 0}});
  model.add("materials", {{"normalTexture", {{"index", 0}}}});
  model.show({{"attributes",
               {{"POSITION", model.vec3(positions)}, {"NORMAL", model.vec3(normals)}, {"TEXCOORD_0", model.vec2(uvs)}}},
              {"indices", model.accessor("SCALAR", 1, grid.indices)},
              {"material", 0}});
  return model;
}

/// A square image with `side` pixels per side, used as the emissive texture of one triangle.
inline GltfModel seed_picture(std::uint32_t side) {
  Bytes rows(std::size_t{side} * side * 3);
  std::uint32_t noise = 1;
  for (std::uint8_t& byte : rows) {
    noise = noise * 1664525U + 1013904223U;
    byte = static_cast<std::uint8_t>(noise >> 27U);
  }
  GltfModel model;
  model.add("images", {{"bufferView", model.view(png(side, side, 8, 2, rows))}, {"mimeType", "image/png"}});
  model.add("textures", {{"source", 0}});
  model.add("materials", {{"emissiveTexture", {{"index", 0}}}, {"emissiveFactor", {1, 1, 1}}});
  model.show({{"attributes",
               {{"POSITION", model.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0})}, {"TEXCOORD_0", model.vec2({0, 0, 1, 0, 0, 1})}}},
              {"material", 0}});
  return model;
}

/// A triangle with an EXT_texture_webp texture, and a fallback image for readers without WebP.
inline GltfModel seed_webp(const Bytes& picture, const std::optional<Bytes>& fallback = std::nullopt) {
  GltfModel model;
  model.root["extensionsUsed"] = {"EXT_texture_webp"};
  if (!fallback) model.root["extensionsRequired"] = {"EXT_texture_webp"};
  model.add("images", {{"bufferView", model.view(picture)}, {"mimeType", "image/webp"}, {"name", "small"}});
  json texture = {{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}};
  if (fallback) {
    texture["source"] = model.add("images", {{"bufferView", model.view(*fallback)}, {"mimeType", "image/png"}});
  }
  model.add("textures", texture);
  model.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  model.show({{"attributes", {{"POSITION", model.triangle()}}}, {"material", 0}});
  return model;
}

/// The grid's triangles, compressed with Draco, positions with 14 bits.
inline GltfModel seed_draco(std::uint32_t n = 4, int speed = 3) {
  const Grid grid(n);
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(static_cast<int>(grid.indices.size() / 3));
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int joint = builder.AddAttribute(draco::GeometryAttribute::GENERIC, 4, draco::DT_UINT8);
  const std::uint8_t joints[] = {0, 0, 0, 0};
  for (std::uint32_t f = 0; f < grid.indices.size() / 3; ++f) {
    const auto corner = [&](std::size_t k) { return &grid.positions[3 * grid.indices[3 * f + k]]; };
    builder.SetAttributeValuesForFace(position, draco::FaceIndex(f), corner(0), corner(1), corner(2));
    builder.SetAttributeValuesForFace(joint, draco::FaceIndex(f), joints, joints, joints);
  }
  const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
  draco::Encoder encoder;
  encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 14);
  encoder.SetSpeedOptions(speed, speed);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeMeshToBuffer(*mesh, &buffer).ok()) return {};

  GltfModel model;
  model.root["extensionsUsed"] = json::array({"KHR_draco_mesh_compression"});
  model.root["extensionsRequired"] = json::array({"KHR_draco_mesh_compression"});
  const auto accessor = [&](int type, std::size_t count, const char* kind) {
    return model.add("accessors", {{"componentType", type}, {"count", count}, {"type", kind}});
  };
  const std::size_t vertices = grid.positions.size() / 3;
  const auto unique = [&](int attribute) { return mesh->attribute(attribute)->unique_id(); };
  const json extension = {{"bufferView", model.view({buffer.data(), buffer.data() + buffer.size()})},
                          {"attributes", {{"POSITION", unique(position)}, {"JOINTS_0", unique(joint)}}}};
  model.show(
      {{"attributes", {{"POSITION", accessor(5126, vertices, "VEC3")}, {"JOINTS_0", accessor(5121, vertices, "VEC4")}}},
       {"indices", accessor(5125, grid.indices.size(), "SCALAR")},
       {"extensions", {{"KHR_draco_mesh_compression", extension}}}});
  return model;
}

/// The grid's triangles, compressed with meshoptimizer, normals with the octahedral filter. The fallback buffer has no
/// bytes.
inline GltfModel seed_meshopt(std::uint32_t n = 4) {
  const Grid grid(n);
  const std::size_t vertices = grid.positions.size() / 3;
  GltfModel model;
  model.root["extensionsUsed"] = json::array({"EXT_meshopt_compression", "KHR_mesh_quantization"});
  model.root["extensionsRequired"] = json::array({"EXT_meshopt_compression", "KHR_mesh_quantization"});
  const auto compressed = [&](const Bytes& bytes, std::size_t stride, std::size_t count, const char* mode,
                              const char* filter, bool vertex) {
    const int source = model.view(bytes);
    json& view = model.root["bufferViews"][static_cast<std::size_t>(source)];
    json extension = {{"buffer", 0},
                      {"byteOffset", view["byteOffset"]},
                      {"byteLength", bytes.size()},
                      {"byteStride", stride},
                      {"count", count},
                      {"mode", mode},
                      {"filter", filter}};
    view = {{"buffer", 1}, {"byteLength", count * stride}, {"extensions", {{"EXT_meshopt_compression", extension}}}};
    if (vertex) view["byteStride"] = stride;
    return source;
  };
  const auto attributes = [&](const void* data, std::size_t count, std::size_t stride, const char* filter) {
    Bytes bytes(meshopt_encodeVertexBufferBound(count, stride));
    bytes.resize(meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), data, count, stride));
    return compressed(bytes, stride, count, "ATTRIBUTES", filter, true);
  };
  const auto accessor = [&](int view, int type, const char* kind, std::size_t count, bool normalized) {
    return model.add(
        "accessors",
        {{"bufferView", view}, {"componentType", type}, {"count", count}, {"type", kind}, {"normalized", normalized}});
  };
  std::vector<std::uint16_t> quantized(4 * vertices, 0);
  std::vector<float> up(4 * vertices, 0.0F);
  for (std::size_t i = 0; i < vertices; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      quantized[4 * i + c] = static_cast<std::uint16_t>(grid.positions[3 * i + c] * 65535.0F + 0.5F);
    }
    up[4 * i + 2] = 1.0F;
  }
  Bytes filtered(4 * vertices);
  meshopt_encodeFilterOct(filtered.data(), vertices, 4, 8, up.data());
  const int positions = accessor(attributes(quantized.data(), vertices, 8, "NONE"), 5123, "VEC3", vertices, true);
  const int normals = accessor(attributes(filtered.data(), vertices, 4, "OCTAHEDRAL"), 5120, "VEC3", vertices, true);
  Bytes triangles(meshopt_encodeIndexBufferBound(grid.indices.size(), vertices));
  triangles.resize(
      meshopt_encodeIndexBuffer(triangles.data(), triangles.size(), grid.indices.data(), grid.indices.size()));
  const int indices = accessor(compressed(triangles, 2, grid.indices.size(), "TRIANGLES", "NONE", false), 5123,
                               "SCALAR", grid.indices.size(), false);
  Bytes sequence(meshopt_encodeIndexSequenceBound(grid.indices.size(), vertices));
  sequence.resize(
      meshopt_encodeIndexSequence(sequence.data(), sequence.size(), grid.indices.data(), grid.indices.size()));
  const int listed = accessor(compressed(sequence, 4, grid.indices.size(), "INDICES", "NONE", false), 5125, "SCALAR",
                              grid.indices.size(), false);
  model.root["buffers"] = json::array({{{"byteLength", 1U << 20U}}});  // the fallback
  const json shape = {{"POSITION", positions}, {"NORMAL", normals}};
  model.show({{"attributes", shape}, {"indices", indices}});
  model.show({{"attributes", shape}, {"indices", listed}});
  return model;
}

}  // namespace cumulet::test
