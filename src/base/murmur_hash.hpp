#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace cumulet {

/// MurmurHash3_x86_32 of the bytes, seed 0 (Appleby 2011, public domain). Cryptomatte derives IDs from names with it.
[[nodiscard]] constexpr std::uint32_t murmur_hash_3(std::string_view bytes) {
  const auto word = [&](std::size_t first, std::size_t count) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < count; ++i)
      value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[first + i])) << 8 * i;
    return std::rotl(value * 0xcc9e2d51U, 15) * 0x1b873593U;
  };
  std::uint32_t hash = 0;
  const std::size_t whole = bytes.size() / 4 * 4;
  for (std::size_t i = 0; i < whole; i += 4) hash = std::rotl(hash ^ word(i, 4), 13) * 5 + 0xe6546b64U;
  hash ^= word(whole, bytes.size() - whole);
  hash ^= static_cast<std::uint32_t>(bytes.size());
  hash = (hash ^ hash >> 16) * 0x85ebca6bU;
  hash = (hash ^ hash >> 13) * 0xc2b2ae35U;
  return hash ^ hash >> 16;
}

/// Returns the Cryptomatte ID of a name (specification 1.2): its hash. If the hash, read as the bits of a float, would
/// be denormal, zero, infinite or NaN, one bit of the exponent is flipped. Never 0.
[[nodiscard]] constexpr std::uint32_t cryptomatte_id(std::string_view name) {
  constexpr std::uint32_t exponent = 0x7f800000U;
  const std::uint32_t hash = murmur_hash_3(name);
  const bool special = (hash & exponent) == 0 || (hash & exponent) == exponent;
  return special ? hash ^ 0x00800000U : hash;
}

}  // namespace cumulet
