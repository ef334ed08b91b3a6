#include "aovs.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

namespace cumulet::demo {

image::LayerName layer_of(cumulet_aov aov) {
  switch (aov) {
    case CUMULET_AOV_VOLUME:
      return image::layers::volume;
    case CUMULET_AOV_TRANSMITTANCE:
      return image::layers::transmittance;
    case CUMULET_AOV_SURFACE_DEPTH:
      return image::layers::depth;
    case CUMULET_AOV_VOLUME_DEPTH:
      return image::layers::volume_depth;
    case CUMULET_AOV_NORMAL:
      return image::layers::normal;
    case CUMULET_AOV_ALBEDO:
      return image::layers::albedo;
    case CUMULET_AOV_ERROR:
      return image::layers::error;
    case CUMULET_AOV_VELOCITY:
      return image::layers::velocity;
    case CUMULET_AOV_MOTION:
      return image::layers::backward;
    case CUMULET_AOV_VOLUME_MOTION:
      return image::layers::volume_backward;
    case CUMULET_AOV_BEAUTY:
      break;
  }
  return image::layers::beauty;
}

namespace {

constexpr std::uint32_t matte_ranks = 6;  // the usual number of ranks in other renderers
constexpr std::uint32_t matte_layers = matte_ranks / 2;

std::string matte_digits(std::string_view name) {
  std::array<char, 9> digits{};
  std::snprintf(digits.data(), digits.size(), "%08x", cumulet_cryptomatte_id(std::string(name).c_str()));
  return digits.data();
}

/// Reads a viewer's Cryptomatte: the ID/coverage layers, and the ID of each object name.
class Mattes {
 public:
  explicit Mattes(const ObjectName& name) : name_(name) {}

  cumulet_status read(cumulet_viewer* viewer, std::size_t pixels) {
    std::vector<float> pairs(pixels * 2 * matte_ranks);
    const cumulet_status status =
        cumulet_read_cryptomatte(viewer, name_of_object, this, matte_ranks, pairs.data(), pairs.size());
    for (std::vector<float>& layer : layers_) layer.reserve(4 * pixels);
    for (std::size_t i = 0; i < pairs.size(); ++i) layers_[i / 4 % matte_layers].push_back(pairs[i]);
    return status;
  }
  [[nodiscard]] const std::vector<float>& layer(std::size_t number) const { return layers_.at(number); }
  /// Returns the attributes that the Cryptomatte specification requires.
  [[nodiscard]] std::vector<image::Attribute> attributes() const {
    const std::string of = "cryptomatte/" + matte_digits(image::layers::cryptomatte_prefix).substr(0, 7) + "/";
    nlohmann::json manifest = nlohmann::json::object();
    for (const auto& [name, digits] : ids_) manifest[name] = digits;
    return {{of + "name", std::string(image::layers::cryptomatte_prefix)},
            {of + "hash", std::string("MurmurHash3_32")},
            {of + "conversion", std::string("uint32_to_float32")},
            {of + "manifest", manifest.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)}};
  }

 private:
  static const char* name_of_object(void* user, cumulet_object_kind kind, std::uint64_t tag,
                                    std::uint32_t /*transform_index*/) noexcept {
    auto& mattes = *static_cast<Mattes*>(user);
    const std::string name = mattes.name_(kind, tag);
    if (name.empty()) return nullptr;
    return mattes.ids_.emplace(name, matte_digits(name)).first->first.c_str();
  }

  const ObjectName& name_;
  std::map<std::string, std::string> ids_;  // object name -> ID as 8 hexadecimal digits
  std::array<std::vector<float>, matte_layers> layers_;
};

/// Returns the pixels of the render region.
std::vector<float> cut(const image::Windows& windows, std::span<const float> whole) {
  const std::size_t channels = whole.size() / (std::size_t{windows.whole_width} * windows.whole_height);
  std::vector<float> part;
  part.reserve(channels * windows.width * windows.height);
  for (std::size_t y = 0; y < windows.height; ++y) {
    const std::size_t row = ((windows.top + y) * windows.whole_width + windows.left) * channels;
    const std::span<const float> pixels = whole.subspan(row, channels * windows.width);
    part.insert(part.end(), pixels.begin(), pixels.end());
  }
  return part;
}

}  // namespace

