#include "surface/gltf_schema.hpp"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <unordered_map>

#include "base/number_text.hpp"
#include "surface/budget.hpp"

namespace cumulet::surface::detail {

namespace {

using nlohmann::json;

constexpr int max_nesting = 64;

/// index: 0 to 2^31 - 2. size: 0 to 2^53. number: finite, by JSON's own grammar.
enum class Kind : std::uint8_t { index, size, number, string, boolean, object, array };

const char* name_of(Kind kind) {
  switch (kind) {
    case Kind::index:
      return "an index";
    case Kind::size:
      return "a size";
    case Kind::number:
      return "a number";
    case Kind::string:
      return "a string";
    case Kind::boolean:
      return "true or false";
    case Kind::object:
      return "an object";
    case Kind::array:
      return "an array";
  }
  return "something else";
}

constexpr double infinite = std::numeric_limits<double>::infinity();

/// Range of a number in glTF.
struct Range {
  double least = -infinite;
  double most = infinite;
};
constexpr Range unit{0.0, 1.0};
constexpr Range positive{0.0, infinite};
constexpr Range cone{0.0, 1.5707963267948966 + 1e-6};  // pi / 2 rounded to float is above pi / 2

struct Leaf {
  const char* path;  ///< "[]": any element of an array; "*": any member of an object
  Kind kind;
  Range range{};
};

// Containers are derived from their leaves. "{}" at the end: an object whose members are not checked.
constexpr Leaf leaves[] = {
    {"asset.version", Kind::string},
    {"asset.minVersion", Kind::string},
    {"scene", Kind::index},
    {"extensionsUsed[]", Kind::string},
    {"extensionsRequired[]", Kind::string},
    {"extensions.KHR_lights_punctual.lights[].name", Kind::string},
    {"extensions.KHR_lights_punctual.lights[].type", Kind::string},
    {"extensions.KHR_lights_punctual.lights[].color[]", Kind::number, unit},
    {"extensions.KHR_lights_punctual.lights[].intensity", Kind::number, positive},
    {"extensions.KHR_lights_punctual.lights[].range", Kind::number, positive},
    {"extensions.KHR_lights_punctual.lights[].spot.innerConeAngle", Kind::number, cone},
    {"extensions.KHR_lights_punctual.lights[].spot.outerConeAngle", Kind::number, cone},
    {"extensions.KHR_materials_variants.variants[].name", Kind::string},
    {"meshes[].primitives[].extensions.KHR_materials_variants.mappings[].material", Kind::index},
    {"meshes[].primitives[].extensions.KHR_materials_variants.mappings[].variants[]", Kind::index},
    {"scenes[].name", Kind::string},
    {"scenes[].nodes[]", Kind::index},
    {"nodes[].name", Kind::string},
    {"nodes[].camera", Kind::index},
    {"nodes[].children[]", Kind::index},
    {"nodes[].skin", Kind::index},
    {"nodes[].mesh", Kind::index},
    {"nodes[].matrix[]", Kind::number},
    {"nodes[].translation[]", Kind::number},
    {"nodes[].rotation[]", Kind::number},
    {"nodes[].scale[]", Kind::number},
    {"nodes[].weights[]", Kind::number},
    {"nodes[].extensions.KHR_lights_punctual.light", Kind::index},
    {"nodes[].extensions.KHR_node_visibility.visible", Kind::boolean},
    {"nodes[].extensions.EXT_mesh_gpu_instancing.attributes.*", Kind::index},
    {"meshes[].name", Kind::string},
    {"meshes[].weights[]", Kind::number},
    {"meshes[].primitives[].attributes.*", Kind::index},
    {"meshes[].primitives[].indices", Kind::index},
    {"meshes[].primitives[].material", Kind::index},
    {"meshes[].primitives[].mode", Kind::index},
    {"meshes[].primitives[].targets[].*", Kind::index},
    {"meshes[].primitives[].extensions.KHR_draco_mesh_compression.bufferView", Kind::index},
    {"meshes[].primitives[].extensions.KHR_draco_mesh_compression.attributes.*", Kind::index},
    {"accessors[].bufferView", Kind::index},
    {"accessors[].byteOffset", Kind::size},
    {"accessors[].componentType", Kind::index},
    {"accessors[].normalized", Kind::boolean},
    {"accessors[].count", Kind::size},
    {"accessors[].type", Kind::string},
    {"accessors[].sparse.count", Kind::index},
    {"accessors[].sparse.indices.bufferView", Kind::index},
    {"accessors[].sparse.indices.byteOffset", Kind::index},
    {"accessors[].sparse.indices.componentType", Kind::index},
    {"accessors[].sparse.values.bufferView", Kind::index},
    {"accessors[].sparse.values.byteOffset", Kind::index},
    {"buffers[].uri", Kind::string},
    {"buffers[].byteLength", Kind::size},
    {"bufferViews[].buffer", Kind::index},
    {"bufferViews[].byteOffset", Kind::size},
    {"bufferViews[].byteLength", Kind::size},
    {"bufferViews[].byteStride", Kind::size},
    {"bufferViews[].extensions.EXT_meshopt_compression.buffer", Kind::index},
    {"bufferViews[].extensions.EXT_meshopt_compression.byteOffset", Kind::size},
    {"bufferViews[].extensions.EXT_meshopt_compression.byteLength", Kind::size},
    {"bufferViews[].extensions.EXT_meshopt_compression.byteStride", Kind::index},
    {"bufferViews[].extensions.EXT_meshopt_compression.count", Kind::index},
    {"bufferViews[].extensions.EXT_meshopt_compression.mode", Kind::string},
    {"bufferViews[].extensions.EXT_meshopt_compression.filter", Kind::string},
    {"cameras[].name", Kind::string},
    {"cameras[].type", Kind::string},
    {"cameras[].perspective.aspectRatio", Kind::number},
    {"cameras[].perspective.yfov", Kind::number},
    {"cameras[].perspective.zfar", Kind::number},
    {"cameras[].perspective.znear", Kind::number},
    {"cameras[].orthographic.xmag", Kind::number},
    {"cameras[].orthographic.ymag", Kind::number},
    {"cameras[].orthographic.zfar", Kind::number},
    {"cameras[].orthographic.znear", Kind::number},
    {"images[].name", Kind::string},
    {"images[].uri", Kind::string},
    {"images[].mimeType", Kind::string},
    {"images[].bufferView", Kind::index},
    {"textures[].sampler", Kind::index},
    {"textures[].source", Kind::index},
    {"textures[].extensions.EXT_texture_webp.source", Kind::index},
    {"samplers[].magFilter", Kind::index},
    {"samplers[].minFilter", Kind::index},
    {"samplers[].wrapS", Kind::index},
    {"samplers[].wrapT", Kind::index},
    {"skins[].inverseBindMatrices", Kind::index},
    {"skins[].joints[]", Kind::index},
    {"animations[].name", Kind::string},
    {"animations[].samplers[].input", Kind::index},
    {"animations[].samplers[].output", Kind::index},
    {"animations[].samplers[].interpolation", Kind::string},
    {"animations[].channels[].sampler", Kind::index},
    {"animations[].channels[].target.node", Kind::index},
    {"animations[].channels[].target.path", Kind::string},
    {"animations[].channels[].target.extensions.KHR_animation_pointer.pointer", Kind::string},
    {"materials[].name", Kind::string},
    {"materials[].emissiveFactor[]", Kind::number, unit},
    {"materials[].alphaMode", Kind::string},
    {"materials[].alphaCutoff", Kind::number, positive},
    {"materials[].doubleSided", Kind::boolean},
    {"materials[].normalTexture.scale", Kind::number},
    {"materials[].occlusionTexture.strength", Kind::number, unit},
    {"materials[].pbrMetallicRoughness.baseColorFactor[]", Kind::number, unit},
    {"materials[].pbrMetallicRoughness.metallicFactor", Kind::number, unit},
    {"materials[].pbrMetallicRoughness.roughnessFactor", Kind::number, unit},
    {"materials[].extensions.KHR_materials_emissive_strength.emissiveStrength", Kind::number, positive},
    {"materials[].extensions.KHR_materials_ior.ior", Kind::number},
    {"materials[].extensions.KHR_materials_specular.specularFactor", Kind::number, unit},
    {"materials[].extensions.KHR_materials_specular.specularColorFactor[]", Kind::number, positive},
    {"materials[].extensions.KHR_materials_clearcoat.clearcoatFactor", Kind::number, unit},
    {"materials[].extensions.KHR_materials_clearcoat.clearcoatRoughnessFactor", Kind::number, unit},
    {"materials[].extensions.KHR_materials_transmission.transmissionFactor", Kind::number, unit},
    {"materials[].extensions.KHR_materials_volume.thicknessFactor", Kind::number, positive},
    {"materials[].extensions.KHR_materials_volume.attenuationDistance", Kind::number, positive},
    {"materials[].extensions.KHR_materials_volume.attenuationColor[]", Kind::number, unit},
    {"materials[].extensions.KHR_materials_dispersion.dispersion", Kind::number, positive},
    {"materials[].extensions.KHR_materials_sheen.sheenColorFactor[]", Kind::number, unit},
    {"materials[].extensions.KHR_materials_sheen.sheenRoughnessFactor", Kind::number, unit},
    {"materials[].extensions.KHR_materials_anisotropy.anisotropyStrength", Kind::number, unit},
    {"materials[].extensions.KHR_materials_anisotropy.anisotropyRotation", Kind::number},
    {"materials[].extensions.KHR_materials_iridescence.iridescenceFactor", Kind::number, unit},
    {"materials[].extensions.KHR_materials_iridescence.iridescenceIor", Kind::number},
    {"materials[].extensions.KHR_materials_iridescence.iridescenceThicknessMinimum", Kind::number, positive},
    {"materials[].extensions.KHR_materials_iridescence.iridescenceThicknessMaximum", Kind::number, positive},
    {"materials[].extensions.KHR_materials_unlit{}", Kind::object},
    {"materials[].extensions.KHR_materials_pbrSpecularGlossiness.diffuseFactor[]", Kind::number, unit},
    {"materials[].extensions.KHR_materials_pbrSpecularGlossiness.specularFactor[]", Kind::number, unit},
    {"materials[].extensions.KHR_materials_pbrSpecularGlossiness.glossinessFactor", Kind::number, unit},
};

constexpr const char* texture_uses[] = {
    "materials[].normalTexture",
    "materials[].occlusionTexture",
    "materials[].emissiveTexture",
    "materials[].pbrMetallicRoughness.baseColorTexture",
    "materials[].pbrMetallicRoughness.metallicRoughnessTexture",
    "materials[].extensions.KHR_materials_specular.specularTexture",
    "materials[].extensions.KHR_materials_specular.specularColorTexture",
    "materials[].extensions.KHR_materials_clearcoat.clearcoatTexture",
    "materials[].extensions.KHR_materials_clearcoat.clearcoatRoughnessTexture",
    "materials[].extensions.KHR_materials_transmission.transmissionTexture",
    "materials[].extensions.KHR_materials_volume.thicknessTexture",
    "materials[].extensions.KHR_materials_sheen.sheenColorTexture",
    "materials[].extensions.KHR_materials_sheen.sheenRoughnessTexture",
    "materials[].extensions.KHR_materials_anisotropy.anisotropyTexture",
    "materials[].extensions.KHR_materials_iridescence.iridescenceTexture",
    "materials[].extensions.KHR_materials_iridescence.iridescenceThicknessTexture",
    "materials[].extensions.KHR_materials_pbrSpecularGlossiness.diffuseTexture",
    "materials[].extensions.KHR_materials_pbrSpecularGlossiness.specularGlossinessTexture",
};

constexpr Leaf texture_use_leaves[] = {
    {".index", Kind::index},
    {".texCoord", Kind::index},
    {".extensions.KHR_texture_transform.offset[]", Kind::number},
    {".extensions.KHR_texture_transform.rotation", Kind::number},
    {".extensions.KHR_texture_transform.scale[]", Kind::number},
    {".extensions.KHR_texture_transform.texCoord", Kind::index},
};

class Schema {
 public:
  Schema() {
    for (const Leaf& leaf : leaves) {
      add(leaf.path, leaf.kind);
      ranges_[leaf.path] = leaf.range;
    }
    for (const char* use : texture_uses) {
      for (const Leaf& leaf : texture_use_leaves) add(std::string(use) + leaf.path, leaf.kind);
    }
  }

