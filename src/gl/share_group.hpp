#pragma once

#include <string>

#include "gl/objects.hpp"

namespace cumulet::gl {

/// Tells contexts apart in which our objects are from those in which they are not, and from none, through the function
/// table alone. It asks for a buffer and its label: names count from 1 in every share group, and without a context
/// every query's answer is 0. (Sync objects do not tell: on NVIDIA's 580 every context of the process knows all of
/// them.)
class ShareGroup {
 public:
  /// Of the current context. Throws on a GL error.
  explicit ShareGroup(FunctionsPtr gl);
  ShareGroup(const ShareGroup&) = delete;
  ShareGroup& operator=(const ShareGroup&) = delete;

  /// Whether a context of this group is current on the calling thread.
  [[nodiscard]] bool is_current() const;
  /// Throws Error(gl) if none is, Error(context_lost) if that is why.
  void require() const;

 private:
  [[nodiscard]] bool has_label() const;

  FunctionsPtr gl_;
  Object token_;
  std::string label_;         // unlike any other's that there is
  bool keeps_label_ = false;  // a driver need not
};

}  // namespace cumulet::gl
