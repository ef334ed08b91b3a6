#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "render/film/picture.hpp"

// Checkpoints: the state of a shaded picture's samples as bytes.

namespace cumulet::render {

/// Returns the size that save_checkpoint() writes; it is larger for an adaptive picture.
[[nodiscard]] std::size_t checkpoint_bytes(const Picture& picture);
/// Writes the state of a shaded picture's samples, for restore_checkpoint(). No dispatch of the picture may be in
/// flight. Needs a current context and an active StateGuard.
void save_checkpoint(const gl::Functions& gl, const Picture& picture, std::span<std::byte> bytes);
/// Restores saved samples into a picture that was started like the saved one; it will end with the same result. A
/// picture that is done is left unchanged. If the data do not match the picture, throws Error(invalid_argument) and
/// leaves the picture unchanged. revision: of the picture with these samples. Needs a current context and an active
/// StateGuard.
void restore_checkpoint(const gl::Functions& gl, Picture& picture, std::span<const std::byte> saved,
                        std::uint64_t revision);

}  // namespace cumulet::render
