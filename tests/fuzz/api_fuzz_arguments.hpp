#pragma once

// Arguments of calls of cumulet.h, made from the input of the fuzzer.

#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "cumulet/cumulet.h"
#include "finding.hpp"

namespace cumulet::fuzz {

/// Fails if an error message is not one line.
inline void check_line(const char* line) {
  if (line == nullptr || *line == '\0') fail("an error without a cause");
  if (std::strpbrk(line, "\n\r") != nullptr) fail(std::string("not one line: ") + line);
  if (std::string(line).starts_with("internal error")) fail(line);
}

struct Arguments {
  Arguments(const std::uint8_t* data, std::size_t size) : input(data, size) {}

  /// Fills each 8 bytes with numbers of all kinds. Most are harmless, otherwise all calls would be rejected at once.
  template <class Desc>
  Desc described() {
    Desc desc{};
    std::array<std::uint64_t, sizeof(Desc) / 8> words{};
    for (std::uint64_t& word : words) word = number();
    std::memcpy(static_cast<void*>(&desc), words.data(), sizeof words);
    desc.struct_size = input.ConsumeIntegralInRange(0, 15) == 0 ? input.ConsumeIntegral<std::uint16_t>() : sizeof desc;
    // Not larger than the struct and the space after it, because the library writes there.
    if (desc.struct_size > sizeof desc) desc.struct_size = sizeof desc + 8;
    return desc;
  }

  /// Sets a ramp or a color ramp of arbitrary numbers.
  cumulet_status set_ramp(cumulet_viewer* viewer) {
    std::array<float, 8> numbers{};
    for (float& one : numbers) one = input.ConsumeFloatingPoint<float>();
    const bool colors = input.ConsumeBool();
    const auto which = static_cast<cumulet_ramp>(input.ConsumeIntegralInRange(0U, 3U));
    const auto set = colors ? cumulet_set_color_ramp : cumulet_set_ramp;
    return set(viewer, which, numbers.data(), input.ConsumeIntegralInRange(0U, colors ? 2U : 4U));
  }

  /// 8 bytes: an integer, a double, two floats or two small integers, some of them unusual.
  std::uint64_t number() {
    const auto one_float = [this] {
      constexpr std::array numbers = {0.0F,
                                      1.0F,
                                      0.5F,
                                      -1.0F,
                                      1e-30F,
                                      1e30F,
                                      std::numeric_limits<float>::infinity(),
                                      std::numeric_limits<float>::quiet_NaN(),
                                      3.0F};
      return bits<std::uint32_t>(input.PickValueInArray(numbers));
    };
    switch (input.ConsumeIntegralInRange(0, 11)) {
      case 0:
        return input.ConsumeIntegral<std::uint64_t>();
      case 1:
      case 2:
        return bits<std::uint64_t>(input.PickValueInArray({1.0, -1.0, 0.5, 10.0, 45.0, 1e-300, 1e300, 1e9,
                                                           std::numeric_limits<double>::infinity(),
                                                           std::numeric_limits<double>::quiet_NaN()}));
      case 3:
      case 4:
        return one_float() | std::uint64_t{one_float()} << 32U;
      case 5:
      case 6:
        return input.ConsumeIntegralInRange<std::uint32_t>(0, 4) |
               std::uint64_t{input.ConsumeIntegralInRange<std::uint32_t>(0, 4)} << 32U;
      default:
        return 0;
    }
  }

  /// The number with the bytes of another.
  template <class To, class From>
  static To bits(From value) {
    static_assert(sizeof(To) == sizeof(From));
    To out;
    std::memcpy(&out, &value, sizeof out);
    return out;
  }

  std::vector<float> floats(std::size_t count) {
    std::vector<float> values(count);
    for (float& value : values) value = bits<float>(static_cast<std::uint32_t>(number()));
    return values;
  }

  /// Writes a matrix, usually a valid transform; sometimes leaves it unchanged.
  void put_transform(double* to_world) {
    const int kind = input.ConsumeIntegralInRange(0, 7);
    if (kind == 0) return;
    std::fill_n(to_world, 16, 0.0);
    if (kind == 1) return;
    for (int axis = 0; axis < 3; ++axis) {
      to_world[5 * axis] = input.PickValueInArray({1.0, -1.0, 0.5, 2.0});
      to_world[12 + axis] = input.ConsumeIntegralInRange(-20, 20);
    }
    to_world[1] = input.PickValueInArray({0.0, 0.5, 1.0});
    to_world[15] = 1.0;
  }

