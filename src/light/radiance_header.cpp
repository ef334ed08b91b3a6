#include "light/radiance_header.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <system_error>

#include "base/error.hpp"
#include "base/number_parsing.hpp"
#include "base/one_line.hpp"

namespace cumulet::light {

namespace {

/// The rest of the first line differs between programs.
constexpr std::string_view identifier = "#?";
constexpr std::string_view blanks = " \t\r\v\f";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

/// Removes and returns the first word.
std::string_view take_word(std::string_view& text) {
  text = trimmed(text);
  const std::string_view word = text.substr(0, text.find_first_of(blanks));
  text.remove_prefix(word.size());
  return word;
}

/// Parses a whole text as a number with an optional sign; nullopt on failure.
template <class Number>
std::optional<Number> number_of(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  if (text.starts_with('+')) return std::nullopt;
  Number value{};
  const auto [end, error] = number_from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Parses exactly `count` finite numbers; nullopt on failure.
template <std::size_t count>
std::optional<std::array<double, count>> numbers_of(std::string_view text) {
  std::array<double, count> values{};
  for (double& value : values) {
    const auto number = number_of<double>(take_word(text));
    if (!number || !std::isfinite(*number)) return std::nullopt;
    value = *number;
  }
  if (!trimmed(text).empty()) return std::nullopt;
  return values;
}

class HeaderReader {
 public:
  HeaderReader(std::span<const std::uint8_t> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  RadianceHeader read() {
    const std::size_t known = std::min(bytes_.size(), identifier.size());
    if (!std::equal(identifier.begin(), identifier.begin() + static_cast<std::ptrdiff_t>(known), bytes_.begin())) {
      fail("neither a Radiance (.hdr) nor an OpenEXR file");
    }
    line();
    for (std::string_view text = line(); !trimmed(text).empty(); text = line()) variable(text);
    for (const double c : {header_.exposure.x, header_.exposure.y, header_.exposure.z}) {
      if (!(c > 0.0) || !std::isfinite(c) || !std::isfinite(1.0 / c)) fail("exposures out of range");
    }
    resolution(line());
    header_.size = at_;
    return std::move(header_);
  }

 private:
  [[noreturn]] void fail(const std::string& cause) const {
    throw Error(ErrorCode::file, one_line(name_) + ": " + cause);
  }
  static std::string quoted(std::string_view text) { return "'" + one_line(text, 60) + "'"; }

  std::string_view line() {
    const std::string_view rest(reinterpret_cast<const char*>(bytes_.data()) + at_, bytes_.size() - at_);
    const std::size_t end = rest.find('\n');
    if (end == std::string_view::npos) fail("truncated Radiance file");
    at_ += end + 1;
    return rest.substr(0, end);
  }

  void variable(std::string_view text) {
    const std::size_t sign = text.find('=');
    if (sign == std::string_view::npos) return;
    const std::string_view key = trimmed(text.substr(0, sign));
    const std::string_view value = trimmed(text.substr(sign + 1));
    if (key == "FORMAT") {
      format(value);
    } else if (key == "EXPOSURE") {
      header_.exposure *= glm::dvec3(positive<1>("EXPOSURE", value)[0]);
    } else if (key == "COLORCORR") {
      const auto factors = positive<3>("COLORCORR", value);
      header_.exposure *= glm::dvec3(factors[0], factors[1], factors[2]);
      header_.remarks.push_back("COLORCORR " + one_line(value, 60) + " is removed from the colors");
    } else if (key == "PRIMARIES") {
      primaries(value);
    } else if (key == "GAMMA" && number_of<double>(value) != 1.0) {
      header_.remarks.push_back("GAMMA " + one_line(value, 60) + " is ignored");
    }
  }

  void format(std::string_view value) {
    header_.xyz = value == "32-bit_rle_xyze";
    if (!header_.xyz && value != "32-bit_rle_rgbe") {
      fail("has FORMAT=" + one_line(value, 60) + ", not 32-bit_rle_rgbe or 32-bit_rle_xyze");
    }
  }

  template <std::size_t count>
  std::array<double, count> positive(const char* key, std::string_view value) const {
    const auto numbers = numbers_of<count>(value);
    if (!numbers) fail(std::string("cannot read ") + key + "=" + one_line(value, 60));
    for (const double number : *numbers) {
      if (!(number > 0.0)) fail(std::string(key) + "=" + one_line(value, 60) + " is not above 0");
    }
    return *numbers;
  }

  void primaries(std::string_view value) {
    const auto n = numbers_of<8>(value);
    if (n) {
      header_.primaries =
          Primaries{{n->at(0), n->at(1)}, {n->at(2), n->at(3)}, {n->at(4), n->at(5)}, {n->at(6), n->at(7)}};
    }
    if (n && rec709_matrix(*header_.primaries)) return;
    header_.primaries.reset();
    header_.remarks.emplace_back("its PRIMARIES are invalid; Rec. 709 is assumed");
  }

  /// Parses "-Y HEIGHT +X WIDTH", with any signs and order.
  void resolution(std::string_view text) {
    const std::string_view whole = trimmed(text);
    const auto refuse = [&] {
      fail("has the resolution " + quoted(whole) + ", which is not of a form such as '-Y HEIGHT +X WIDTH'");
    };
    for (int i = 0; i < 2; ++i) {
      const std::string_view axis = take_word(text);
      const auto side = number_of<std::uint32_t>(take_word(text));
      if (axis.size() != 2 || (axis[0] != '+' && axis[0] != '-') || !side) refuse();
      const bool plus = axis[0] == '+';
      if (axis[1] == 'Y' && !has_height_) {
        header_.height = *side;
        header_.upwards = plus;
        has_height_ = true;
      } else if (axis[1] == 'X' && !has_width_) {
        header_.width = *side;
        header_.leftwards = !plus;
        header_.in_columns = i == 0;
        has_width_ = true;
      } else {
        refuse();
      }
    }
    if (!trimmed(text).empty()) refuse();
  }

  std::span<const std::uint8_t> bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
  RadianceHeader header_;
  bool has_width_ = false;
  bool has_height_ = false;
};

}  // namespace

RadianceHeader read_radiance_header(std::span<const std::uint8_t> bytes, const std::string& name) {
  return HeaderReader(bytes, name).read();
}

}  // namespace cumulet::light
