#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "options.hpp"

namespace cumulet::demo {

/// What a picture takes at its most, in bytes; volumes, grids and surfaces come on top.
struct PictureMemory {
  std::uint64_t gl = 0;    ///< accumulated on the GPU, or in main memory where the driver is software
  std::uint64_t main = 0;  ///< read back, and encoded
};
[[nodiscard]] PictureMemory picture_memory(const RenderOptions& options);

/// Main memory that can be had now; nothing if the system does not say.
[[nodiscard]] std::optional<std::uint64_t> available_memory();

/// What a picture of that size needs, in words.
[[nodiscard]] std::string needs_text(const RenderOptions& options);

/// Throws std::runtime_error, one line that says what the picture needs, if it is more than there is. renderer:
/// OpenGL's.
void check_memory(const RenderOptions& options, std::string_view renderer, std::optional<std::uint64_t> available);

}  // namespace cumulet::demo
