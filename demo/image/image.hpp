#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace cumulet::image {

/// Linear RGBA, first pixel top left.
struct Image {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<float> rgba;  // width x height x 4
};

enum class ToneMapping {
  neutral,  // Khronos PBR Neutral, below
  none      // clipped at 1: for pictures whose colours are a legend
};

struct PngOptions {
  double exposure_stops = 0.0;  // radiance is multiplied by 2^stops before tone mapping
  ToneMapping tone_mapping = ToneMapping::neutral;
  bool keep_alpha = false;  // else opaque
};

/// Khronos PBR Neutral: https://github.com/KhronosGroup/ToneMapping. Leaves everything up to 0.8 as it is but for a
/// small toe of 0.04, and rolls highlights off smoothly towards white, hue kept. So the white of a sunlit cloud
/// stays white and soft, and the blue of its shadows stays the scene's blue, where the ACES fits add contrast and
/// shift hues. Takes and gives linear RGB (Rec. 709); 0 for what is negative or not a number.
[[nodiscard]] std::array<float, 3> tone_map_neutral(std::array<float, 3> rgb);

/// The sRGB transfer curve, [0, 1] to [0, 1].
[[nodiscard]] float srgb_encode(float linear);
[[nodiscard]] float srgb_decode(float encoded);

// All writers replace the file in one step (replace_file in file.hpp) and throw std::runtime_error, one line with
// the path and the cause. The readers throw likewise.

/// 8 bits a channel, sRGB, with chunks that say so (sRGB, gAMA and cHRM).
void write_png(const std::string& path, const Image& image, const PngOptions& options = {});
/// The same from bytes, width x height x 4, first pixel top left, straight alpha.
void write_png(const std::string& path, std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgba);
/// OpenEXR: the one layer of channels R, G, B, A, as layers.hpp writes it; linear, untouched.
void write_exr(const std::string& path, const Image& image);
/// Portable float map: RGB (alpha is dropped), little-endian, bottom row first; linear, untouched.
void write_pfm(const std::string& path, const Image& image);

/// Back to linear by the sRGB curve alone: tone mapping is not undone.
[[nodiscard]] Image read_png(const std::string& path);
/// Channels R, G, B (a missing one is 0) and A (missing: 1), whatever their type.
[[nodiscard]] Image read_exr(const std::string& path);
/// PF or Pf (grey), either byte order; alpha is 1.
[[nodiscard]] Image read_pfm(const std::string& path);

}  // namespace cumulet::image
