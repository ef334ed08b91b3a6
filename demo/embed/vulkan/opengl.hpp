#pragma once
#include <EGL/egl.h>
#include <GL/gl.h>
#include <GL/glext.h>

#include "device.hpp"

namespace vulkan_host {

/// An OpenGL 4.5 core context without a surface, on the device of the Vulkan program. It is current until it ends.
class OpenGl {
 public:
  explicit OpenGl(const Device& device);
  OpenGl(const OpenGl&) = delete;
  OpenGl& operator=(const OpenGl&) = delete;
  ~OpenGl();

  /// True if the context imports semaphores.
  [[nodiscard]] bool imports_semaphores() const { return imports_semaphores_; }
  /// For cumulet::ViewerDesc::get_proc.
  static void* get_proc(const char* name);

  // The functions that share objects with Vulkan.
  PFNGLCREATEMEMORYOBJECTSEXTPROC create_memory_objects = nullptr;
  PFNGLDELETEMEMORYOBJECTSEXTPROC delete_memory_objects = nullptr;
  PFNGLMEMORYOBJECTPARAMETERIVEXTPROC memory_object_parameter = nullptr;
  PFNGLIMPORTMEMORYFDEXTPROC import_memory = nullptr;
  PFNGLCREATETEXTURESPROC create_textures = nullptr;
  PFNGLTEXTUREPARAMETERIPROC texture_parameter = nullptr;
  PFNGLTEXTURESTORAGEMEM2DEXTPROC texture_storage = nullptr;
  PFNGLCREATEFRAMEBUFFERSPROC create_framebuffers = nullptr;
  PFNGLNAMEDFRAMEBUFFERTEXTUREPROC framebuffer_texture = nullptr;
  PFNGLDELETEFRAMEBUFFERSPROC delete_framebuffers = nullptr;
  PFNGLGENSEMAPHORESEXTPROC gen_semaphores = nullptr;
  PFNGLDELETESEMAPHORESEXTPROC delete_semaphores = nullptr;
  PFNGLIMPORTSEMAPHOREFDEXTPROC import_semaphore = nullptr;
  PFNGLWAITSEMAPHOREEXTPROC wait_semaphore = nullptr;
  PFNGLSIGNALSEMAPHOREEXTPROC signal_semaphore = nullptr;

 private:
  [[nodiscard]] bool make_current(EGLDisplay display);
  void load_functions();

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  bool imports_semaphores_ = false;
};

}  // namespace vulkan_host
