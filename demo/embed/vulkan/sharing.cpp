#include "sharing.hpp"

namespace vulkan_host {

SharedImage::SharedImage(const Device& device, const OpenGl& gl, VkFormat format, GLenum gl_format, VkExtent2D size)
    : gl_(gl),
      image_(device.create_image({.format = format,
                                  .size = size,
                                  .usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT |
                                           VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT,
                                  .shared = true})) {
  const GLint dedicated = GL_TRUE;
  gl.create_memory_objects(1, &memory_);
  gl.memory_object_parameter(memory_, GL_DEDICATED_MEMORY_OBJECT_EXT, &dedicated);
  // OpenGL owns the file descriptor from here on.
  gl.import_memory(memory_, image_.bytes, GL_HANDLE_TYPE_OPAQUE_FD_EXT, device.export_memory(image_.memory.get()));
  gl.create_textures(GL_TEXTURE_2D, 1, &texture_);
  gl.texture_parameter(texture_, GL_TEXTURE_TILING_EXT, GL_OPTIMAL_TILING_EXT);
  gl.texture_storage(texture_, 1, gl_format, static_cast<GLsizei>(size.width), static_cast<GLsizei>(size.height),
                     memory_, 0);
  if (glGetError() != GL_NO_ERROR) fail("OpenGL cannot import an image of Vulkan");
}

SharedImage::~SharedImage() {
  glDeleteTextures(1, &texture_);
  gl_.delete_memory_objects(1, &memory_);
}

Handshake::Handshake(const Device& device, const OpenGl& gl, std::array<GLuint, 2> textures)
    : device_(device), gl_(gl), textures_(textures) {
  if (device.exports_semaphores() && gl.imports_semaphores())
    semaphores_ = {.scene_done = share_semaphore(), .volume_done = share_semaphore()};
}

Handshake::~Handshake() {
  if (!semaphores_) return;
  gl_.delete_semaphores(1, &semaphores_->scene_done.gl);
  gl_.delete_semaphores(1, &semaphores_->volume_done.gl);
}

Handshake::Shared Handshake::share_semaphore() const {
  Shared made{.vulkan = device_.create_shared_semaphore()};
  gl_.gen_semaphores(1, &made.gl);
  gl_.import_semaphore(made.gl, GL_HANDLE_TYPE_OPAQUE_FD_EXT, device_.export_semaphore(made.vulkan.get()));
  if (glGetError() != GL_NO_ERROR) fail("OpenGL cannot import a semaphore of Vulkan");
  return made;
}

void Handshake::give_to_gl(VkCommandBuffer commands) const {
  if (!semaphores_) {
    device_.submit(commands, VK_NULL_HANDLE, VK_NULL_HANDLE);
    device_.wait_idle();
    return;
  }
  device_.submit(commands, VK_NULL_HANDLE, semaphores_->scene_done.vulkan.get());
  constexpr std::array<GLenum, 2> layouts{GL_LAYOUT_GENERAL_EXT, GL_LAYOUT_GENERAL_EXT};
  gl_.wait_semaphore(semaphores_->scene_done.gl, 0, nullptr, 2, textures_.data(), layouts.data());
}

void Handshake::take_from_gl(VkCommandBuffer commands) const {
  if (semaphores_) {
    constexpr std::array<GLenum, 2> layouts{GL_LAYOUT_GENERAL_EXT, GL_LAYOUT_GENERAL_EXT};
    gl_.signal_semaphore(semaphores_->volume_done.gl, 0, nullptr, 2, textures_.data(), layouts.data());
    glFlush();  // Vulkan may wait only for a signal that OpenGL has submitted
    device_.submit(commands, semaphores_->volume_done.vulkan.get(), VK_NULL_HANDLE);
  } else {
    glFinish();
    device_.submit(commands, VK_NULL_HANDLE, VK_NULL_HANDLE);
  }
  device_.wait_idle();
}

}  // namespace vulkan_host
