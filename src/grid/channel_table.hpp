#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/progress_part.hpp"
#include "grid/cell.hpp"
#include "grid/rgb_field.hpp"

namespace cumulet::grid {

/// Quantities that cells store beside density, each in a record of its own.
enum class Channel {
  emission = CM_CHANNEL_EMISSION,
  color = CM_CHANNEL_COLOR,
  anisotropy = CM_CHANNEL_ANISOTROPY,
  velocity = CM_CHANNEL_VELOCITY
};

/// Fields that cells store beside density. A null field is absent.
struct Channels {
  /// Emitted radiance per world unit of length, linear Rec. 709. It is independent of density.
  std::shared_ptr<const RgbField> emission;
  /// Density x color. The product is stored because the mean of products is not the product of means.
  std::shared_ptr<const RgbField> scattering;
  /// Scattering (luminance of density x color) x (1 + anisotropy) / 2: the part that is scattered forward.
  std::shared_ptr<const ScalarField> forward;
  /// Does not affect light transport, so no cell is split for it.
  std::shared_ptr<const MomentumField> momentum;
  /// Shutter ends whose mean is the density of this grid. Cells are split for both ends instead of for the density.
  std::shared_ptr<const DensityEnds> ends = nullptr;

  bool operator==(const Channels&) const = default;
  /// Main memory in bytes.
  [[nodiscard]] std::uint64_t bytes() const;
};

/// Emission of a cell as the shaders read it; layout: glsl/grid/channels.glsl.
struct EmissionRecord {
  glm::vec3 mean;  ///< radiance per world unit of length
  std::uint32_t gradient;
};
static_assert(sizeof(EmissionRecord) == 16);

/// The channels of a grid's cells, packed by ChannelFields::put_record(): one record per cell, or none.
struct ChannelRecords {
  std::vector<EmissionRecord> emission;  ///< empty if no cell emits light
  std::vector<std::uint32_t> color;      ///< empty if scattering is white
  std::vector<std::int16_t> anisotropy;  ///< empty if the medium's anisotropy applies
  std::vector<glm::uvec2> velocity;      ///< empty if there is no velocity

  /// Main memory in bytes.
  [[nodiscard]] std::uint64_t bytes() const;
};

/// The properties of a channel that budgets, grids, lattices and uploads need.
struct ChannelRow {
  Channel channel;
  std::size_t record_bytes;                                          ///< of one cell: 16, 8, 4 or 2
  std::size_t numbers;                                               ///< values per voxel (ChannelNumbers)
  bool (*is_in)(const Channels& fields);                             ///< whether a volume has the channel
  std::uint64_t (*bytes)(const Channels& fields);                    ///< main memory of its field
  std::span<const std::byte> (*records)(const ChannelRecords& all);  ///< empty: the grid does not have the channel
  std::span<std::byte> (*writable)(ChannelRecords& all);
  void (*resize)(ChannelRecords& all, std::size_t cells, const ProgressPart& part);
};

/// Field: member of Channels. Records: member of ChannelRecords.
template <auto Field, auto Records>
constexpr ChannelRow channel_row(Channel channel, std::size_t numbers) {
  using Vector = std::remove_cvref_t<decltype(std::declval<ChannelRecords>().*Records)>;
  return {.channel = channel,
          .record_bytes = sizeof(typename Vector::value_type),
          .numbers = numbers,
          .is_in = [](const Channels& fields) { return fields.*Field != nullptr; },
          .bytes = [](const Channels& fields) { return fields.*Field ? (fields.*Field)->bytes() : std::uint64_t{0}; },
          .records = [](const ChannelRecords& all) { return std::as_bytes(std::span(all.*Records)); },
          .writable = [](ChannelRecords& all) { return std::as_writable_bytes(std::span(all.*Records)); },
          .resize = [](ChannelRecords& all, std::size_t cells,
                       const ProgressPart& part) { part.resize(all.*Records, cells); }};
}

/// Indexed by Channel.
inline constexpr std::array channel_table{
    channel_row<&Channels::emission, &ChannelRecords::emission>(Channel::emission, 3),
    channel_row<&Channels::scattering, &ChannelRecords::color>(Channel::color, 4),
    channel_row<&Channels::forward, &ChannelRecords::anisotropy>(Channel::anisotropy, 2),
    channel_row<&Channels::momentum, &ChannelRecords::velocity>(Channel::velocity, 4)};
static_assert([] {
  for (std::size_t i = 0; i < channel_table.size(); ++i) {
    if (channel_table[i].channel != static_cast<Channel>(i)) return false;
  }
  return channel_table.size() == CM_CHANNEL_COUNT;
}());

[[nodiscard]] constexpr std::size_t index_of(Channel channel) { return static_cast<std::size_t>(channel); }
[[nodiscard]] constexpr const ChannelRow& row_of(Channel channel) { return channel_table[index_of(channel)]; }
/// Returns the size of the records of a channel.
[[nodiscard]] constexpr std::uint64_t channel_bytes(Channel channel, std::size_t cells) {
  return cells * row_of(channel).record_bytes;
}

inline std::uint64_t Channels::bytes() const {
  std::uint64_t bytes = ends ? ends->bytes() : 0;
  for (const ChannelRow& row : channel_table) bytes += row.bytes(*this);
  return bytes;
}

inline std::uint64_t ChannelRecords::bytes() const {
  std::uint64_t bytes = 0;
  for (const ChannelRow& row : channel_table) bytes += row.records(*this).size();
  return bytes;
}

}  // namespace cumulet::grid
