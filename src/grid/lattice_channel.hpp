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
  /// Writes the record of a cell above bricks: record_words() words.
  void put_record(const glm::vec3& v0, std::uint32_t shape, CellKind cells, std::span<std::uint32_t> record) const;
  /// Returns true if a cell above bricks emits light.
  [[nodiscard]] bool emits(const glm::vec3& v0, std::uint32_t shape) const;

 private:
  static constexpr std::size_t max_fields = 4;
  // Converts the fields' values at a voxel to the channel's values.
  [[nodiscard]] ChannelNumbers numbers(const std::array<float, max_fields>& values) const;
  [[nodiscard]] std::array<Moments, 3> emission(const glm::vec3& v0, std::uint32_t shape) const;

  Channel channel_;
  std::array<const Statistics*, max_fields> fields_{};
  std::size_t used_ = 0;
  bool colored_ = false;  // the scattering has a color
  float fastest_ = 0.0F;
};
/// Returns the fields of each channel that is present.
std::vector<ChannelFields> fields_of(const Statistics& density, const Channels& channels);

}  // namespace cumulet::grid
