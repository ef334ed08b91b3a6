#include "base/one_line.hpp"

#include <cstdint>

namespace cumulet {

namespace {

/// A character of a text. If `good` is false it is one byte that is not valid UTF-8.
struct Character {
  std::size_t bytes = 1;
  std::uint32_t code = 0;
  bool good = false;
};

std::uint32_t byte_at(std::string_view text, std::size_t at) { return static_cast<unsigned char>(text[at]); }

/// Decodes the first character (RFC 3629).
Character first_of(std::string_view text) {
  const std::uint32_t lead = byte_at(text, 0);
  if (lead < 0x80) return {1, lead, true};
  const std::size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < bytes) return {};
  std::uint32_t code = lead & (0x7FU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte_at(text, i) & 0xC0U) != 0x80) return {};
    code = code << 6U | (byte_at(text, i) & 0x3FU);
  }
  const bool too_long = (bytes == 3 && code < 0x800) || (bytes == 4 && code < 0x10000);
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (too_long || surrogate || code > 0x10FFFF) return {};
  return {bytes, code, true};
}

/// True for blanks and control characters, including ISO 6429's second set and Unicode's line breaks.
bool is_blank(std::uint32_t code) {
  return code <= 0x20 || (code >= 0x7F && code <= 0xA0) || code == 0x2028 || code == 0x2029;
}

}  // namespace

std::string one_line(std::string_view text, std::size_t longest) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string line;
  while (!text.empty()) {
    const Character c = first_of(text);
    const std::string_view bytes = text.substr(0, c.bytes);
    text.remove_prefix(c.bytes);
    const bool blank = c.good && is_blank(c.code);
    if (blank && (line.empty() || line.back() == ' ')) continue;
    if (blank) {
      line.append(1, ' ');
    } else if (c.good) {
      line.append(bytes);
    } else {
      const std::uint32_t byte = byte_at(bytes, 0);
      line.append("\\x").append(1, digits[byte / 16]).append(1, digits[byte % 16]);
    }
    if (line.size() >= longest && !text.empty()) {
      line.append(3, '.');
      break;
    }
  }
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line;
}

}  // namespace cumulet
