#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "volume/volume.hpp"

namespace cumulet::volume {

inline constexpr std::size_t histogram_bins = 64;

/// Statistics of a grid's active voxels; for vectors, of their lengths.
struct GridValues {
  glm::dmat4 index_to_world{1.0};
  std::uint64_t active_voxels = 0;
  glm::ivec3 bounds_min{0};  ///< inclusive; both bounds are zero if there are no active voxels
  glm::ivec3 bounds_max{0};
  // For finite values; zero if there are none.
  float min = 0.0F;
  float max = 0.0F;
  double mean = 0.0;
  std::uint64_t negative_voxels = 0;
  std::uint64_t non_finite_voxels = 0;
  std::uint64_t memory_bytes = 0;  ///< maximum size of a ScalarVolume of the grid
  /// Counts of finite values in equal bins from min to max; if min equals max, all are in the first bin.
  std::array<std::uint64_t, histogram_bins> histogram{};
};

/// Returns the counts of a volume's values > 0 in equal bins from 0 to max_value. O(voxels of bricks).
std::array<std::uint64_t, histogram_bins> histogram(const ScalarVolume& volume);

struct GridStatistics {
  std::optional<GridValues> values;  ///< empty if they cannot be read
  std::string refusal;               ///< that of GridInfo, or the error in reading the voxels
};

/// The contents of a .vdb or .nvdb file. Any thread.
class Inspection {
 public:
  /// Reads the file's directory. Throws Error(file).
  explicit Inspection(const FilePath& file);

  [[nodiscard]] const std::string& format() const { return format_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] const std::vector<Metadata>& metadata() const { return metadata_; }
  [[nodiscard]] const std::vector<GridInfo>& grids() const { return grids_; }
  /// The result of channels_by_name().
  [[nodiscard]] const std::vector<std::string>& channels() const { return channels_; }
  /// The grid that import_volume reads if it is given no name.
  [[nodiscard]] std::optional<std::size_t> chosen() const { return chosen_; }
  /// Reads a grid's voxels at the first call. Throws Error(out_of_memory).
  [[nodiscard]] const GridStatistics& statistics(std::size_t grid);

 private:
  FilePath file_;
  std::uint64_t bytes_ = 0;
  std::string format_;
  std::vector<Metadata> metadata_;
  std::vector<GridInfo> grids_;
  std::vector<std::string> channels_;
  std::optional<std::size_t> chosen_;
  std::mutex mutex_;
  std::vector<std::optional<GridStatistics>> statistics_;
};

}  // namespace cumulet::volume
