#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "path/path_blocks.glsl"

namespace cumulet::render {

/// A range of rows; `end` is excluded.
struct RowRange {
  std::uint32_t first = 0;
  std::uint32_t end = 0;
  bool operator==(const RowRange&) const = default;
};

/// The revision at which rows of a picture changed last, per band of rows from the top.
class RowRevisions {
 public:
  static constexpr std::uint32_t band_rows = CM_BAND_ROWS;

  /// Marks all rows as changed at this revision. rows: of the picture.
  void change_all(std::uint32_t rows, std::uint64_t revision) {
    rows_ = rows;
    bands_.assign((rows + band_rows - 1) / band_rows, revision);
  }
  /// Registers a dispatch whose changes are not known yet.
  void expect() { ++under_way_; }
  /// Registers the result of a dispatch at its revision. first_row: of its tile; low, high: one bit per band of the
  /// tile that changed.
  void change(std::uint32_t first_row, std::uint32_t low, std::uint32_t high, std::uint64_t revision) {
    --under_way_;
    const std::uint64_t bits = std::uint64_t{high} << 32U | low;
    for (std::uint32_t i = 0; i < CM_BANDS; ++i) {
      if ((bits >> i & 1U) == 0) continue;
      // A tile may begin within a band.
      const std::uint32_t row = first_row + i * band_rows;
      for (const std::uint32_t band : {row / band_rows, (row + band_rows - 1) / band_rows}) {
        if (band < bands_.size()) bands_[band] = std::max(bands_[band], revision);
      }
    }
  }
  /// True if the changes of all dispatches are known.
  [[nodiscard]] bool known() const { return under_way_ == 0; }
  /// Returns the rows that changed after a revision, each range widened by `beside` rows.
  [[nodiscard]] std::vector<RowRange> since(std::uint64_t revision, std::uint32_t beside = 0) const {
    std::vector<RowRange> ranges;
    for (std::uint32_t i = 0; i < bands_.size(); ++i) {
      if (bands_[i] <= revision) continue;
      const std::uint32_t first = i * band_rows;
      const RowRange range{first - std::min(first, beside), std::min(rows_, first + band_rows + beside)};
      if (!ranges.empty() && range.first <= ranges.back().end) {
        ranges.back().end = range.end;
      } else {
        ranges.push_back(range);
      }
    }
    return ranges;
  }

 private:
  std::uint32_t rows_ = 0;
  std::vector<std::uint64_t> bands_;
  std::uint32_t under_way_ = 0;
};

}  // namespace cumulet::render
