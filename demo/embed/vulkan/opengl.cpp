#include "opengl.hpp"

#include <EGL/eglext.h>

#include <array>
#include <cstring>

namespace vulkan_host {
namespace {

template <class Function>
void load(Function& function, const char* name) {
  function = reinterpret_cast<Function>(eglGetProcAddress(name));
}

bool has_extension(const char* name) {
  PFNGLGETSTRINGIPROC get_string = nullptr;
  load(get_string, "glGetStringi");
  GLint count = 0;
  glGetIntegerv(GL_NUM_EXTENSIONS, &count);
  for (GLint i = 0; i < count; ++i)
    if (std::strcmp(reinterpret_cast<const char*>(get_string(GL_EXTENSIONS, static_cast<GLuint>(i))), name) == 0)
      return true;
  return false;
}

/// True if the current context is on this device.
bool is_on(const Identity& identity) {
  if (!has_extension("GL_EXT_memory_object_fd")) return false;
  PFNGLGETUNSIGNEDBYTEVEXTPROC get_bytes = nullptr;
  PFNGLGETUNSIGNEDBYTEI_VEXTPROC get_bytes_of = nullptr;
  load(get_bytes, "glGetUnsignedBytevEXT");
  load(get_bytes_of, "glGetUnsignedBytei_vEXT");
  Identity own;
  get_bytes(GL_DRIVER_UUID_EXT, own.driver.data());
  get_bytes_of(GL_DEVICE_UUID_EXT, 0, own.device.data());
  return own == identity;
}

}  // namespace

void* OpenGl::get_proc(const char* name) { return reinterpret_cast<void*>(eglGetProcAddress(name)); }

OpenGl::OpenGl(const Device& device) {
  PFNEGLQUERYDEVICESEXTPROC query_devices = nullptr;
  load(query_devices, "eglQueryDevicesEXT");
  std::array<EGLDeviceEXT, 16> devices{};
  EGLint count = 0;
  if (query_devices == nullptr || query_devices(16, devices.data(), &count) == EGL_FALSE) fail("EGL lists no devices");
  for (EGLint i = 0; i < count; ++i) {
    EGLDisplay display = eglGetPlatformDisplay(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)], nullptr);
    if (eglInitialize(display, nullptr, nullptr) == EGL_FALSE) continue;
    if (make_current(display) && is_on(device.identity())) {
      load_functions();
      return;
    }
    if (context_ != EGL_NO_CONTEXT) eglDestroyContext(display, context_);
    context_ = EGL_NO_CONTEXT;
    eglTerminate(display);
  }
  fail("no OpenGL 4.5 context with GL_EXT_memory_object_fd on Vulkan's device " + device.name());
}

OpenGl::~OpenGl() {
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
  eglTerminate(display_);
}

bool OpenGl::make_current(EGLDisplay display) {
  constexpr std::array attributes{
      EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 5, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  if (eglBindAPI(EGL_OPENGL_API) == EGL_FALSE) return false;
  display_ = display;
  context_ = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes.data());
  return context_ != EGL_NO_CONTEXT && eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) != EGL_FALSE;
}

void OpenGl::load_functions() {
  load(create_memory_objects, "glCreateMemoryObjectsEXT");
  load(delete_memory_objects, "glDeleteMemoryObjectsEXT");
  load(memory_object_parameter, "glMemoryObjectParameterivEXT");
  load(import_memory, "glImportMemoryFdEXT");
  load(create_textures, "glCreateTextures");
  load(texture_parameter, "glTextureParameteri");
  load(texture_storage, "glTextureStorageMem2DEXT");
  load(create_framebuffers, "glCreateFramebuffers");
  load(framebuffer_texture, "glNamedFramebufferTexture");
  load(delete_framebuffers, "glDeleteFramebuffers");
  imports_semaphores_ = has_extension("GL_EXT_semaphore_fd");
  if (!imports_semaphores_) return;
  load(gen_semaphores, "glGenSemaphoresEXT");
  load(delete_semaphores, "glDeleteSemaphoresEXT");
  load(import_semaphore, "glImportSemaphoreFdEXT");
  load(wait_semaphore, "glWaitSemaphoreEXT");
  load(signal_semaphore, "glSignalSemaphoreEXT");
}

}  // namespace vulkan_host
