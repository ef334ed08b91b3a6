#include "gl/api.hpp"

#include <algorithm>
#include <cstring>

#include "base/error.hpp"
#include "gl/compatibility_functions.hpp"

namespace cumulet::gl {

namespace {

struct Loader {
  GetProc get_proc;
  void* user;
};

// glad lists the extensions, which the library does not use. A lost context returns null for their names, which glad
// would read.
const GLubyte* no_string(GLenum /*name*/, GLuint /*index*/) { return reinterpret_cast<const GLubyte*>(""); }

GLADapiproc load_one(void* loader, const char* name) {
  const auto* l = static_cast<const Loader*>(loader);
  if (std::strcmp(name, "glGetStringi") == 0) return reinterpret_cast<GLADapiproc>(no_string);
  return proc_address<GLADapiproc>(l->get_proc, l->user, name);
}

// A current context returns its version unless it is lost or the thread is between glBegin and glEnd.
bool is_between_begin_and_end(const Functions& gl, GetProc get_proc, void* user) {
  if (gl.GetString == nullptr || find_current_context(get_proc, user) == nullptr) return false;
  const auto reset_status = proc_address<PFNGLGETGRAPHICSRESETSTATUSPROC>(get_proc, user, "glGetGraphicsResetStatus");
  return reset_status != nullptr && reset_status() == GL_NO_ERROR;
}

/// Throws for the first function that the library calls and the host does not return.
void check_all(const GladGLContext& gl) {
  const auto check_one = [](auto function, const char* name) {
    if (function != nullptr) return;
    throw Error(ErrorCode::unsupported,
                std::string("the context reports OpenGL 4.5, but get_proc does not return ") + name);
  };
#define CUMULET_GL_FUNCTION(NAME) check_one(gl.NAME, "gl" #NAME);
#include "gl_functions.inc"
#undef CUMULET_GL_FUNCTION
}

}  // namespace

std::shared_ptr<const Functions> load_functions(GetProc get_proc, void* user) {
  auto gl = std::make_shared<Functions>();
  Loader loader{get_proc, user};
  const int version = gladLoadGLContextUserPtr(gl.get(), load_one, &loader);
  if (version == 0) {
    if (gl->VERSION_4_5 != 0) check_all(*gl);  // glad itself calls glGetIntegerv
    if (is_between_begin_and_end(*gl, get_proc, user)) throw Error(ErrorCode::gl, between_begin_and_end_message);
    throw Error(ErrorCode::unsupported, "no OpenGL: get_proc returned no glGetString, or no context is current");
  }
  if (version < GLAD_MAKE_VERSION(4, 5)) {
    throw Error(ErrorCode::unsupported, "OpenGL 4.5 is needed; the context has " +
                                            std::to_string(GLAD_VERSION_MAJOR(version)) + "." +
                                            std::to_string(GLAD_VERSION_MINOR(version)));
  }
  gl->GetStringi = proc_address<PFNGLGETSTRINGIPROC>(get_proc, user, "glGetStringi");
  check_all(*gl);
  GLint draw_buffers = 0;
  gl->GetIntegerv(GL_MAX_DRAW_BUFFERS, &draw_buffers);
  gl->draw_buffers = static_cast<GLuint>(std::clamp(draw_buffers, 1, 16));
  gl->compatibility = load_compatibility(*gl, get_proc, user);
  gl->GetIntegerv(GL_MAX_DEBUG_GROUP_STACK_DEPTH, &gl->max_debug_groups);
  gl->GetIntegerv(GL_MAX_TEXTURE_SIZE, &gl->max_texture_size);
  return gl;
}

std::shared_ptr<const Functions> copy_of(const Functions& gl) {
  auto copy = std::make_shared<Functions>();
  static_cast<GladGLContext&>(*copy) = gl;
  copy->draw_buffers = gl.draw_buffers;
  copy->compatibility = gl.compatibility;
  copy->max_debug_groups = gl.max_debug_groups;
  copy->max_texture_size = gl.max_texture_size;
  return copy;
}

Limits query_limits(const Functions& gl) {
  Limits limits;
  GLint64 value = 0;
  gl.GetInteger64v(GL_MAX_TEXTURE_BUFFER_SIZE, &value);
  limits.texture_buffer_texels = value;
  gl.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &value);
  limits.storage_block_bytes = value;
  gl.GetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &limits.texture_size_3d);
  limits.texture_size_2d = gl.max_texture_size;
  return limits;
}

void check(const Functions& gl, const char* step) {
  const GLenum first = gl.GetError();
  if (first == GL_NO_ERROR) return;
  clear_errors(gl);
  if (first == GL_CONTEXT_LOST) throw Error(ErrorCode::context_lost, std::string("the GL context is lost: ") + step);
  check_reset(gl);
  if (first == GL_OUT_OF_MEMORY) {
    throw Error(ErrorCode::out_of_memory, std::string("the GL driver is out of memory: ") + step);
  }
  throw Error(ErrorCode::gl, "GL error " + std::to_string(first) + ": " + step);
}

bool was_reset(const Functions& gl) { return gl.GetGraphicsResetStatus() != GL_NO_ERROR; }

void check_reset(const Functions& gl) {
  if (was_reset(gl)) throw Error(ErrorCode::context_lost, reset_message);
}

void clear_errors(const Functions& gl) {
  // A lost context may report errors forever.
  for (int i = 0; i < 64 && gl.GetError() != GL_NO_ERROR; ++i) {
  }
}

std::string string_of(const Functions& gl, GLenum name) {
  const GLubyte* text = gl.GetString(name);
  return text == nullptr ? std::string() : reinterpret_cast<const char*>(text);
}

}  // namespace cumulet::gl