  std::string check(json& root) {
    visit(root, {}, "the file");
    if (outside_ > 1) remark_ += ", and " + std::to_string(outside_ - 1) + " more numbers are out of range";
    return remark_;
  }

 private:
  /// Adds the leaf and all its containers.
  void add(std::string path, Kind kind) {
    if (path.ends_with("{}")) path.resize(path.size() - 2);
    kinds_[path] = kind;
    for (std::size_t at = path.size(); at-- > 0;) {
      if (path[at] == '.') kinds_[path.substr(0, at)] = Kind::object;
      if (path[at] == '[') kinds_[path.substr(0, at)] = Kind::array;
    }
  }

  /// type: path in the table. where: path for error messages.
  void visit(json& value, const std::string& type, const std::string& where) {
    const auto found = kinds_.find(type);
    if (found != kinds_.end()) {
      check_kind(value, found->second, where);
      const auto range = ranges_.find(type);
      if (found->second == Kind::number && range != ranges_.end())
        check_range(value.get<double>(), range->second, where);
    } else if (value.is_number_integer()) {
      soften(value);
    }
    if (value.is_object()) {
      value.erase("extras");
      const bool any = kinds_.contains(type + ".*");
      for (const auto& [key, member] : value.items()) {
        std::string pattern = type;
        if (!pattern.empty()) pattern += '.';
        pattern += any ? "*" : key;
        visit(member, pattern, type.empty() ? one_line(key) : where + "." + one_line(key));
      }
    } else if (value.is_array()) {
      const std::string pattern = type + "[]";
      std::size_t i = 0;
      for (json& element : value) visit(element, pattern, where + "[" + std::to_string(i++) + "]");
    }
  }

