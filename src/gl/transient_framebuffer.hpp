#pragma once

#include "gl/objects.hpp"

namespace cumulet::gl {

/// A framebuffer of the current context, for one call: they are not shared. Of whole textures.
class TransientFramebuffer {
 public:
  /// depth: 0: none. Throws Error(gl).
  TransientFramebuffer(const FunctionsPtr& gl, GLuint colour, GLuint depth) : framebuffer_(make_framebuffer(gl)) {
    label(*gl, Object::Kind::framebuffer, name(), "framebuffer of one call");
    gl->NamedFramebufferTexture(name(), GL_COLOR_ATTACHMENT0, colour, 0);
    if (depth != 0) gl->NamedFramebufferTexture(name(), GL_DEPTH_ATTACHMENT, depth, 0);
    check(*gl, "making a framebuffer for one call");
  }
  [[nodiscard]] GLuint name() const { return framebuffer_.name(); }

 private:
  Object framebuffer_;
};

}  // namespace cumulet::gl
