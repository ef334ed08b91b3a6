#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace cumulet::demo {

/// A frame's number. Sequences may begin before 0.
using Frame = std::int32_t;

/// The largest and the smallest number.
inline constexpr Frame last_frame = 9'999'999;
inline constexpr Frame first_frame = -last_frame;

/// A frame, or what is so many thousandths of the way from it to the next: -1.5 is halfway from frame -2 to frame -1.
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
  /// Its digits before the decimal point, without a sign: "1" of -1.5.
  [[nodiscard]] std::string whole_text() const;
  /// "5", "5.25", "-1.5".
  [[nodiscard]] std::string text() const;
  /// ".25"; "" of a frame. With so many decimals at least: ".250".
  [[nodiscard]] std::string part_text(std::size_t decimals = 0) const;
  /// That it has: 0 to 3.
  [[nodiscard]] std::size_t decimals() const;
};

/// "5", "1-100", "1-100x2" (1, 3, 5, ... up to 100), "1-2x0.25" (1, 1.25, ... 2; three decimals at most), "-2-2" (from
/// -2 to 2), "-4--2" (from -4 to -2) and several of them between commas, in the order they are named in, each once.
/// Throws UsageError, which quotes what it cannot read.
[[nodiscard]] std::vector<Moment> parse_frames(std::string_view text);

/// The same in few words, of moments in any order: "1-3, 7, 10-20, 20.5".
[[nodiscard]] std::string frames_text(const std::vector<Moment>& moments);

}  // namespace cumulet::demo