image::Windows windows_of(const float (&region)[4], std::uint32_t width, std::uint32_t height) {
  std::uint32_t pixels[4] = {};
  if (cumulet_region_pixels(region, width, height, pixels) != CUMULET_OK)
    throw std::logic_error("the region or the size is invalid");
  return {pixels[2], pixels[3], pixels[0], pixels[1], width, height};
}

void clear_around(const image::Windows& windows, std::span<std::uint8_t> rgba) {
  for (std::size_t i = 0; i < rgba.size(); ++i) {
    const std::size_t x = i / 4 % windows.whole_width;
    const std::size_t y = i / 4 / windows.whole_width;
    const bool inside =
        x >= windows.left && x < windows.left + windows.width && y >= windows.top && y < windows.top + windows.height;
    if (!inside) rgba[i] = 0;
  }
}

void write_exr(cumulet_viewer* viewer, const std::string& path, const image::Windows& windows,
               const WrittenPicture& picture, std::span<const cumulet_aov> aovs,
               std::span<const image::Attribute> attributes) {
  std::vector<std::vector<float>> values;
  std::vector<image::Layer> layers;
  std::vector<std::string> names;  // storage for layer names that are built here; `layers` refers to them
  std::vector<image::Attribute> said(attributes.begin(), attributes.end());
  values.reserve(2 + picture.light_groups.size() + aovs.size() + matte_layers);
  names.reserve(picture.light_groups.size() + matte_layers);
  const auto add = [&](const image::LayerName& name, std::span<const float> pixels) {
    layers.push_back({name, values.emplace_back(cut(windows, pixels))});
  };
  add(image::layers::beauty, picture.beauty);
  if (!picture.denoised.empty()) add(image::layers::denoised, picture.denoised);
  std::vector<float> pixels;
  const auto check = [&](cumulet_status status) {
    if (status != CUMULET_OK) throw std::runtime_error(path + ": " + cumulet_last_error(viewer));
  };
  for (std::uint32_t group = 0; group < picture.light_groups.size(); ++group) {
    const std::string& name = names.emplace_back(image::layers::light_group_prefix) += picture.light_groups[group];
    pixels.resize(std::size_t{3} * windows.whole_width * windows.whole_height);
    check(cumulet_read_light_group(viewer, group, pixels.data(), pixels.size()));
    add({name, image::layers::light_group_channels}, pixels);
  }
  for (const cumulet_aov aov : aovs) {
    const image::LayerName name = layer_of(aov);
    pixels.resize(std::size_t{windows.whole_width} * windows.whole_height * name.channels.size());
    check(cumulet_read_aov(viewer, aov, pixels.data(), pixels.size()));
    if (aov == CUMULET_AOV_SURFACE_DEPTH || aov == CUMULET_AOV_VOLUME_DEPTH) {
      for (float& z : pixels) z = std::isfinite(z) ? z : image::no_depth;
    }
    add(name, pixels);
  }
  if (picture.object_name) {
    Mattes mattes(picture.object_name);
    check(mattes.read(viewer, std::size_t{windows.whole_width} * windows.whole_height));
    for (std::uint32_t i = 0; i < matte_layers; ++i) {
      const std::string& name =
          names.emplace_back(image::layers::cryptomatte_prefix).append("0").append(std::to_string(i));
      add({name, image::layers::cryptomatte_channels}, mattes.layer(i));
    }
    for (image::Attribute& attribute : mattes.attributes()) said.push_back(std::move(attribute));
  }
  image::write_exr(path, windows, layers, said);
}

}  // namespace cumulet::demo
