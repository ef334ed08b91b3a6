#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "options.hpp"

namespace cumulet::demo {

/// Maximum memory of an image in bytes, without volumes, grids and surfaces.
struct PictureMemory {
  std::uint64_t gl = 0;    ///< accumulation buffers: in GPU memory, or in main memory with a software driver
  std::uint64_t main = 0;  ///< buffers for reading back and encoding
};
[[nodiscard]] PictureMemory picture_memory(const RenderOptions& options);

/// Returns the available main memory in bytes; nullopt if the system does not report it.
[[nodiscard]] std::optional<std::uint64_t> available_memory();

/// Returns a text that says how much memory the image needs.
[[nodiscard]] std::string needs_text(const RenderOptions& options);

/// Throws std::runtime_error, one line with the required memory, if more than `available` is needed. renderer:
/// GL_RENDERER.
void check_memory(const RenderOptions& options, std::string_view renderer, std::optional<std::uint64_t> available);

}  // namespace cumulet::demo
