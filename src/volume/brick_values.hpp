#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

namespace cumulet::volume {

inline constexpr int brick_size = 8;
inline constexpr int brick_voxels = brick_size * brick_size * brick_size;

/// The order of ScalarVolume::brick_origins: by x, then y, then z.
inline bool lexicographic(const glm::ivec3& a, const glm::ivec3& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

/// Returns the half float (IEEE 754 binary16) that is exactly equal to the value, or nullopt if there is none. value:
/// finite and not negative.
constexpr std::optional<std::uint16_t> exact_half(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  if (bits == 0) return std::uint16_t{0};
  const std::uint32_t exponent = bits >> 23U;  // biased by 127; halves have -14 to 15, and fewer bits down to -24
  if (exponent < 103 || exponent > 142) return std::nullopt;
  const std::uint32_t dropped = exponent < 113 ? 126 - exponent : 13;  // mantissa bits
  const std::uint32_t mantissa = (bits & 0x7fffffU) | 0x800000U;
  if ((mantissa & ((1U << dropped) - 1U)) != 0) return std::nullopt;
  const std::uint32_t kept = mantissa >> dropped;
  return static_cast<std::uint16_t>(exponent < 113 ? kept : kept + ((exponent - 113) << 10U));
}

/// Converts a half from exact_half() to float. Denormal halves use integer arithmetic, because a host may have set its
/// threads to flush denormal floats to 0.
constexpr float value_of(std::uint16_t half) {
  constexpr std::uint32_t rebias = 112U << 23U;
  const std::uint32_t bits = std::uint32_t{half} << 13U;
  if (half < 0x400U) return std::bit_cast<float>(bits + rebias + (1U << 23U)) - std::bit_cast<float>(113U << 23U);
  return std::bit_cast<float>(bits + rebias);
}

/// The values of bricks, 512 each: as halves if all are exactly representable, else as floats. Data of files with
/// halves thus takes half of the memory.
class BrickValues {
 public:
  using Brick = std::array<float, brick_voxels>;

  BrickValues() = default;
  BrickValues(std::vector<float> floats) : values_(std::move(floats)) {}
  BrickValues(std::vector<std::uint16_t> halves) : values_(std::move(halves)) {}

  /// Number of values.
  [[nodiscard]] std::size_t size() const {
    return std::visit([](const auto& values) { return values.size(); }, values_);
  }
  [[nodiscard]] bool are_halves() const { return std::holds_alternative<std::vector<std::uint16_t>>(values_); }
  [[nodiscard]] std::size_t bytes() const { return size() * (are_halves() ? 2 : 4); }

  [[nodiscard]] float operator[](std::size_t i) const {
    const auto* halves = std::get_if<std::vector<std::uint16_t>>(&values_);
    return halves != nullptr ? value_of((*halves)[i]) : std::get<std::vector<float>>(values_)[i];
  }
  /// Returns the 512 values of a brick, either the stored array or `room`.
  [[nodiscard]] const float* brick(std::size_t i, Brick& room) const {
    if (const auto* floats = std::get_if<std::vector<float>>(&values_)) return floats->data() + i * brick_voxels;
    const std::uint16_t* halves = std::get<std::vector<std::uint16_t>>(values_).data() + i * brick_voxels;
    for (std::size_t v = 0; v < brick_voxels; ++v) room[v] = value_of(halves[v]);
    return room.data();
  }
  /// Returns all values for modification; they are floats afterwards.
  std::vector<float>& as_floats() {
    if (are_halves()) {
      std::vector<float> floats(size());
      for (std::size_t i = 0; i < floats.size(); ++i) floats[i] = (*this)[i];
      values_ = std::move(floats);
    }
    return std::get<std::vector<float>>(values_);
  }
  /// Compares values, regardless of their storage.
  bool operator==(const BrickValues& other) const {
    if (size() != other.size()) return false;
    for (std::size_t i = 0; i < size(); ++i) {
      if ((*this)[i] != other[i]) return false;
    }
    return true;
  }

 private:
  std::variant<std::vector<float>, std::vector<std::uint16_t>> values_;
};

}  // namespace cumulet::volume
