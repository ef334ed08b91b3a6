#include "surface/materials.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "base/progress_part.hpp"
#include "surface/gltf_uri.hpp"
#include "surface/specular_glossiness.hpp"

namespace cumulet::surface::detail {

namespace {

/// Members of an extension's object. check_schema() has checked their types.
double number(const tinygltf::Value& object, const char* key, double otherwise) {
  return object.Has(key) ? object.Get(key).GetNumberAsDouble() : otherwise;
}

std::vector<double> numbers(const tinygltf::Value& object, const char* key, std::vector<double> otherwise,
                            const std::string& what) {
  if (!object.Has(key)) return otherwise;
  const tinygltf::Value& array = object.Get(key);
  if (array.ArrayLen() != otherwise.size()) {
    malformed(what + ": " + key + " does not have " + std::to_string(otherwise.size()) + " numbers");
  }
  for (std::size_t i = 0; i < otherwise.size(); ++i) otherwise[i] = array.Get(static_cast<int>(i)).GetNumberAsDouble();
  return otherwise;
}

const tinygltf::Value* find(const tinygltf::ExtensionMap& extensions, const char* name) {
  const auto found = extensions.find(name);
  return found == extensions.end() || !found->second.IsObject() ? nullptr : &found->second;
}

float unit(double value) { return narrow(std::clamp(value, 0.0, 1.0)); }
float positive(double value) { return narrow(std::max(value, 0.0)); }

glm::vec3 color(const std::vector<double>& values) {
  return {positive(values[0]), positive(values[1]), positive(values[2])};
}

/// A texture use as glTF writes it, in the core or in an extension.
struct Use {
  int index = -1;
  int uv_set = 0;
  const tinygltf::Value* transform = nullptr;
};

template <class Info>
Use use_of(const Info& info) {
  return {info.index, info.texCoord, find(info.extensions, "KHR_texture_transform")};
}

Use use_of(const tinygltf::Value& object, const char* key) {
  Use use;
  if (!object.Has(key)) return use;
  const tinygltf::Value& info = object.Get(key);
  use.index = static_cast<int>(number(info, "index", -1));
  use.uv_set = static_cast<int>(number(info, "texCoord", 0));
  if (info.Has("extensions")) {
    const tinygltf::Value& extensions = info.Get("extensions");
    if (extensions.Has("KHR_texture_transform")) use.transform = &extensions.Get("KHR_texture_transform");
  }
  return use;
}

class Materials {
 public:
  Materials(const GltfFile& file, const Log& log, const std::string& name, Budget& budget, Progress* progress,
            Scene& scene)
      : file_(file), log_(log), name_(name), budget_(budget), progress_(progress), scene_(scene) {}

  std::vector<MovableMaterial> import() {
    std::vector<MovableMaterial> movable;
    for (std::size_t i = 0; i < file_.model.materials.size(); ++i) {
      if (progress_ != nullptr) {
        progress_->at(0.5 * static_cast<double>(i) / static_cast<double>(file_.model.materials.size()));
      }
      movable.push_back(material(file_.model.materials[i], numbered("material", i)));
    }
    movable.emplace_back();
    for (const MovableMaterial& material : movable) scene_.materials.push_back(material.now);
    if (approximated_ > 0) {
      log_.warning(name_ +
                   ": KHR_materials_pbrSpecularGlossiness is converted to a similar metallic-roughness material");
    }
    return movable;
  }

