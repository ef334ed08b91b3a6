#pragma once

#include <string>

#include "gl/objects.hpp"

namespace cumulet::gl {

/// Detects whether a context of the right share group is current, using only GL calls: it queries a buffer and its
/// label. The label is needed because names count from 1 in every share group. Without a context every query returns 0.
/// (Sync objects cannot be used: on NVIDIA's 580 driver they are valid in every context of the process.)
class ShareGroup {
 public:
  /// Uses the share group of the current context. Throws on a GL error.
  explicit ShareGroup(FunctionsPtr gl);
  ShareGroup(const ShareGroup&) = delete;
  ShareGroup& operator=(const ShareGroup&) = delete;

  /// Whether a context of this group is current on the calling thread.
  [[nodiscard]] bool is_current() const;
  /// Throws Error(gl) if no context of this group is current, or Error(context_lost) if the driver reset the context.
  void require() const;

 private:
  [[nodiscard]] bool has_label() const;

  FunctionsPtr gl_;
  Object token_;
  std::string label_;         // unique among share groups
  bool keeps_label_ = false;  // drivers are not required to keep labels
};

}  // namespace cumulet::gl
