#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "grid/cell.hpp"
#include "grid/rgb_field.hpp"
#include "grid/statistics.hpp"
#include "grid/tet_grid.hpp"

namespace cumulet::grid {

/// What cells carry beside density: for each of them they have a record of its own.
enum class Channel {
  emission = CM_CHANNEL_EMISSION,
  colour = CM_CHANNEL_COLOUR,
  anisotropy = CM_CHANNEL_ANISOTROPY,
  velocity = CM_CHANNEL_VELOCITY
};

/// Numbers that a channel's records are sums of, voxel by voxel: of emission red, green and blue; of the others a
/// vector, whose mean a record has, times its weight, and the weight. That of colour and velocity is density, that of
/// anisotropy what scatters; colour's vector is the colour, anisotropy's the cosine, velocity's along the cube's axes
/// in parts of the fastest.
inline constexpr std::size_t most_channel_numbers = 4;
using ChannelNumbers = std::array<float, most_channel_numbers>;

/// A channel's fields over the cube.
class ChannelFields {
 public:
  /// The fields have to outlive it. channels: has this one.
  ChannelFields(Channel channel, const Statistics& density, const Channels& channels);

  [[nodiscard]] Channel channel() const { return channel_; }
  /// How many a voxel has.
  [[nodiscard]] std::size_t count() const;
  /// Words of a cell's record.
  [[nodiscard]] std::size_t record_words() const;
  /// Statistics that these are of.
  [[nodiscard]] std::span<const Statistics* const> statistics() const { return {fields_.data(), used_}; }
  /// Those of each voxel of a cube of the octree, if they are the same.
  [[nodiscard]] std::optional<ChannelNumbers> even(const glm::ivec3& corner, int log2_size) const;
  /// Of a brick: count() a voxel, volume::brick_voxels times as many.
  void fill(const glm::ivec3& corner, std::span<float> out) const;
  /// Of a cell above bricks, record_words() words.
  void put_record(const glm::vec3& v0, std::uint32_t shape, CellKind cells, std::span<std::uint32_t> record) const;
  /// Whether a cell above bricks gives off light.
  [[nodiscard]] bool emits(const glm::vec3& v0, std::uint32_t shape) const;

 private:
  static constexpr std::size_t most_fields = 4;
  // What the fields have at a voxel.
  [[nodiscard]] ChannelNumbers numbers(const std::array<float, most_fields>& values) const;
  [[nodiscard]] std::array<Moments, 3> emission(const glm::vec3& v0, std::uint32_t shape) const;

  Channel channel_;
  std::array<const Statistics*, most_fields> fields_{};
  std::size_t used_ = 0;
  bool coloured_ = false;  // what scatters is
  float fastest_ = 0.0F;
};
/// Of each channel that there is.
std::vector<ChannelFields> fields_of(const Statistics& density, const Channels& channels);

}  // namespace cumulet::grid
