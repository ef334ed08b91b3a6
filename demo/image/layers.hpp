#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace cumulet::image {

/// What a layer of an OpenEXR file is called. A channel's full name is "NAME.LETTER", or the letter alone in the layer
/// without a name, which is the picture proper. Letters, for Blender 3 skips channels of longer names.
struct LayerName {
  std::string_view name;
  std::string_view channels;  // one letter each
};

/// The layers of a rendered picture, in one place; docs/aovs.md says what they hold and why they are called so.
namespace layers {
inline constexpr LayerName beauty{"", "RGBA"};
inline constexpr LayerName denoised{"denoised", "RGBA"};
inline constexpr LayerName volume{"volume", "RGBA"};
inline constexpr LayerName transmittance{"transmittance", "Y"};
inline constexpr LayerName depth{"depth", "Z"};
inline constexpr LayerName volume_depth{"volume_depth", "Z"};
inline constexpr LayerName normal{"normal", "XYZ"};
inline constexpr LayerName albedo{"albedo", "RGB"};
inline constexpr LayerName error{"error", "Y"};
inline constexpr LayerName velocity{"velocity", "XYZ"};
inline constexpr LayerName backward{"backward", "uv"};
inline constexpr LayerName volume_backward{"volume_backward", "uv"};
/// Of mattes, before the number of each layer of two ranks.
inline constexpr std::string_view cryptomatte_prefix = "CryptoObject";
inline constexpr std::string_view cryptomatte_channels = "RGBA";
/// Of a group of lights, before its name: as Blender calls them.
inline constexpr std::string_view light_group_prefix = "Combined_";
inline constexpr std::string_view light_group_channels = "RGB";
}  // namespace layers

/// In a depth layer: nothing there. Blender's own; finite, so that filters of a compositor make no NaN of it.
inline constexpr float no_depth = 1e10f;

/// A layer to write: width x height pixels of all its channels in turn, first pixel top left.
struct Layer {
  LayerName name;
  std::span<const float> values;
};

/// What a file says of its picture beside the pixels. Matrices are as OpenEXR has them: a row vector from the left, 16
/// numbers row by row, which are OpenGL's column by column.
struct Attribute {
  std::string name;  // up to 31 bytes, so that readers of OpenEXR 1 take the file
  std::variant<std::string, float, double, std::array<float, 2>, std::array<double, 3>, std::array<float, 16>> value;
};

/// Where a file's pixels are: OpenEXR's data window, within its display window, which begins at 0.
struct Windows {
  std::uint32_t width = 0;  // of the pixels
  std::uint32_t height = 0;
  std::uint32_t left = 0;  // of the picture that they are of
  std::uint32_t top = 0;
  std::uint32_t whole_width = width;  // of that
  std::uint32_t whole_height = height;
  bool operator==(const Windows&) const = default;
};

/// OpenEXR, one part, scanlines, ZIP, 32-bit float channels with the layers' values untouched; Rec. 709 primaries.
/// Replaces the file and throws as write_exr(path, image) does; std::logic_error for values that do not match the size,
/// for two channels of one name and for a name that no attribute may have.
void write_exr(const std::string& path, const Windows& windows, std::span<const Layer> layers,
               std::span<const Attribute> attributes = {});
/// Of a whole picture.
inline void write_exr(const std::string& path, std::uint32_t width, std::uint32_t height, std::span<const Layer> layers,
                      std::span<const Attribute> attributes = {}) {
  write_exr(path, Windows{width, height}, layers, attributes);
}

/// What a file says of its picture beside the pixels.
struct Contents {
  Windows windows;
  std::vector<std::string> channels;  // full names, in the order of their letters
  std::vector<Attribute> attributes;  // of the types that Attribute has; not those that OpenEXR itself needs
};
/// Of the header alone. Throws std::runtime_error, one line with the path and the cause.
[[nodiscard]] Contents read_contents(const std::string& path);

/// A layer read back.
struct Pixels {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<float> values;  // as in Layer
};

/// Throws std::runtime_error, one line with the path and the cause; a channel that the file lacks is one.
[[nodiscard]] Pixels read_exr(const std::string& path, const LayerName& layer);

}  // namespace cumulet::image
