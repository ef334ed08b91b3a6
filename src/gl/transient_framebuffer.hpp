#pragma once

#include "gl/objects.hpp"

namespace cumulet::gl {

/// A framebuffer of the current context, for one call: they are not shared. Of whole textures.
class TransientFramebuffer {
 public:
  /// depth: 0: none. Throws Error(gl).
  TransientFramebuffer(const Functions& gl, GLuint colour, GLuint depth) : gl_(&gl) {
    gl_->CreateFramebuffers(1, &name_);
    label(gl, Object::Kind::framebuffer, name_, "framebuffer of the target");
    gl_->NamedFramebufferTexture(name_, GL_COLOR_ATTACHMENT0, colour, 0);
    if (depth != 0) gl_->NamedFramebufferTexture(name_, GL_DEPTH_ATTACHMENT, depth, 0);
    check(gl, "making the target's framebuffer");
  }
  ~TransientFramebuffer() { gl_->DeleteFramebuffers(1, &name_); }
  TransientFramebuffer(const TransientFramebuffer&) = delete;
  TransientFramebuffer& operator=(const TransientFramebuffer&) = delete;
  [[nodiscard]] GLuint name() const { return name_; }

 private:
  const Functions* gl_;
  GLuint name_ = 0;
};

}  // namespace cumulet::gl
