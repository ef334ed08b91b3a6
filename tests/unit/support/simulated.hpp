#pragma once

// Simulation frames as a host passes them: a lumpy ball that moves.

#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "support/c_host.hpp"

namespace cumulet::test {

using Sides = std::array<int, 3>;

/// Values with x fastest. The position of the ball depends on `step`. Channels that allow negative values have both
/// signs.
inline std::vector<float> simulated(cumulet_channel channel, const Sides& size, int step) {
  std::vector<float> values;
  values.reserve(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                 static_cast<std::size_t>(size[2]));
  const float turn = 0.6F * static_cast<float>(step);
  const auto k = static_cast<float>(channel);
  for (int z = 0; z < size[2]; ++z) {
    for (int y = 0; y < size[1]; ++y) {
      for (int x = 0; x < size[0]; ++x) {
        const std::array<float, 3> p{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
        float square = 0.0F;
        for (std::size_t a = 0; a < 3; ++a) {
          const auto side = static_cast<float>(size[a]);
          const float middle = side * (0.5F + 0.15F * std::sin(turn + static_cast<float>(a)));
          square += (p[a] - middle) * (p[a] - middle) / (side * side);
        }
        const float inside = 1.0F - 9.0F * square;
        const float lumps = 1.0F + 0.4F * std::sin(p[0] + k) * std::sin(1.3F * p[1]) * std::sin(0.7F * p[2] + turn);
        float value = inside > 0.0F ? 0.5F * lumps * inside : 0.0F;
        if (channel >= CUMULET_CHANNEL_ANISOTROPY) value *= std::sin(0.3F * p[0] + turn);
        if (channel == CUMULET_CHANNEL_TEMPERATURE) value *= 3.0F;
        values.push_back(value);
      }
    }
  }
  return values;
}

/// index_to_world of a volume centered on the origin, 16 units high.
inline std::array<double, 16> simulated_transform(const Sides& size) {
  const double voxel = 16.0 / size[1];
  std::array<double, 16> m{};
  for (std::size_t a = 0; a < 3; ++a) {
    m[5 * a] = voxel;
    m[12 + a] = -0.5 * voxel * (size[a] - 1);
  }
  m[15] = 1.0;
  return m;
}

/// Owns the fields of a state description and the data that they refer to.
class State {
 public:
  State& dense(cumulet_channel channel, const Sides& size, std::vector<float> values) {
    auto desc = make_desc<cumulet_dense_desc>();
    desc.values = values_.emplace_back(std::move(values)).data();
    desc.value_count = values_.back().size();
    std::copy(size.begin(), size.end(), desc.size);
    const auto transform = simulated_transform(size);
    std::copy(transform.begin(), transform.end(), desc.index_to_world);
    auto field = make_desc<cumulet_field>();
    field.channel = channel;
    field.dense = &denses_.emplace_back(desc);
    fields_.push_back(field);
    return *this;
  }
  State& dense(cumulet_channel channel, const Sides& size, int step) {
    return dense(channel, size, simulated(channel, size, step));
  }
  /// Adds the bricks of a dense array at these origins, in this order. Default: all bricks that have a nonzero value.
  State& sparse(cumulet_channel channel, const Sides& size, const std::vector<float>& values,
                const std::vector<Sides>& origins) {
    std::vector<std::int32_t>& o = origins_.emplace_back();
    std::vector<float>& v = values_.emplace_back();
    std::vector<std::uint64_t>& active = active_.emplace_back();
    for (const Sides& origin : origins) {
      o.insert(o.end(), origin.begin(), origin.end());
      for (int x = 0; x < 8; ++x) {
        std::uint64_t word = 0;
        for (int yz = 0; yz < 64; ++yz) {
          const Sides p{origin[0] + x, origin[1] + yz / 8, origin[2] + yz % 8};
          const bool inside = p[0] < size[0] && p[1] < size[1] && p[2] < size[2];
          const float value = inside ? values[at(p, size)] : 0.0F;
          v.push_back(value);
          if (value != 0.0F) word |= std::uint64_t{1} << yz;
        }
        active.push_back(word);
      }
    }
    auto desc = make_desc<cumulet_sparse_desc>();
    desc.brick_origins = o.data();
    desc.brick_values = v.data();
    desc.brick_active = active.data();
    desc.brick_count = origins.size();
    const auto transform = simulated_transform(size);
    std::copy(transform.begin(), transform.end(), desc.index_to_world);
    auto field = make_desc<cumulet_field>();
    field.channel = channel;
    field.sparse = &sparses_.emplace_back(desc);
    fields_.push_back(field);
    return *this;
  }
  [[nodiscard]] cumulet_volume_fields_desc desc(const char* name = "smoke") const {
    auto desc = make_desc<cumulet_volume_fields_desc>();
    desc.fields = fields_.data();
    desc.field_count = fields_.size();
    desc.name = name;
    return desc;
  }
  std::vector<cumulet_field>& fields() { return fields_; }
  cumulet_dense_desc& last_dense() { return denses_.back(); }
  cumulet_sparse_desc& last_sparse() { return sparses_.back(); }

  static std::size_t at(const Sides& p, const Sides& size) {
    return (static_cast<std::size_t>(p[2]) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(p[1])) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(p[0]);
  }
  /// Origins of the bricks in which a and b differ. If b is empty, of the bricks of a that are not all 0.
  static std::vector<Sides> bricks(const Sides& size, const std::vector<float>& a, const std::vector<float>& b = {}) {
    std::vector<Sides> found;
    for (int x = 0; x < size[0]; x += 8) {
      for (int y = 0; y < size[1]; y += 8) {
        for (int z = 0; z < size[2]; z += 8) {
          bool differs = false;
          for (int i = 0; i < 512; ++i) {
            const Sides p{x + i / 64, y + i / 8 % 8, z + i % 8};
            if (p[0] >= size[0] || p[1] >= size[1] || p[2] >= size[2]) continue;
            differs = differs || a[at(p, size)] != (b.empty() ? 0.0F : b[at(p, size)]);
          }
          if (differs) found.push_back({x, y, z});
        }
      }
    }
    return found;
  }

 private:
  std::deque<std::vector<float>> values_;
  std::deque<std::vector<std::int32_t>> origins_;
  std::deque<std::vector<std::uint64_t>> active_;
  std::deque<cumulet_dense_desc> denses_;
  std::deque<cumulet_sparse_desc> sparses_;
  std::vector<cumulet_field> fields_;
};

inline LiveRef make_live(const cumulet_dynamic_volume_desc& desc = make_desc<cumulet_dynamic_volume_desc>()) {
  return made_by<LiveRef>(cumulet_dynamic_volume_create, desc);
}

}  // namespace cumulet::test
