#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "jobs/built.hpp"
#include "jobs/resource_limits.hpp"

namespace cumulet::viewer {

/// Shares the GPU memory for volumes equally among grids.
class GlBudget {
 public:
  /// limits: receives the limits of builds.
  explicit GlBudget(std::shared_ptr<ResourceLimits> limits) : limits_(std::move(limits)) {}

  /// gl_bytes: GPU memory for everything. Returns true if grids may need another number of cells.
  bool set_limits(unsigned threads, std::uint64_t memory_bytes, std::uint64_t gl_bytes);
  [[nodiscard]] const ResourceLimits& limits() const { return *limits_; }
  [[nodiscard]] std::shared_ptr<const ResourceLimits> shared_limits() const { return limits_; }
  [[nodiscard]] bool is_limited() const { return max_bytes_ != ResourceLimits::no_limit; }
  /// Sets the GPU memory that a frame used for everything except volumes. Returns true if it limits grids for the first
  /// time.
  bool set_bytes_beside(std::uint64_t bytes);
  /// Sets the number of grids that share the memory. Shares are renewed if it has changed, or if the memory for volumes
  /// differs by more than an eighth, because each frame leaves a little more or less.
  void set_grids(std::size_t grids);
  /// Share of each grid when shares were last renewed.
  [[nodiscard]] std::uint64_t part() const { return part_; }
  /// True if a grid has as many cells as its share allows.
  [[nodiscard]] bool fits(const Built& built) const;
  /// True if the viewer's own grid may need another number of cells. note_cells() ends this.
  [[nodiscard]] bool cells_are_due() const { return cells_due_; }
  void note_cells() { cells_due_ = false; }

 private:
  // Sets the limit of builds from the memory that the last frame left for volumes.
  void share();
  void renew();

  std::shared_ptr<ResourceLimits> limits_;
  std::uint64_t max_bytes_ = ResourceLimits::no_limit;
  std::optional<std::uint64_t> bytes_beside_;  // in the last frame
  std::size_t grids_ = 1;
  std::uint64_t part_ = ResourceLimits::no_limit;
  bool cells_due_ = false;
};

/// True for a grid of tetrahedra.
[[nodiscard]] bool is_of_cells(const Built& built);

}  // namespace cumulet::viewer
