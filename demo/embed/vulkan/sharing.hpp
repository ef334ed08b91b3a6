#pragma once
#include <array>
#include <optional>

#include "device.hpp"
#include "opengl.hpp"

namespace vulkan_host {

/// An image of Vulkan that is also a texture of OpenGL.
class SharedImage {
 public:
  SharedImage(const Device& device, const OpenGl& gl, VkFormat format, GLenum gl_format, VkExtent2D size);
  SharedImage(const SharedImage&) = delete;
  SharedImage& operator=(const SharedImage&) = delete;
  ~SharedImage();

  [[nodiscard]] VkImage image() const { return image_.image.get(); }
  [[nodiscard]] VkImageView view() const { return image_.view.get(); }
  [[nodiscard]] GLuint texture() const { return texture_; }

 private:
  const OpenGl& gl_;
  Image image_;
  GLuint memory_ = 0;
  GLuint texture_ = 0;
};

/// Who may use the shared images: Vulkan, then OpenGL, then Vulkan again. Where both drivers share semaphores the
/// device waits, else the processor.
class Handshake {
 public:
  Handshake(const Device& device, const OpenGl& gl, std::array<GLuint, 2> textures);
  Handshake(const Handshake&) = delete;
  Handshake& operator=(const Handshake&) = delete;
  ~Handshake();

  [[nodiscard]] bool uses_semaphores() const { return semaphores_.has_value(); }
  /// Submits commands whose results OpenGL uses, and lets OpenGL begin.
  void give_to_gl(VkCommandBuffer commands) const;
  /// Submits commands that use OpenGL's results. Returns when they have been executed.
  void take_from_gl(VkCommandBuffer commands) const;

 private:
  struct Shared {
    Owned<VkSemaphore> vulkan;
    GLuint gl = 0;
  };
  struct Semaphores {
    Shared scene_done, volume_done;
  };
  [[nodiscard]] Shared share_semaphore() const;

  const Device& device_;
  const OpenGl& gl_;
  std::array<GLuint, 2> textures_;
  std::optional<Semaphores> semaphores_;
};

}  // namespace vulkan_host