 private:
  MovableMaterial material(const tinygltf::Material& from, const std::string& what) {
    MovableMaterial movable;
    Material& to = movable.now;
    to.name = one_line(from.name);
    const auto& pbr = from.pbrMetallicRoughness;
    if (pbr.baseColorFactor.size() != 4) malformed(what + ": baseColorFactor does not have 4 numbers");
    to.base_color = glm::vec4(color(pbr.baseColorFactor), unit(pbr.baseColorFactor[3]));
    const bool glossy = find(from.extensions, "KHR_materials_pbrSpecularGlossiness") != nullptr;
    if (!glossy) texture(TextureSlot::base_color, use_of(pbr.baseColorTexture), what, movable);
    to.metallic = unit(pbr.metallicFactor);
    to.roughness = unit(pbr.roughnessFactor);
    if (!glossy) texture(TextureSlot::metallic_roughness, use_of(pbr.metallicRoughnessTexture), what, movable);
    texture(TextureSlot::normal, use_of(from.normalTexture), what, movable);
    to.normal_scale = narrow(from.normalTexture.scale);
    texture(TextureSlot::occlusion, use_of(from.occlusionTexture), what, movable);
    to.occlusion_strength = unit(from.occlusionTexture.strength);
    to.emission = movable.emissive_factor = color(from.emissiveFactor);
    texture(TextureSlot::emission, use_of(from.emissiveTexture), what, movable);
    to.alpha_cutoff = positive(from.alphaCutoff);
    to.double_sided = from.doubleSided;
    if (from.alphaMode == "MASK") {
      to.alpha_mode = AlphaMode::mask;
    } else if (from.alphaMode == "BLEND") {
      to.alpha_mode = AlphaMode::blend;
    } else if (from.alphaMode != "OPAQUE") {
      malformed(what + ": alphaMode \"" + one_line(from.alphaMode) + "\" is unknown");
    }
    extensions(from.extensions, what, movable);
    return movable;
  }

  void extensions(const tinygltf::ExtensionMap& from, const std::string& what, MovableMaterial& movable) {
    Material& to = movable.now;
    to.unlit = find(from, "KHR_materials_unlit") != nullptr;
    if (const auto* strength = find(from, "KHR_materials_emissive_strength")) {
      movable.emissive_strength = positive(number(*strength, "emissiveStrength", 1.0));
      for (int c = 0; c < 3; ++c) to.emission[c] = narrow(double{to.emission[c]} * movable.emissive_strength);
    }
    if (const auto* ior = find(from, "KHR_materials_ior")) {
      const double index = number(*ior, "ior", 1.5);
      if (index != 0.0 && index < 1.0) malformed(what + ": ior is below 1");
      to.ior = narrow(index);
    }
    if (const auto* specular = find(from, "KHR_materials_specular")) {
      to.specular = unit(number(*specular, "specularFactor", 1.0));
      texture(TextureSlot::specular, use_of(*specular, "specularTexture"), what, movable);
      to.specular_color = color(numbers(*specular, "specularColorFactor", {1.0, 1.0, 1.0}, what));
      texture(TextureSlot::specular_color, use_of(*specular, "specularColorTexture"), what, movable);
    }
    if (const auto* clearcoat = find(from, "KHR_materials_clearcoat")) {
      to.clearcoat = unit(number(*clearcoat, "clearcoatFactor", 0.0));
      texture(TextureSlot::clearcoat, use_of(*clearcoat, "clearcoatTexture"), what, movable);
      to.clearcoat_roughness = unit(number(*clearcoat, "clearcoatRoughnessFactor", 0.0));
      texture(TextureSlot::clearcoat_roughness, use_of(*clearcoat, "clearcoatRoughnessTexture"), what, movable);
    }
    if (const auto* transmission = find(from, "KHR_materials_transmission")) {
      to.transmission = unit(number(*transmission, "transmissionFactor", 0.0));
      texture(TextureSlot::transmission, use_of(*transmission, "transmissionTexture"), what, movable);
    }
    layers(from, what, movable);
    if (const auto* glossiness = find(from, "KHR_materials_pbrSpecularGlossiness")) {
      const auto diffuse = numbers(*glossiness, "diffuseFactor", {1.0, 1.0, 1.0, 1.0}, what);
      const auto reflected = numbers(*glossiness, "specularFactor", {1.0, 1.0, 1.0}, what);
      likeness({glm::vec4(color(diffuse), unit(diffuse[3])), glm::min(color(reflected), 1.0F),
                unit(number(*glossiness, "glossinessFactor", 1.0))},
               use_of(*glossiness, "diffuseTexture"), use_of(*glossiness, "specularGlossinessTexture"), what, movable);
      ++approximated_;
    }
  }

