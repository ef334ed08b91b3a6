#pragma once

// Private to surface/: buffer views of EXT_meshopt_compression.

#include <tiny_gltf.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "surface/budget.hpp"

namespace cumulet::surface::detail {

/// Decompresses one buffer view. `owner` keeps the bytes in `from` alive. Throws Error(file).
std::vector<std::uint8_t> decode_meshopt(const tinygltf::Value& extension, std::span<const std::uint8_t> from,
                                         const std::shared_ptr<const void>& owner, const std::string& what,
                                         Budget& budget);

}  // namespace cumulet::surface::detail
