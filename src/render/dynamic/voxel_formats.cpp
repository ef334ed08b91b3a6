#include "render/dynamic/voxel_formats.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace cumulet::render {

using volume::brick_voxels;

namespace {

/// Converts a half by integer operations. Floats in between are never denormal, because a host may have set its threads
/// to flush denormals to 0.
float float_of(std::uint16_t half) {
  constexpr std::uint32_t rebias = 112U << 23U;
  constexpr auto least = std::bit_cast<float>(113U << 23U);  // smallest normal half
  const std::uint32_t bits = std::uint32_t{half} << 13U & 0x0fffe000U;
  const float small = std::bit_cast<float>(bits + rebias + (1U << 23U)) - least;
  const std::uint32_t normal = bits + rebias + (bits >= 0x7c00U << 13U ? rebias : 0U);
  const std::uint32_t magnitude = bits < 0x400U << 13U ? std::bit_cast<std::uint32_t>(small) : normal;
  return std::bit_cast<float>(magnitude | (std::uint32_t{half} & 0x8000U) << 16U);
}

template <class Number, class Convert>
void convert(const std::byte* from, std::span<float, brick_voxels> to, Convert&& number) {
  std::array<Number, brick_voxels> numbers;
  std::memcpy(numbers.data(), from, sizeof numbers);
  std::ranges::transform(numbers, to.begin(), number);
}

}  // namespace

std::size_t bytes_of(VoxelFormat format) {
  return format == VoxelFormat::floats ? 4 : format == VoxelFormat::bytes ? 1 : 2;
}
std::size_t brick_bytes(VoxelFormat format) { return brick_voxels * bytes_of(format); }

void unpack(VoxelFormat format, const std::byte* from, std::span<float, brick_voxels> to) {
  switch (format) {
    case VoxelFormat::floats:
      std::memcpy(to.data(), from, to.size_bytes());
      break;
    case VoxelFormat::halves:
      convert<std::uint16_t>(from, to, float_of);
      break;
    case VoxelFormat::shorts:
      convert<std::uint16_t>(from, to, [](std::uint16_t v) { return static_cast<float>(v) / 65535.0F; });
      break;
    case VoxelFormat::bytes:
      convert<std::uint8_t>(from, to, [](std::uint8_t v) { return static_cast<float>(v) / 255.0F; });
      break;
  }
}

}  // namespace cumulet::render