  /// Layers that only the extended-material variant renders.
  void layers(const tinygltf::ExtensionMap& from, const std::string& what, MovableMaterial& movable) {
    Material& to = movable.now;
    if (const auto* volume = find(from, "KHR_materials_volume")) {
      to.thickness = positive(number(*volume, "thicknessFactor", 0.0));
      movable.attenuation_distance =
          positive(number(*volume, "attenuationDistance", std::numeric_limits<double>::infinity()));
      movable.attenuation_color = color(numbers(*volume, "attenuationColor", {1.0, 1.0, 1.0}, what));
      fold_absorption(movable);
    }
    if (const auto* dispersion = find(from, "KHR_materials_dispersion")) {
      to.dispersion = positive(number(*dispersion, "dispersion", 0.0));
    }
    if (const auto* sheen = find(from, "KHR_materials_sheen")) {
      to.sheen_color = glm::min(color(numbers(*sheen, "sheenColorFactor", {0.0, 0.0, 0.0}, what)), 1.0F);
      texture(TextureSlot::sheen_color, use_of(*sheen, "sheenColorTexture"), what, movable);
      to.sheen_roughness = unit(number(*sheen, "sheenRoughnessFactor", 0.0));
      texture(TextureSlot::sheen_roughness, use_of(*sheen, "sheenRoughnessTexture"), what, movable);
    }
    if (const auto* anisotropy = find(from, "KHR_materials_anisotropy")) {
      to.anisotropy = unit(number(*anisotropy, "anisotropyStrength", 0.0));
      to.anisotropy_rotation = narrow(number(*anisotropy, "anisotropyRotation", 0.0));
      texture(TextureSlot::anisotropy, use_of(*anisotropy, "anisotropyTexture"), what, movable);
    }
    if (const auto* iridescence = find(from, "KHR_materials_iridescence")) {
      to.iridescence = unit(number(*iridescence, "iridescenceFactor", 0.0));
      texture(TextureSlot::iridescence, use_of(*iridescence, "iridescenceTexture"), what, movable);
      const double index = number(*iridescence, "iridescenceIor", 1.3);
      if (index < 1.0) malformed(what + ": iridescenceIor is below 1");
      to.film_ior = film_ior(narrow(index));
      to.film_thinnest = film_thickness(narrow(number(*iridescence, "iridescenceThicknessMinimum", 100.0)));
      to.film_thickest = film_thickness(narrow(number(*iridescence, "iridescenceThicknessMaximum", 400.0)));
      texture(TextureSlot::film_thickness, use_of(*iridescence, "iridescenceThicknessTexture"), what, movable);
    }
  }

  /// Replaces the core members by the conversion of specular-glossiness.
  void likeness(const SpecularGlossiness& factors, const Use& diffuse, const Use& specular, const std::string& what,
                MovableMaterial& movable) {
    Material& to = movable.now;
    const MetallicRoughness even = convert(factors);
    to.base_color = even.base_color;
    to.metallic = even.metallic;
    to.roughness = even.roughness;
    // Both textures are combined into one, with the transform of the diffuse one.
    auto at = texture_use(TextureSlot::base_color, diffuse, what, movable);
    const auto other = texture_use(TextureSlot::metallic_roughness, specular, what, movable);
    if (!at) at = other;
    if (!at) return;
    if (other && (other->uv_set != at->uv_set || other->transform != at->transform)) {
      log_.warning(name_ + ": " + what +
                   " has different UV sets or texture transforms for specular-glossiness and diffuse; those of diffuse "
                   "are used");
    }
    movable.transforms[static_cast<std::size_t>(TextureSlot::metallic_roughness)] =
        movable.transforms[static_cast<std::size_t>(TextureSlot::base_color)];
    const auto textures = converted(factors, diffuse, specular, what);
    if (!textures) return;
    to.base_color = glm::vec4(1.0F);
    to.metallic = 1.0F;
    to.roughness = 1.0F;
    to.base_color_texture = to.metallic_roughness_texture = *at;
    to.base_color_texture.texture = textures->first;
    to.metallic_roughness_texture.texture = textures->second;
  }

