#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "grid/cell.hpp"
#include "grid/channel_table.hpp"
#include "grid/rgb_field.hpp"
#include "grid/statistics.hpp"
#include "grid/tet_grid.hpp"

namespace cumulet::grid {

/// Voxel values whose sums give a channel's records. Emission has red, green and blue. The other channels have a vector
/// times a weight, followed by the weight; the record stores the weighted mean of the vector. The weight of color and
/// velocity is density, that of anisotropy is the scattering. The vector is the color, the mean cosine, or the velocity
/// along the cube's axes relative to the fastest.
inline constexpr std::size_t max_channel_numbers = 4;
using ChannelNumbers = std::array<float, max_channel_numbers>;
/// Maximum number of words of a record.
inline constexpr std::size_t max_record_words = 4;
/// Maximum number of fields from which a channel is computed.
inline constexpr std::size_t max_channel_fields = 4;

/// The fields of a channel over the control cube.
class ChannelFields {
 public:
  /// The fields must outlive this object. channels: must contain this channel.
  ChannelFields(Channel channel, const Statistics& density, const Channels& channels);

  [[nodiscard]] Channel channel() const { return channel_; }
  /// Number of values per voxel.
  [[nodiscard]] std::size_t count() const { return row_of(channel_).numbers; }
  /// Number of words in a cell's record.
  [[nodiscard]] std::size_t record_words() const { return (row_of(channel_).record_bytes + 3) / 4; }
  /// Statistics of the channel's fields.
  [[nodiscard]] std::span<const Statistics* const> statistics() const { return {fields_.data(), used_}; }
  /// Returns the values of all voxels of an octree cube if they are uniform, else nullopt.
  [[nodiscard]] std::optional<ChannelNumbers> even(const glm::ivec3& corner, int log2_size) const;
  /// Writes count() values of each of the brick's voxels (Lattice::brick_voxels()).
  void fill(const glm::ivec3& corner, std::span<float> out) const;
  /// Moments of each of statistics() over a cell.
  using CellMoments = std::array<Moments, max_channel_fields>;
  /// Returns the moments over a cell above bricks.
  [[nodiscard]] CellMoments moments(const glm::vec3& v0, std::uint32_t shape) const;
  /// Whether records need sums of voxels in double precision. BrickSums lose precision where density is thin relative
  /// to its brick, and a velocity is a quotient.
  [[nodiscard]] bool needs_precise_sums() const { return channel_ == Channel::velocity; }
  /// Writes the record of a cell: record_words() words. centroid: of the cell, in cube space. Only emission uses more
  /// than the masses of the moments.
  void put_record(const CellMoments& moments, const glm::dvec3& centroid, std::uint32_t shape, CellKind cells,
                  std::span<std::uint32_t> record) const;
  /// Returns true if a cell with these moments emits light.
  [[nodiscard]] bool emits(const CellMoments& moments) const;
  /// For velocity: maximum, in voxels per second.
  [[nodiscard]] float fastest() const { return fastest_; }

 private:
  // Converts the fields' values at a voxel to the channel's values.
  [[nodiscard]] ChannelNumbers numbers(const std::array<float, max_channel_fields>& values) const;

  Channel channel_;
  std::array<const Statistics*, max_channel_fields> fields_{};
  std::size_t used_ = 0;
  bool colored_ = false;  // the scattering has a color
  float fastest_ = 0.0F;
};
/// Returns the fields of each channel that is present.
std::vector<ChannelFields> fields_of(const Statistics& density, const Channels& channels);

}  // namespace cumulet::grid
