#pragma once

#include "gl/objects.hpp"

namespace cumulet::gl {

/// Tells contexts apart in which our objects are from those in which they are not, and from none, through the function
/// table alone. It asks for a sync object: their names are unlike buffers' and textures', which count from 1 in every
/// share group, and without a context every query's answer is 0.
class ShareGroup {
 public:
  /// Of the current context. Throws on a GL error.
  explicit ShareGroup(FunctionsPtr gl);
  ~ShareGroup();
  ShareGroup(const ShareGroup&) = delete;
  ShareGroup& operator=(const ShareGroup&) = delete;

  /// Whether a context of this group is current on the calling thread.
  [[nodiscard]] bool is_current() const { return gl_->IsSync(token_) != GL_FALSE; }
  /// Throws Error(gl) if none is, Error(context_lost) if that is why.
  void require() const;

 private:
  FunctionsPtr gl_;
  GLsync token_;
};

}  // namespace cumulet::gl