  /// Returns the converted textures: base color, and metallic-roughness. Nullopt if neither image can be read.
  std::optional<std::pair<std::int32_t, std::int32_t>> converted(const SpecularGlossiness& f, const Use& diffuse,
                                                                 const Use& specular, const std::string& what) {
    const Conversion key{
        {diffuse.index, specular.index},
        {f.diffuse.r, f.diffuse.g, f.diffuse.b, f.diffuse.a, f.specular.r, f.specular.g, f.specular.b, f.glossiness}};
    const auto known = converted_.find(key);
    if (known != converted_.end()) return known->second;
    const std::optional<Image> diffuse_image = picture(diffuse.index);
    const std::optional<Image> specular_image = picture(specular.index);
    auto& made = converted_[key];
    if (!diffuse_image && !specular_image) return made;
    ConvertedImages images;
    try {
      images = convert(f, diffuse_image, specular_image, budget_);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::file) throw;
      log_.warning(name_ + ": " + what + " is rendered without textures: " + error.what());
      return made;
    }
    const int main = diffuse_image ? diffuse.index : specular.index;
    const Sampler ways =
        sampler(file_.model.textures[static_cast<std::size_t>(main)].sampler, static_cast<std::size_t>(main));
    const auto add = [&](Image& image) {
      scene_.textures.push_back({static_cast<std::uint32_t>(scene_.images.size()), ways});
      scene_.images.push_back(std::move(image));
      return static_cast<std::int32_t>(scene_.textures.size()) - 1;
    };
    const std::int32_t base_color = add(images.base_color);
    made = std::pair(base_color, add(images.metallic_roughness));
    return made;
  }

  /// Returns the image of a texture; it is not stored in the scene.
  std::optional<Image> picture(int texture) {
    if (texture < 0) return std::nullopt;
    const auto index = static_cast<std::size_t>(texture);
    const tinygltf::Texture& from = file_.model.textures[index];
    std::optional<Image> image;
    if (const auto* webp = find(from.extensions, "EXT_texture_webp")) {
      image = read_image(static_cast<int>(number(*webp, "source", -1)), index);
    }
    if (!image) image = read_image(from.source, index);
    if (!image && from.source < 0) remark_on(from, index);
    return image;
  }

  void texture(TextureSlot slot, const Use& from, const std::string& what, MovableMaterial& movable) {
    auto to = texture_use(slot, from, what, movable);
    if (!to) return;
    to->texture = texture_of(static_cast<std::size_t>(from.index));
    use_of(movable.now, slot) = *to;
  }

  /// Returns a texture use with its transform, without the texture. Nullopt if there is none or it cannot be read.
  std::optional<TextureUse> texture_use(TextureSlot slot, const Use& from, const std::string& what,
                                        MovableMaterial& movable) {
    if (from.index < 0) return std::nullopt;
    if (static_cast<std::size_t>(from.index) >= file_.model.textures.size()) {
      malformed(what + ": there is no texture " + std::to_string(from.index));
    }
    TextureUse to;
    int uv_set = from.uv_set;
    if (from.transform != nullptr) {
      uv_set = static_cast<int>(number(*from.transform, "texCoord", uv_set));
      const auto offset = numbers(*from.transform, "offset", {0.0, 0.0}, what);
      const auto scale = numbers(*from.transform, "scale", {1.0, 1.0}, what);
      TextureTransform& transform = movable.transforms[static_cast<std::size_t>(slot)];
      transform = {{offset[0], offset[1]}, number(*from.transform, "rotation", 0.0), {scale[0], scale[1]}};
      to.transform = transform.matrix();
    }
    if (uv_set > 1) {
      log_.warning(name_ + ": " + what + " uses TEXCOORD_" + std::to_string(uv_set) +
                   " for a texture, which is ignored: only sets 0 and 1 are supported");
      return std::nullopt;
    }
    to.uv_set = static_cast<std::uint32_t>(uv_set);
    return to;
  }

