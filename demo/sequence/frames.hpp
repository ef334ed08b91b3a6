#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace cumulet::demo {

/// Frame number. It may be negative.
using Frame = std::int32_t;

/// Limits of frame numbers.
inline constexpr Frame last_frame = 9'999'999;
inline constexpr Frame first_frame = -last_frame;

/// A possibly fractional frame number: the frame and the thousandths of the way to the next one. -1.5 is halfway from
/// frame -2 to frame -1.
struct Moment {
  Frame frame = 0;
  std::uint32_t thousandths = 0;  // below 1000

  constexpr Moment() = default;
  constexpr Moment(Frame whole, std::uint32_t part = 0) : frame(whole), thousandths(part) {}
  bool operator==(const Moment&) const = default;
  bool operator<(const Moment& other) const {
    return frame != other.frame ? frame < other.frame : thousandths < other.thousandths;
  }
  [[nodiscard]] static Moment of_thousandths(std::int64_t thousandths);
  [[nodiscard]] std::int64_t in_thousandths() const { return std::int64_t{1000} * frame + thousandths; }
  [[nodiscard]] bool is_between() const { return thousandths != 0; }
  [[nodiscard]] bool is_negative() const { return frame < 0; }
  /// Returns the digits before the decimal point, without sign: "1" for -1.5.
  [[nodiscard]] std::string whole_text() const;
  /// Returns the number as text: "5", "5.25", "-1.5".
  [[nodiscard]] std::string text() const;
  /// Returns the decimals, ".25", or "" for a whole number. decimals: minimum number of decimals, 3 gives ".250".
  [[nodiscard]] std::string part_text(std::size_t decimals = 0) const;
  /// Returns the number of decimals, 0 to 3.
  [[nodiscard]] std::size_t decimals() const;
};

/// Parses a list of frames and ranges, separated by commas: "5", "1-100", "1-100x2" (1, 3, 5, ... up to 100),
/// "1-2x0.25" (1, 1.25, ... 2; maximum three decimals), "-2-2" (from -2 to 2), "-4--2" (from -4 to -2). The order is
/// kept; repeated frames are dropped. Throws UsageError, which quotes the invalid part.
[[nodiscard]] std::vector<Moment> parse_frames(std::string_view text);

/// Formats a list of frames in any order as ranges: "1-3, 7, 10-20, 20.5".
[[nodiscard]] std::string frames_text(const std::vector<Moment>& moments);

}  // namespace cumulet::demo
