#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>

#include "checks.hpp"
#include "file.hpp"
#include "image.hpp"

namespace cumulet::image {
namespace {

std::uint32_t swap_bytes(std::uint32_t v) {
  return (v >> 24) | ((v >> 8) & 0xff00u) | ((v << 8) & 0xff0000u) | (v << 24);
}

/// Returns the next word of the header and skips one white-space character after it.
std::string_view next_word(std::string_view& rest) {
  constexpr std::string_view space = " \t\r\n";
  const auto end = rest.find_first_of(space);
  if (end == std::string_view::npos) return {};
  const std::string_view word = rest.substr(0, end);
  rest.remove_prefix(end + 1);
  return word;
}

template <class Number>
Number number(const std::string& path, std::string_view word) {
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) fail(path, "not a portable float map: bad header");
  return value;
}

}  // namespace

void write_pfm(const std::string& path, const Image& image) {
  check_image(path, image);
  std::string bytes = "PF\n" + std::to_string(image.width) + " " + std::to_string(image.height) + "\n-1.0\n";
  std::size_t at = bytes.size();
  bytes.resize(at + std::size_t{12} * image.width * image.height);
  for (std::size_t y = image.height; y-- > 0;) {
    for (std::size_t x = 0; x < image.width; ++x) {
      for (std::size_t c = 0; c < 3; ++c, at += 4) {
        auto bits = std::bit_cast<std::uint32_t>(image.rgba[4 * (y * image.width + x) + c]);
        if constexpr (std::endian::native == std::endian::big) bits = swap_bytes(bits);
        std::memcpy(&bytes[at], &bits, 4);
      }
    }
  }
  replace_file(path, bytes);
}

Image read_pfm(const std::string& path) {
  const std::string bytes = read_file(path);
  std::string_view rest = bytes;
  const std::string_view kind = next_word(rest);
  if (kind != "PF" && kind != "Pf") fail(path, "not a portable float map");
  const std::size_t channels = kind == "PF" ? 3 : 1;
  const auto width = number<std::int64_t>(path, next_word(rest));
  const auto height = number<std::int64_t>(path, next_word(rest));
  const auto scale = number<double>(path, next_word(rest));
  check_size(path, width, height);
  if (scale == 0.0 || !std::isfinite(scale)) fail(path, "not a portable float map: bad scale");
  const bool little = scale < 0.0;

  Image image{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), {}};
  const std::size_t pixels = std::size_t{image.width} * image.height;
  if (rest.size() != pixels * channels * 4) fail(path, "truncated or too long for its size");
  image.rgba.resize(pixels * 4, 1.0f);
  std::size_t at = 0;
  for (std::size_t y = image.height; y-- > 0;) {
    for (std::size_t x = 0; x < image.width; ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        std::uint32_t bits = 0;
        std::memcpy(&bits, rest.data() + at, 4);
        if (channels == 3 || c == 2) at += 4;
        if (little != (std::endian::native == std::endian::little)) bits = swap_bytes(bits);
        image.rgba[4 * (y * image.width + x) + c] = std::bit_cast<float>(bits);
      }
    }
  }
  return image;
}

}  // namespace cumulet::image
