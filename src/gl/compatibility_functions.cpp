#include "gl/compatibility_functions.hpp"

#include <string>

#include "base/error.hpp"
#include "gl/extensions.hpp"

namespace cumulet::gl {

namespace {

template <class Function>
void load(Function& function, GetProc get_proc, void* user, const char* name) {
  function = proc_address<Function>(get_proc, user, name);
  if (function != nullptr) return;
  throw Error(ErrorCode::unsupported,
              std::string("the context has the compatibility profile, but get_proc does not return ") + name +
                  ", which is needed to reset state that affects the image");
}

}  // namespace

void* (*find_current_context(GetProc get_proc, void* user))() {
  for (const char* name :
       {"eglGetCurrentContext", "OSMesaGetCurrentContext", "wglGetCurrentContext", "glXGetCurrentContext"}) {
    const auto query = proc_address<void* (*)()>(get_proc, user, name);
    if (query != nullptr && query() != nullptr) return query;
  }
  return nullptr;
}

std::shared_ptr<const CompatibilityFunctions> load_compatibility(const GladGLContext& gl, GetProc get_proc,
                                                                 void* user) {
  GLint profile = 0;
  GLint flags = 0;
  gl.GetIntegerv(GL_CONTEXT_PROFILE_MASK, &profile);
  gl.GetIntegerv(GL_CONTEXT_FLAGS, &flags);
  if ((profile & GL_CONTEXT_CORE_PROFILE_BIT) != 0 || (flags & GL_CONTEXT_FLAG_FORWARD_COMPATIBLE_BIT) != 0) return {};
  auto functions = std::make_shared<CompatibilityFunctions>();
  load(functions->PixelTransferf, get_proc, user, "glPixelTransferf");
  load(functions->TexEnvf, get_proc, user, "glTexEnvf");
  load(functions->GetTexEnvfv, get_proc, user, "glGetTexEnvfv");
  if (has_extension(gl, "GL_ARB_imaging")) {
    load(functions->MatrixMode, get_proc, user, "glMatrixMode");
    load(functions->LoadMatrixf, get_proc, user, "glLoadMatrixf");
  }
  functions->current_context = find_current_context(get_proc, user);
  return functions;
}

}  // namespace cumulet::gl
