#include "gl/extensions.hpp"

#include <cstring>

namespace cumulet::gl {

bool has_extension(const GladGLContext& gl, const char* name) {
  GLint count = 0;
  gl.GetIntegerv(GL_NUM_EXTENSIONS, &count);
  for (GLint i = 0; i < count; ++i) {
    const GLubyte* text = gl.GetStringi(GL_EXTENSIONS, static_cast<GLuint>(i));
    if (text != nullptr && std::strcmp(reinterpret_cast<const char*>(text), name) == 0) return true;
  }
  return false;
}

}  // namespace cumulet::gl
