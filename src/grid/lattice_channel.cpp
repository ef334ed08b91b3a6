#include "grid/lattice_channel.hpp"

#include <algorithm>

#include "base/luminance.hpp"
#include "grid/brick_voxels.hpp"
#include "grid/evaluation.hpp"

namespace cumulet::grid {

using glm::dvec3;
using glm::ivec3;
using glm::vec3;

ChannelFields::ChannelFields(Channel channel, const Statistics& density, const Channels& channels)
    : channel_(channel), colored_(channels.scattering != nullptr) {
  const auto add = [&](const Statistics& field) { fields_[used_++] = &field; };
  const auto add_colors = [&](const auto& field) {
    for (std::size_t i = 0; i < 3; ++i) add(field.component(i));
  };
  switch (channel) {
    case Channel::emission:
      add_colors(*channels.emission);
      return;
    case Channel::color:
      add_colors(*channels.scattering);
      add(density);
      return;
    case Channel::anisotropy:
      add(channels.forward->statistics());
      if (colored_) {
        add_colors(*channels.scattering);
      } else {
        add(density);
      }
      return;
    case Channel::velocity:
      add_colors(*channels.momentum);
      add(density);
      fastest_ = channels.momentum->fastest();
      return;
  }
}

ChannelNumbers ChannelFields::numbers(const std::array<float, max_channel_fields>& values) const {
  switch (channel_) {
    case Channel::emission:
    case Channel::color:
      return values;
    case Channel::anisotropy: {
      const float scatters = colored_ ? luminance(vec3(values[1], values[2], values[3])) : values[1];
      return {2.0F * values[0] - scatters, scatters};
    }
    case Channel::velocity:
      break;
  }
  // For slow motion this difference is exact, so sums do not lose it.
  const auto relative = [&](std::size_t i) { return 2.0F * values[i] - values[3]; };
  return {relative(0), relative(1), relative(2), values[3]};
}

std::optional<ChannelNumbers> ChannelFields::even(const ivec3& corner, int log2_size) const {
  std::array<float, max_channel_fields> values{};
  for (std::size_t i = 0; i < used_; ++i) {
    const Statistics::Node& node = fields_[i]->node_at(corner, log2_size);
    if (!node.is_uniform()) return std::nullopt;
    values[i] = node.uniform;
  }
  return numbers(values);
}

void ChannelFields::fill(const ivec3& corner, std::span<float> out) const {
  std::array<BrickVoxels, max_channel_fields> found;
  for (std::size_t i = 0; i < used_; ++i) found[i].look_up(*fields_[i], corner);
  std::array<float, max_channel_fields> values{};
  for (std::size_t v = 0; v < out.size() / count(); ++v) {
    for (std::size_t i = 0; i < used_; ++i) values[i] = found[i][static_cast<int>(v)];
    const ChannelNumbers here = numbers(values);
    std::copy_n(here.begin(), count(), out.begin() + static_cast<std::ptrdiff_t>(v * count()));
  }
}

ChannelFields::CellMoments ChannelFields::moments(const vec3& v0, std::uint32_t shape) const {
  CellMoments moments{};
  for (std::size_t i = 0; i < used_; ++i) moments[i] = fields_[i]->moments(v0, shape);
  return moments;
}

bool ChannelFields::emits(const CellMoments& moments) const {
  return channel_ == Channel::emission && grid::emits({moments[0], moments[1], moments[2]});
}

void ChannelFields::put_record(const CellMoments& moments, const dvec3& centroid, std::uint32_t shape, CellKind cells,
                               std::span<std::uint32_t> record) const {
  const auto mass = [&](std::size_t i) { return moments[i].mass; };
  const auto masses = [&](std::size_t first) { return dvec3(mass(first), mass(first + 1), mass(first + 2)); };
  switch (channel_) {
    case Channel::emission: {
      const EmissionRecord made = emission_record({moments[0], moments[1], moments[2]}, shape, centroid, cells);
      record[0] = glm::floatBitsToUint(made.mean.x);
      record[1] = glm::floatBitsToUint(made.mean.y);
      record[2] = glm::floatBitsToUint(made.mean.z);
      record[3] = made.gradient;
      return;
    }
    case Channel::color:
      record[0] = pack_color(masses(0), mass(3));
      return;
    case Channel::anisotropy:
      record[0] = static_cast<std::uint16_t>(pack_anisotropy(mass(0), colored_ ? luminance(masses(1)) : mass(1)));
      return;
    case Channel::velocity: {
      const glm::uvec2 made = pack_velocity(masses(0), mass(3), fastest_);
      record[0] = made.x;
      record[1] = made.y;
      return;
    }
  }
}

std::vector<ChannelFields> fields_of(const Statistics& density, const Channels& channels) {
  std::vector<ChannelFields> all;
  for (const ChannelRow& row : channel_table) {
    if (row.is_in(channels)) all.emplace_back(row.channel, density, channels);
  }
  return all;
}

}  // namespace cumulet::grid