  static void check_kind(json& value, Kind kind, const std::string& where) {
    bool good = false;
    switch (kind) {
      case Kind::index:
      case Kind::size: {
        const double limit = kind == Kind::index ? double{std::numeric_limits<int>::max()} - 1.0 : 0x1p53;
        if (value.is_number()) {
          const double number = value.get<double>();
          good = number >= 0.0 && number <= limit && number == std::floor(number);
          if (good) value = static_cast<std::uint64_t>(number);
        }
        break;
      }
      case Kind::number:
        good = value.is_number() && std::isfinite(value.get<double>());
        if (good) soften(value);
        break;
      case Kind::string:
        good = value.is_string();
        break;
      case Kind::boolean:
        good = value.is_boolean();
        break;
      case Kind::object:
        good = value.is_object();
        break;
      case Kind::array:
        good = value.is_array();
        break;
    }
    if (!good) malformed(where + " is not " + name_of(kind));
  }

  void check_range(double number, const Range& range, const std::string& where) {
    if (number >= range.least && number <= range.most) return;
    const bool below = number < range.least;
    if (outside_++ == 0) {
      remark_ = where + " is " + general_text(number) + ", " + (below ? "less" : "more") + " than the glTF limit of " +
                general_text(below ? range.least : range.most);
    }
  }

  /// Converts large integers to floating point: tinygltf stores integers of extensions in an int.
  static void soften(json& value) {
    if (!value.is_number_integer()) return;
    const double number = value.get<double>();
    if (std::abs(number) > double{std::numeric_limits<int>::max()}) value = number;
  }

  std::unordered_map<std::string, Kind> kinds_;
  std::unordered_map<std::string, Range> ranges_;
  std::string remark_;
  std::size_t outside_ = 0;
};

}  // namespace

void check_nesting(std::string_view text) {
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted) {
      if (c == '\\') {
        ++i;
      } else if (c == '"') {
        quoted = false;
      }
    } else if (c == '"') {
      quoted = true;
    } else if (c == '{' || c == '[') {
      if (++depth > max_nesting) malformed("JSON nests deeper than " + std::to_string(max_nesting) + " levels");
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
}

std::string check_schema(json& root) {
  if (!root.is_object()) malformed("JSON is not an object");
  return Schema().check(root);
}

}  // namespace cumulet::surface::detail
