#pragma once

#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <stdexcept>

namespace cumulet::test {

/// An OpenGL 4.5 core context without a surface that may share its objects with another.
class EglContext {
 public:
  explicit EglContext(const EglContext* share = nullptr) : display_(share != nullptr ? share->display_ : open()) {
    eglBindAPI(EGL_OPENGL_API);
    const std::array<EGLint, 7> attributes{
        EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 5, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    context_ = eglCreateContext(display_, EGL_NO_CONFIG_KHR, share != nullptr ? share->context_ : EGL_NO_CONTEXT,
                                attributes.data());
    if (context_ == EGL_NO_CONTEXT) throw std::runtime_error("no OpenGL 4.5 core context by EGL");
  }
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;
  ~EglContext() {
    eglBindAPI(EGL_OPENGL_API);
    if (eglGetCurrentContext() == context_) release();
    eglDestroyContext(display_, context_);
  }

  void make_current() const {
    eglBindAPI(EGL_OPENGL_API);  // the current API is thread-local
    if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_FALSE)
      throw std::runtime_error("eglMakeCurrent failed");
  }
  void release() const { eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }

  static void* get_proc(void*, const char* name) { return reinterpret_cast<void*>(eglGetProcAddress(name)); }

 private:
  /// The first device's display that supports OpenGL. It is initialized once per context and never terminated.
  static EGLDisplay open() {
    const auto query = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    if (query == nullptr || query(16, devices.data(), &count) == EGL_FALSE) throw std::runtime_error("no EGL devices");
    for (EGLint i = 0; i < count; ++i) {
      EGLDisplay display =
          eglGetPlatformDisplay(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)], nullptr);
      if (eglInitialize(display, nullptr, nullptr) == EGL_TRUE && eglBindAPI(EGL_OPENGL_API) == EGL_TRUE)
        return display;
    }
    throw std::runtime_error("no EGL device takes OpenGL");
  }

  EGLDisplay display_;
  EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace cumulet::test