  /// values: keeps the voxels that the descriptor refers to.
  cumulet_dense_desc dense(std::vector<float>& values) {
    auto desc = described<cumulet_dense_desc>();
    const std::size_t count = input.ConsumeIntegralInRange<std::size_t>(0, 600);
    values = floats(count);
    if (input.ConsumeBool()) {
      desc.size[0] = input.ConsumeIntegralInRange(1, 9);
      desc.size[1] = input.ConsumeIntegralInRange(1, 9);
      desc.size[2] = static_cast<int>(count) / (desc.size[0] * desc.size[1]);
      values.resize(static_cast<std::size_t>(desc.size[0] * desc.size[1] * desc.size[2]));
    }
    desc.values = values.data();
    desc.value_count = values.size();
    desc.name = input.ConsumeBool() ? "dense\nthing" : nullptr;
    return desc;
  }

  /// Bricks and tiles.
  struct Sparse {
    std::vector<std::int32_t> origins;
    std::vector<float> values;
    std::vector<std::uint64_t> active;
    std::vector<cumulet_tile> tiles;
  };

  /// kept: owns the bricks and tiles that the descriptor refers to.
  cumulet_sparse_desc sparse(Sparse& kept) {
    auto desc = described<cumulet_sparse_desc>();
    const std::size_t bricks = input.ConsumeIntegralInRange<std::size_t>(0, 3);
    auto& [origins, values, active, tiles] = kept;
    for (std::size_t i = 0; i < 3 * bricks; ++i) {
      origins.push_back(input.ConsumeBool() ? 8 * input.ConsumeIntegralInRange(-4, 4)
                                            : input.ConsumeIntegral<std::int32_t>());
    }
    values.assign(512 * bricks, 0.5F);
    for (std::size_t i = 0; i < values.size(); i += 61) values[i] = bits<float>(static_cast<std::uint32_t>(number()));
    active.resize(8 * bricks);
    for (std::uint64_t& word : active) word = number();
    tiles.resize(input.ConsumeIntegralInRange<std::size_t>(0, 3));
    for (cumulet_tile& tile : tiles) {
      for (int axis = 0; axis < 3; ++axis) {
        tile.min[axis] =
            input.ConsumeBool() ? 8 * input.ConsumeIntegralInRange(-4, 4) : input.ConsumeIntegral<std::int32_t>();
        tile.max[axis] = input.ConsumeBool() ? tile.min[axis] / 2 + input.ConsumeIntegralInRange(0, 64)
                                             : input.ConsumeIntegral<std::int32_t>();
      }
      tile.value = bits<float>(static_cast<std::uint32_t>(number()));
      tile.active = input.ConsumeIntegralInRange(0, 2);
    }
    desc.brick_origins = origins.data();
    desc.brick_values = values.data();
    desc.brick_active = input.ConsumeBool() ? active.data() : nullptr;
    desc.brick_count = bricks;
    desc.tiles = tiles.data();
    desc.tile_count = tiles.size();
    desc.name = nullptr;
    return desc;
  }

  /// A state of some fields, kept until it is no longer needed.
  struct State {
    std::array<std::vector<float>, 3> dense_values;
    std::array<Sparse, 3> sparse_values;
    std::array<cumulet_dense_desc, 3> dense{};
    std::array<cumulet_sparse_desc, 3> sparse{};
    std::array<cumulet_field, 3> fields{};
    cumulet_volume_fields_desc desc{};
  };

  std::unique_ptr<State> make_state() {
    auto state = std::make_unique<State>();
    state->desc = described<cumulet_volume_fields_desc>();
    const std::size_t count = input.ConsumeIntegralInRange<std::size_t>(0, 3);
    for (std::size_t i = 0; i < count; ++i) {
      cumulet_field& field = state->fields[i];
      field.struct_size = sizeof field;
      field.channel = static_cast<cumulet_channel>(input.ConsumeIntegralInRange(0, 10));
      const int kind = input.ConsumeIntegralInRange(0, 7);
      // Usually one of the two.
      if (kind < 4 || kind == 7) {
        state->dense[i] = dense(state->dense_values[i]);
        field.dense = &state->dense[i];
      }
      if (kind >= 4 && kind < 7) {
        state->sparse[i] = sparse(state->sparse_values[i]);
        field.sparse = &state->sparse[i];
      }
      if (kind == 7) field.sparse = &state->sparse[i];
    }
    state->desc.fields = state->fields.data();
    state->desc.field_count = count;
    state->desc.name = input.ConsumeBool() ? "a state\nof lines" : nullptr;
    state->desc.release = nullptr;
    state->desc.release_user = nullptr;
    return state;
  }

  /// A frame of few pixels.
  cumulet_frame_desc small_frame() {
    auto frame = described<cumulet_frame_desc>();
    frame.budget_ms = input.PickValueInArray({-1.0, 0.0, 2.0});
    frame.width = input.ConsumeIntegralInRange<std::uint32_t>(0, 33);
    frame.height = input.ConsumeIntegralInRange<std::uint32_t>(0, 33);
    if (input.ConsumeBool()) std::memset(frame.viewport, 0, sizeof frame.viewport);
    return frame;
  }

  FuzzedDataProvider input;
};

}  // namespace cumulet::fuzz
