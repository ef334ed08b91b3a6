#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "frame_pattern.hpp"
#include "frames.hpp"

namespace cumulet::demo {

/// Returns the step of a sequence: the greatest common divisor of the distances between files; 1 for a single file.
/// there: not empty, ascending.
[[nodiscard]] Frame step_of(const std::vector<Frame>& there);

/// Sorts files by size, largest first. Missing files come last, in their given order.
[[nodiscard]] std::vector<std::string> by_size(const std::vector<std::string>& files);

/// A sequence of numbered files: one frame per file, from the first existing file to the last, with a constant step. A
/// missing file is a gap that takes the time of a frame.
class FrameRow {
 public:
  /// Returns the sequence of a file name pattern. Returns nullopt for a name without placeholder, or if a file with
  /// exactly this name exists. Throws UsageError as FramePattern::parse, and std::runtime_error, one line, if no file
  /// matches.
  [[nodiscard]] static std::optional<FrameRow> of_name(const std::string& name);
  /// Returns the sequence that this file belongs to; nullopt if there is no other file.
  [[nodiscard]] static std::optional<FrameRow> around(const std::string& file);

  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] Frame number(std::uint32_t index) const { return first_ + static_cast<Frame>(index) * step_; }
  /// Returns the index of the nearest frame.
  [[nodiscard]] std::uint32_t index_of(Frame number) const;
  /// Returns the possibly fractional index of a frame number: with files 40, 42, 44, number 42 is at 1 and number 41 at
  /// 0.5.
  [[nodiscard]] double position_of(const Moment& moment) const;
  [[nodiscard]] std::string file(std::uint32_t index) const { return pattern_.file(number(index)); }
  [[nodiscard]] std::vector<std::string> files() const;
  [[nodiscard]] const FramePattern& pattern() const { return pattern_; }

 private:
  /// there: not empty, ascending.
  FrameRow(FramePattern pattern, const std::vector<Frame>& there);

  FramePattern pattern_;
  Frame first_;
  Frame step_;
  std::uint32_t count_ = 1;
};

}  // namespace cumulet::demo
