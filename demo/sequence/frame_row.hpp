#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "frame_pattern.hpp"
#include "frames.hpp"

namespace cumulet::demo {

/// How far files are apart: what divides all the ways from the first to another; 1 of a single one. there: not empty,
/// ascending.
[[nodiscard]] Frame step_of(const std::vector<Frame>& there);

/// The largest file first; those that are not there last, in the order in which they were.
[[nodiscard]] std::vector<std::string> by_size(const std::vector<std::string>& files);

/// Numbered files as they play: a frame each, from the first that is there to the last, in equal steps. One that is not
/// there is a gap, and takes its time.
class FrameRow {
 public:
  /// Of a name with a place for a number. Nothing for a name without, and for a file that is there by just that name.
  /// Throws UsageError as FramePattern::parse, and std::runtime_error, one line, where no such file is there.
  [[nodiscard]] static std::optional<FrameRow> of_name(const std::string& name);
  /// That this file is in; nothing where it is the only one.
  [[nodiscard]] static std::optional<FrameRow> around(const std::string& file);

  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] Frame number(std::uint32_t index) const { return first_ + static_cast<Frame>(index) * step_; }
  /// The nearest.
  [[nodiscard]] std::uint32_t index_of(Frame number) const;
  /// Between its frames, too: the third of 40, 42, 44 and what follows is at 1, and 41 at 0.5.
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
