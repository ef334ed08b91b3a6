// PNG with stb, which is compiled in (stb.c). The portable package then contains no libpng in addition to OpenEXR's
// zlib, and the glTF importer needs stb anyway.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <string_view>

#include "checks.hpp"
#include "file.hpp"
#include "image.hpp"

#define STBI_ONLY_PNG
#define STBI_NO_STDIO
#define STBI_WRITE_NO_STDIO
#include <stb_image.h>
#include <stb_image_write.h>

namespace cumulet::image {
namespace {

std::uint8_t to_byte(float unit) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(unit, 0.0f, 1.0f) * 255.0f));
}

/// Clamps a value to 0 and a large finite number; NaN becomes 0.
float displayable(float value) {
  if (!(value > 0.0f)) return 0.0f;
  return std::min(value, 1e30f);
}

void append_big_endian(std::string& bytes, std::uint32_t value) {
  for (const unsigned shift : {24u, 16u, 8u, 0u}) bytes += static_cast<char>(value >> shift & 0xffu);
}

/// The CRC of PNG 1.2, annex D.
std::uint32_t crc(std::string_view bytes) {
  std::uint32_t value = 0xffffffffu;
  for (const char byte : bytes) {
    value ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) value = (value & 1u) != 0 ? 0xedb88320u ^ value >> 1u : value >> 1u;
  }
  return ~value;
}

void append_chunk(std::string& file, const char* type, std::string_view data) {
  append_big_endian(file, static_cast<std::uint32_t>(data.size()));
  const std::string typed = std::string(type).append(data);
  file += typed;
  append_big_endian(file, crc(typed));
}

/// Returns the sRGB chunk, and gAMA and cHRM with the equivalent values for readers that do not support it (PNG 1.2,
/// 4.2.2.3).
std::string color_chunks() {
  constexpr std::uint32_t gamma = 45455;
  constexpr std::array<std::uint32_t, 8> white_and_primaries = {31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000};
  std::string chunks;
  append_chunk(chunks, "sRGB", std::string_view("\0", 1));  // perceptual intent
  std::string data;
  append_big_endian(data, gamma);
  append_chunk(chunks, "gAMA", data);
  data.clear();
  for (const std::uint32_t value : white_and_primaries) append_big_endian(data, value);
  append_chunk(chunks, "cHRM", data);
  return chunks;
}

void write_bytes(const std::string& path, std::uint32_t width, std::uint32_t height, std::size_t channels,
                 std::span<const std::uint8_t> bytes) {
  std::string file;
  const auto append = [](void* context, void* data, int size) {
    static_cast<std::string*>(context)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
  };
  const auto row = static_cast<int>(width);
  if (stbi_write_png_to_func(append, &file, row, static_cast<int>(height), static_cast<int>(channels), bytes.data(),
                             row * static_cast<int>(channels)) == 0)
    fail(path, "the PNG encoder failed; the image may be too large");
  constexpr std::size_t after_header = 8 + 25;  // signature and IHDR
  file.insert(after_header, color_chunks());
  replace_file(path, file);
}

}  // namespace

std::array<float, 3> tone_map_neutral(std::array<float, 3> rgb) {
  constexpr float start = 0.8f - 0.04f;
  constexpr float desaturation = 0.15f;
  for (float& c : rgb) c = displayable(c);
  const float least = std::min({rgb[0], rgb[1], rgb[2]});
  const float offset = least < 0.08f ? least - 6.25f * least * least : 0.04f;
  for (float& c : rgb) c -= offset;
  const float peak = std::max({rgb[0], rgb[1], rgb[2]});
  if (peak < start) return rgb;
  constexpr float room = 1.0f - start;
  const float new_peak = 1.0f - room * room / (peak + room - start);
  const float keep = 1.0f / (desaturation * (peak - new_peak) + 1.0f);
  for (float& c : rgb) c = new_peak + (c * (new_peak / peak) - new_peak) * keep;
  return rgb;
}

float srgb_encode(float linear) {
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

float srgb_decode(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

void write_png(const std::string& path, const Image& image, const PngOptions& options) {
  check_image(path, image);
  const auto exposure = static_cast<float>(std::exp2(options.exposure_stops));
  const std::size_t channels = options.keep_alpha ? 4 : 3;
  const std::size_t pixels = std::size_t{image.width} * image.height;
  std::vector<std::uint8_t> bytes(pixels * channels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* in = &image.rgba[4 * i];
    std::uint8_t* out = &bytes[channels * i];
    std::array<float, 3> rgb = {in[0] * exposure, in[1] * exposure, in[2] * exposure};
    if (options.tone_mapping == ToneMapping::neutral) rgb = tone_map_neutral(rgb);
    for (std::size_t c = 0; c < 3; ++c) out[c] = to_byte(srgb_encode(std::min(displayable(rgb[c]), 1.0f)));
    if (options.keep_alpha) out[3] = to_byte(displayable(in[3]));
  }
  write_bytes(path, image.width, image.height, channels, bytes);
}

void write_png(const std::string& path, std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgba) {
  check_size(path, width, height);
  if (rgba.size() != std::size_t{4} * width * height)
    throw std::logic_error(path + ": an image's size and its pixels disagree");
  write_bytes(path, width, height, 4, rgba);
}

PngPixels decode_png(std::string_view file, const std::string& name) {
  int width = 0;
  int height = 0;
  int channels = 0;
  if (file.size() > 0x7fffffff) fail(name, "too large for a PNG");
  const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
      stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(file.data()), static_cast<int>(file.size()), &width,
                            &height, &channels, 4),
      stbi_image_free);
  if (pixels == nullptr) fail(name, std::string("not a readable PNG: ") + stbi_failure_reason());
  check_size(name, width, height);
  PngPixels decoded{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), {}};
  decoded.rgba.assign(pixels.get(), pixels.get() + std::size_t{4} * decoded.width * decoded.height);
  return decoded;
}

Image read_png(const std::string& path) {
  const PngPixels pixels = decode_png(read_file(path), path);
  Image image{pixels.width, pixels.height, {}};
  image.rgba.resize(pixels.rgba.size());
  for (std::size_t i = 0; i < image.rgba.size(); ++i) {
    const float value = static_cast<float>(pixels.rgba[i]) / 255.0f;
    image.rgba[i] = i % 4 == 3 ? value : srgb_decode(value);
  }
  return image;
}

}  // namespace cumulet::image