  /// Returns the index of a glTF texture in Scene::textures; -1 if its image cannot be read.
  std::int32_t texture_of(std::size_t index) {
    const auto known = textures_.find(index);
    if (known != textures_.end()) return known->second;
    const tinygltf::Texture& from = file_.model.textures[index];
    std::int32_t scene_index = -1;
    const Sampler made = sampler(from.sampler, index);
    std::int64_t image = -1;
    // The core image is the fallback for the extension's.
    if (const auto* webp = find(from.extensions, "EXT_texture_webp")) {
      image = image_of(static_cast<int>(number(*webp, "source", -1)), index);
    }
    if (image < 0) image = image_of(from.source, index);
    if (image < 0 && from.source < 0) remark_on(from, index);
    if (image >= 0) {
      scene_index = static_cast<std::int32_t>(scene_.textures.size());
      scene_.textures.push_back({static_cast<std::uint32_t>(image), made});
    }
    textures_[index] = scene_index;
    return scene_index;
  }

  /// Logs textures with only an image of an unsupported extension, such as KHR_texture_basisu. A texture without any
  /// image is white, as specified.
  void remark_on(const tinygltf::Texture& from, std::size_t index) {
    for (const auto& [extension, value] : from.extensions) {
      if (extension == "EXT_texture_webp") continue;  // already logged
      log_.warning(name_ + ": " + numbered("texture", index) + " has only an image with " + one_line(extension) +
                   ", and is ignored");
      return;
    }
  }

  /// Returns the index of a glTF image in Scene::images; -1 if the number is negative or the image cannot be read.
  std::int64_t image_of(int number, std::size_t index) {
    if (number < 0) return -1;
    const auto known = images_.find(number);
    if (known != images_.end()) return known->second;
    std::int64_t scene_index = -1;
    if (auto image = read_image(number, index)) {
      scene_index = static_cast<std::int64_t>(scene_.images.size());
      scene_.images.push_back(std::move(*image));
    }
    images_[number] = scene_index;
    return scene_index;
  }

  /// Decodes the glTF image of a texture. An image that cannot be read is logged as a warning.
  std::optional<Image> read_image(int number, std::size_t index) {
    if (number < 0) return std::nullopt;
    const auto source = static_cast<std::size_t>(number);
    if (source >= file_.images.size()) {
      malformed(numbered("texture", index) + ": there is no image " + std::to_string(source));
    }
    check(progress_);
    const ImageSource& image = file_.images[source];
    try {
      DecodedImage decoded = load(image);
      if (!decoded.damage.empty()) {
        log_.warning(name_ + ": " + called(source) + " is damaged and partly shown: " + decoded.damage);
      }
      decoded.image.name = image.name;
      return std::move(decoded.image);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::file) throw;
      log_.warning(name_ + ": " + called(source) + " is ignored: " + error.what());
    }
    return std::nullopt;
  }

  [[nodiscard]] std::string called(std::size_t image) const {
    const std::string& name = file_.images[image].name;
    return numbered("image", image) + (name.empty() ? "" : " (" + name + ")");
  }

  DecodedImage load(const ImageSource& image) {
    if (image.view >= 0) return decode_image(file_.view(image.view), file_.storage, budget_);
    if (image.uri.empty()) malformed("it has neither a URI nor a buffer view");
    const auto bytes = std::make_shared<const std::vector<std::uint8_t>>(resolve_uri(image.uri, file_.folder, budget_));
    try {
      DecodedImage decoded = decode_image(*bytes, bytes, budget_);
      if (!decoded.damage.empty() && !is_data_uri(image.uri)) decoded.damage.insert(0, one_line(image.uri) + ": ");
      return decoded;
    } catch (const Error& error) {
      if (is_data_uri(image.uri)) throw;
      throw Error(error.code(), one_line(image.uri) + " " + error.what());
    }
  }

