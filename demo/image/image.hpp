#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cumulet::image {

/// Linear RGBA; the first pixel is at the top left.
struct Image {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<float> rgba;  // width x height x 4
};

enum class ToneMapping {
  neutral,  // Khronos PBR Neutral, see below
  none      // clipped at 1, for debug views whose colors have a meaning
};

struct PngOptions {
  double exposure_stops = 0.0;  // radiance is multiplied by 2^stops before tone mapping
  ToneMapping tone_mapping = ToneMapping::neutral;
  bool keep_alpha = false;  // false: write opaque alpha
};

/// Khronos PBR Neutral: https://github.com/KhronosGroup/ToneMapping. Keeps values up to 0.8 except for a small toe of
/// 0.04, and compresses highlights smoothly towards white with constant hue. White sunlit clouds stay white and soft,
/// and blue shadows keep their color; the ACES fits add contrast and shift hues. Input and output are linear RGB (Rec.
/// 709); negative values and NaN become 0.
[[nodiscard]] std::array<float, 3> tone_map_neutral(std::array<float, 3> rgb);

/// sRGB transfer function, [0, 1] to [0, 1].
[[nodiscard]] float srgb_encode(float linear);
[[nodiscard]] float srgb_decode(float encoded);

// All writers replace the file atomically (replace_file in file.hpp). Readers and writers throw std::runtime_error, one
// line with the path and the cause.

/// Writes 8 bits per channel in sRGB, with the chunks sRGB, gAMA and cHRM.
void write_png(const std::string& path, const Image& image, const PngOptions& options = {});
/// Writes bytes, width x height x 4, straight alpha; the first pixel is at the top left.
void write_png(const std::string& path, std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgba);
/// Writes lossless WebP from bytes as write_png. The sides may have up to 16383 pixels. Throws also if the programs
/// were built without WebP.
void write_webp(const std::string& path, std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgba);
/// Writes OpenEXR with the channels R, G, B, A as one unnamed layer (layers.hpp). Values stay linear and unchanged.
void write_exr(const std::string& path, const Image& image);
/// Writes a portable float map: RGB without alpha, little-endian, bottom row first. Values stay linear and unchanged.
void write_pfm(const std::string& path, const Image& image);

/// The bytes of a PNG, width x height x 4, straight alpha; the first pixel is at the top left.
struct PngPixels {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> rgba;
};
/// Decodes the content of a PNG file. name: for errors.
[[nodiscard]] PngPixels decode_png(std::string_view file, const std::string& name);
/// Decodes with the sRGB curve only: tone mapping is not inverted.
[[nodiscard]] Image read_png(const std::string& path);
/// Reads the channels R, G, B (missing: 0) and A (missing: 1) of any type.
[[nodiscard]] Image read_exr(const std::string& path);
/// Reads PF or Pf (gray) in either byte order; alpha is 1.
[[nodiscard]] Image read_pfm(const std::string& path);

}  // namespace cumulet::image
