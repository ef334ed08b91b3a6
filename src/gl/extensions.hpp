#pragma once

#include <glad/gl.h>

namespace cumulet::gl {

/// Whether the current context supports the extension.
bool has_extension(const GladGLContext& gl, const char* name);

}  // namespace cumulet::gl