  Sampler sampler(int index, std::size_t texture) {
    Sampler to;
    if (index < 0) return to;
    if (static_cast<std::size_t>(index) >= file_.model.samplers.size()) {
      malformed(numbered("texture", texture) + ": there is no sampler " + std::to_string(index));
    }
    const tinygltf::Sampler& from = file_.model.samplers[static_cast<std::size_t>(index)];
    const auto wrap = [](int mode) {
      if (mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return Wrap::clamp;
      return mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? Wrap::mirrored : Wrap::repeat;
    };
    to.wrap_s = wrap(from.wrapS);
    to.wrap_t = wrap(from.wrapT);
    if (from.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST) to.magnify = Filter::nearest;
    switch (from.minFilter) {
      case TINYGLTF_TEXTURE_FILTER_NEAREST:
      case TINYGLTF_TEXTURE_FILTER_LINEAR:
        to.mipmaps = false;
        break;
      case TINYGLTF_TEXTURE_FILTER_NEAREST_MIPMAP_NEAREST:
      case TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_NEAREST:
        to.between_mipmaps = Filter::nearest;
        break;
      default:
        break;
    }
    if (from.minFilter == TINYGLTF_TEXTURE_FILTER_NEAREST ||
        from.minFilter == TINYGLTF_TEXTURE_FILTER_NEAREST_MIPMAP_NEAREST ||
        from.minFilter == TINYGLTF_TEXTURE_FILTER_NEAREST_MIPMAP_LINEAR) {
      to.minify = Filter::nearest;
    }
    return to;
  }

  const GltfFile& file_;
  const Log& log_;
  const std::string& name_;
  Budget& budget_;
  Progress* progress_;
  Scene& scene_;
  std::map<std::size_t, std::int32_t> textures_;
  std::map<int, std::int64_t> images_;
  /// Key: textures and factors.
  using Conversion = std::pair<std::array<int, 2>, std::array<float, 8>>;
  std::map<Conversion, std::optional<std::pair<std::int32_t, std::int32_t>>> converted_;
  std::size_t approximated_ = 0;
};

}  // namespace

std::vector<MovableMaterial> import_materials(const GltfFile& file, const Log& log, const std::string& name,
                                              Budget& budget, Progress* progress, Scene& scene) {
  return Materials(file, log, name, budget, progress, scene).import();
}

MovableLight import_light(const tinygltf::Light& light, const std::string& what) {
  MovableLight movable;
  PunctualLight& to = movable.now;
  if (light.type == "directional") {
    to.kind = PunctualLight::Kind::directional;
  } else if (light.type == "spot") {
    to.kind = PunctualLight::Kind::spot;
  } else if (light.type != "point") {
    malformed(what + ": type \"" + one_line(light.type) + "\" is unknown in KHR_lights_punctual");
  }
  if (!light.color.empty() && light.color.size() != 3) malformed(what + ": color does not have 3 numbers");
  if (!light.color.empty()) movable.color = color(light.color);
  movable.intensity = positive(light.intensity);
  to.intensity = movable.color * movable.intensity;
  to.range = positive(light.range);
  if (to.kind == PunctualLight::Kind::spot) {
    const double outer = std::clamp(light.spot.outerConeAngle, 0.0, std::numbers::pi / 2);
    to.outer_cone = narrow(outer);
    to.inner_cone = narrow(std::clamp(light.spot.innerConeAngle, 0.0, outer));
  }
  return movable;
}

SceneCamera import_camera(const tinygltf::Camera& camera, const std::string& what) {
  SceneCamera to;
  to.name = one_line(camera.name);
  if (camera.type == "perspective") {
    const auto& from = camera.perspective;
    if (!(from.yfov > 0.0) || from.yfov >= std::numbers::pi || !(from.znear > 0.0) || from.aspectRatio < 0.0 ||
        (from.zfar != 0.0 && from.zfar <= from.znear)) {
      malformed(what + " has a malformed perspective");
    }
    to.vertical_fov = from.yfov;
    to.aspect = from.aspectRatio;
    to.near_plane = from.znear;
    to.far_plane = from.zfar;
  } else if (camera.type == "orthographic") {
    const auto& from = camera.orthographic;
    if (from.ymag == 0.0 || from.xmag == 0.0 || from.znear < 0.0 || from.zfar <= from.znear) {
      malformed(what + " has a malformed orthographic projection");
    }
    to.orthographic = true;
    to.height = 2.0 * std::abs(from.ymag);
    to.aspect = std::abs(from.xmag / from.ymag);
    to.near_plane = from.znear;
    to.far_plane = from.zfar;
  } else {
    malformed(what + ": type \"" + one_line(camera.type) + "\" is unknown");
  }
  return to;
}

}  // namespace cumulet::surface::detail
