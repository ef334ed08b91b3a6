#pragma once

#include "gl/objects.hpp"

namespace cumulet::gl {

/// A framebuffer for one call: framebuffers belong to one context and are not shared. It covers whole textures.
class TransientFramebuffer {
 public:
  /// depth: a texture, or 0 for none. Throws Error(gl).
  TransientFramebuffer(const FunctionsPtr& gl, GLuint color, GLuint depth) : framebuffer_(make_framebuffer(gl)) {
    label(*gl, Object::Kind::framebuffer, name(), "framebuffer of one call");
    gl->NamedFramebufferTexture(name(), GL_COLOR_ATTACHMENT0, color, 0);
    if (depth != 0) gl->NamedFramebufferTexture(name(), GL_DEPTH_ATTACHMENT, depth, 0);
    check(*gl, "creating a temporary framebuffer");
  }
  [[nodiscard]] GLuint name() const { return framebuffer_.name(); }

 private:
  Object framebuffer_;
};

}  // namespace cumulet::gl
