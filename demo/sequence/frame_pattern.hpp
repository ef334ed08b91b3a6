#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "frames.hpp"

namespace cumulet::demo {

/// A file name with a placeholder for the frame number.
class FramePattern {
 public:
  /// Parses a file name. The placeholder is one of
  ///   ####     at least one digit per #, padded with zeros
  ///   %04d     at least 4 digits, padded with zeros; %d: not padded
  ///   $F4      at least 4 digits, padded with zeros; $F: not padded
  ///   <frame04>  at least 4 digits, padded with zeros; <frame>: not padded
  /// Returns nullopt for a name without placeholder. Folder names are not searched. Throws UsageError for two
  /// placeholders and for more than 9 digits.
  [[nodiscard]] static std::optional<FramePattern> parse(const std::string& path);

  /// Returns the pattern that a file, existing or not, belongs to; nullopt for a name without number. The frame number
  /// is the number in which most files of the folder differ, else the last one before the extension. The number is
  /// padded if it, or one with as many digits in the folder, begins with a zero. A minus before it is its sign, unless
  /// a letter or digit precedes the minus: then it is a separator, as in smoke-002.vdb.
  [[nodiscard]] static std::optional<FramePattern> of_file(const std::string& path);

  /// Selects the padding of negative numbers that most files in the folder use. Programs use two ways.
  void adopt_padding();

  [[nodiscard]] std::string file(Frame frame) const;
  /// Returns the file name of a frame. Decimals follow the number: out.0001.5.exr. decimals: minimum number of
  /// decimals.
  [[nodiscard]] std::string file(const Moment& moment, std::size_t decimals = 0) const;

  /// Returns the numbers of the existing files in ascending order; empty if the folder cannot be read.
  [[nodiscard]] std::vector<Frame> frames_there() const;
  /// Returns a warning that lists files with a number in this position but with other padding, which are not part of
  /// the sequence; "" if there are none.
  [[nodiscard]] std::string passed_over() const;

  /// Returns the pattern for messages, in the form "fire.####.vdb".
  [[nodiscard]] std::string text() const;

 private:
  /// Padding of negative numbers, here -2 with four digits.
  enum class Padding {
    sign_counts,  // -002: C's printf, Houdini, ffmpeg
    digits_only   // -0002: Blender
  };

  FramePattern(std::string head, std::string tail, std::size_t digits, Padding padding = Padding::sign_counts)
      : head_(std::move(head)), tail_(std::move(tail)), digits_(digits), padding_(padding) {}
  // Return the pattern for the digits that end at this position of a path.
  [[nodiscard]] static std::optional<FramePattern> of_digits(const std::string& path, std::size_t end);
  [[nodiscard]] static FramePattern of_negative(const std::string& path, std::size_t sign, std::size_t end);
  // Returns the files in the folder whose names have this prefix and suffix.
  [[nodiscard]] std::vector<std::string> files_alike() const;
  // Returns the number in a path; nullopt if the path does not match or contains no number.
  [[nodiscard]] std::optional<std::string_view> number_in(std::string_view path) const;
  // Returns the frame number of a path of this sequence; nullopt for other paths.
  [[nodiscard]] std::optional<Frame> frame_of(std::string_view path) const;

  std::string head_;  // includes the folder
  std::string tail_;
  std::size_t digits_;  // minimum number of digits
  Padding padding_;
};

}  // namespace cumulet::demo
