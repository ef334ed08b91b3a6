#pragma once

#include <algorithm>
#include <aov_table.hpp>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace cumulet::image {

/// Name of a layer in an OpenEXR file. The full name of a channel is "NAME.LETTER", or only the letter in the unnamed
/// layer, which is the image itself. Single letters, because Blender 3 skips channels with longer names.
struct LayerName {
  std::string_view name;
  std::string_view channels;  // one letter each
};

/// Returns the layer of an AOV.
constexpr LayerName layer_of(const settings::Aov& aov) { return {aov.name, aov.channels}; }
constexpr LayerName layer_of(cumulet_aov aov) {
  return layer_of(*std::ranges::find(settings::aovs, aov, &settings::Aov::value));
}

/// Layers of a rendered image that code names. docs/aovs.md describes all layers.
namespace layers {
inline constexpr LayerName beauty = layer_of(CUMULET_AOV_BEAUTY);
inline constexpr LayerName denoised{"denoised", "RGBA"};
inline constexpr LayerName volume = layer_of(CUMULET_AOV_VOLUME);
inline constexpr LayerName transmittance = layer_of(CUMULET_AOV_TRANSMITTANCE);
inline constexpr LayerName depth = layer_of(CUMULET_AOV_SURFACE_DEPTH);
inline constexpr LayerName volume_depth = layer_of(CUMULET_AOV_VOLUME_DEPTH);
inline constexpr LayerName normal = layer_of(CUMULET_AOV_NORMAL);
inline constexpr LayerName albedo = layer_of(CUMULET_AOV_ALBEDO);
inline constexpr LayerName error = layer_of(CUMULET_AOV_ERROR);
inline constexpr LayerName velocity = layer_of(CUMULET_AOV_VELOCITY);
/// Prefix of the Cryptomatte layers; a layer number follows. Each layer contains two ranks.
inline constexpr std::string_view cryptomatte_prefix = "CryptoObject";
inline constexpr std::string_view cryptomatte_channels = "RGBA";
/// Prefix of light group layers, as in Blender; the group's name follows.
inline constexpr std::string_view light_group_prefix = "Combined_";
inline constexpr std::string_view light_group_channels = "RGB";
}  // namespace layers

/// Value of a depth layer for pixels without hit. Same as Blender; finite, so that filters do not turn it into NaN.
inline constexpr float no_depth = 1e10f;

/// A layer to write: width x height pixels with interleaved channels; the first pixel is at the top left.
struct Layer {
  LayerName name;
  std::span<const float> values;
};

/// An OpenEXR attribute. Matrices are as in OpenEXR, for row vectors: 16 numbers in row order, which equal OpenGL's
/// column order.
struct Attribute {
  std::string name;  // maximum 31 bytes, for readers of OpenEXR 1
  std::variant<std::string, float, double, std::array<float, 2>, std::array<double, 3>, std::array<float, 16>> value;
};

/// Location of a file's pixels: the data window within the display window, which begins at 0.
struct Windows {
  std::uint32_t width = 0;  // data window
  std::uint32_t height = 0;
  std::uint32_t left = 0;  // offset of the data window in the display window
  std::uint32_t top = 0;
  std::uint32_t whole_width = width;  // display window
  std::uint32_t whole_height = height;
  bool operator==(const Windows&) const = default;
};

/// Writes OpenEXR: one part, scanlines, ZIP, 32-bit float channels with unchanged values, Rec. 709 primaries. Replaces
/// the file and throws as write_exr(path, image). Throws std::logic_error if values do not match the size, if two
/// channels have the same name, or if an attribute's name is invalid.
void write_exr(const std::string& path, const Windows& windows, std::span<const Layer> layers,
               std::span<const Attribute> attributes = {});
/// Writes a full image, without crop.
inline void write_exr(const std::string& path, std::uint32_t width, std::uint32_t height, std::span<const Layer> layers,
                      std::span<const Attribute> attributes = {}) {
  write_exr(path, Windows{width, height}, layers, attributes);
}

/// Header of an OpenEXR file.
struct Contents {
  Windows windows;
  std::vector<std::string> channels;  // full names, in alphabetical order
  std::vector<Attribute> attributes;  // attributes with a type of Attribute, except those that OpenEXR itself requires
};
/// Reads only the header. Throws std::runtime_error, one line with the path and the cause.
[[nodiscard]] Contents read_contents(const std::string& path);

/// A layer that was read.
struct Pixels {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<float> values;  // as in Layer
};

/// Reads a layer. Throws std::runtime_error, one line with the path and the cause, also if a channel is missing.
[[nodiscard]] Pixels read_exr(const std::string& path, const LayerName& layer);

}  // namespace cumulet::image
