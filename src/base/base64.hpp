#pragma once

#include <cstddef>
#include <cstdint>

namespace cumulet {

/// Decodes base64 in either alphabet of RFC 4648, one character after another. White space is ignored, and padding may
/// be missing.
class Base64Decoder {
 public:
  enum class Step { more, byte, bad };

  /// Takes a character. byte: the next byte is complete. bad: the character is not of base64, or it follows padding.
  Step take(char c) {
    if (c == ' ' || (c >= '\t' && c <= '\r')) return Step::more;
    ++characters_;
    if (c == '=') {
      padded_ = true;
      return Step::more;
    }
    const int value = digit(c);
    if (value < 0 || padded_) return Step::bad;
    bits_ = bits_ << 6U | static_cast<std::uint32_t>(value);
    count_ += 6;
    if (count_ < 8) return Step::more;
    count_ -= 8;
    return Step::byte;
  }
  [[nodiscard]] std::uint8_t byte() const { return static_cast<std::uint8_t>(bits_ >> count_); }
  /// Returns true at the beginning and behind each group of four characters, where padding ends.
  [[nodiscard]] bool is_between_groups() const { return characters_ % 4 == 0; }

 private:
  static int digit(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    if (c == '+' || c == '-') return 62;
    if (c == '/' || c == '_') return 63;
    return -1;
  }

  std::uint32_t bits_ = 0;  // those not yet returned are the lowest `count_`
  unsigned count_ = 0;
  std::size_t characters_ = 0;
  bool padded_ = false;
};

}  // namespace cumulet
