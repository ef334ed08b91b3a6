#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "frames.hpp"

namespace cumulet::demo {

/// A file's name with a place for a frame's number.
class FramePattern {
 public:
  /// The name's place is written as
  ///   ####     as many digits at least, filled up with zeros; so are
  ///   %04d     (%d: as they come)
  ///   $F4      ($F likewise)
  ///   <frame04>  (<frame> likewise).
  /// Nothing for a name without. It is looked for in the file's own name: a folder's may hold anything. Throws
  /// UsageError for two of them, and for more than 9 digits.
  [[nodiscard]] static std::optional<FramePattern> parse(const std::string& path);

  /// That of which this file, which need not be there, is one: the number is the last digits before the name's ending,
  /// or the digits in whose place most files differ. It has zeros in front where this file's has, or one of as many
  /// digits that is beside it. A minus before it is its sign, unless a letter or a digit comes before the minus: then
  /// it separates words, as in smoke-002.vdb. Nothing for a name without.
  [[nodiscard]] static std::optional<FramePattern> of_file(const std::string& path);

  /// Programs pad negative numbers in two ways. Takes on the one that most of the folder's files have.
  void adopt_padding();

  [[nodiscard]] std::string file(Frame frame) const;
  /// The decimals, of what is between two frames or so many at least, stand behind the number: out.0001.5.exr.
  [[nodiscard]] std::string file(const Moment& moment, std::size_t decimals = 0) const;

  /// The frames that the folder has files of, ascending; none where the folder cannot be read.
  [[nodiscard]] std::vector<Frame> frames_there() const;
  /// A line that names files which have a number in this place, but padded otherwise, and so are no frames; empty where
  /// there are none.
  [[nodiscard]] std::string passed_over() const;

  /// "fire.####.vdb", whatever it was written as: for messages.
  [[nodiscard]] std::string text() const;

 private:
  /// Of -2 in four digits.
  enum class Padding {
    sign_counts,  // -002: C's printf, Houdini, ffmpeg
    digits_only   // -0002: Blender
  };

  FramePattern(std::string head, std::string tail, std::size_t digits, Padding padding = Padding::sign_counts)
      : head_(std::move(head)), tail_(std::move(tail)), digits_(digits), padding_(padding) {}
  // Those that the digits before this place of a path may belong to.
  [[nodiscard]] static std::optional<FramePattern> of_digits(const std::string& path, std::size_t end);
  [[nodiscard]] static FramePattern of_negative(const std::string& path, std::size_t sign, std::size_t end);
  // The folder's files whose names begin and end so.
  [[nodiscard]] std::vector<std::string> files_alike() const;
  // What stands in the number's place of a whole path; nothing where that is no number.
  [[nodiscard]] std::optional<std::string_view> number_in(std::string_view path) const;
  // Of the whole path of a file that is this one's: its frame.
  [[nodiscard]] std::optional<Frame> frame_of(std::string_view path) const;

  std::string head_;  // the folder with it
  std::string tail_;
  std::size_t digits_;  // at least
  Padding padding_;
};

}  // namespace cumulet::demo
