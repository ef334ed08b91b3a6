#pragma once

#include <glad/gl.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

namespace cumulet::gl {

/// The GL function table of one context, loaded through the host's callback. Nothing is linked.
struct Functions : GladGLContext {
  /// The context is gone: objects are forgotten, not deleted.
  mutable std::atomic<bool> abandoned = false;
};

/// What the library needs of the context's limits.
struct Limits {
  std::int64_t texture_buffer_texels = 0;
  std::int64_t storage_block_bytes = 0;
  int texture_size_3d = 0;
  int texture_size_2d = 0;
};

/// Loads the table and checks version 4.5 and compute. Throws Error(unsupported) that says what is missing.
std::shared_ptr<const Functions> load_functions(void* (*get_proc)(void* user, const char* name), void* user);
Limits query_limits(const Functions& gl);

/// Takes all pending GL errors; throws Error(out_of_memory, context_lost or gl) that names the step.
void check(const Functions& gl, const char* step);
/// Whether the driver says that it reset the context.
bool was_reset(const Functions& gl);
inline constexpr const char* reset_message = "the driver reset the GL context";
/// Throws Error(context_lost) if the driver says that it reset the context.
void check_reset(const Functions& gl);
/// Drops errors that were pending before we came.
void clear_errors(const Functions& gl);

/// The GL name of a context string, "" if the driver gives none.
std::string string_of(const Functions& gl, GLenum name);

}  // namespace cumulet::gl
