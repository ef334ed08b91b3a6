#pragma once

#include <memory>

#include "assets/live.hpp"
#include "scene/snapshot.hpp"

namespace cumulet::viewer {

/// Functions of the viewer that its stage calls.
class StageHost {
 public:
  StageHost() = default;
  virtual ~StageHost() = default;
  StageHost(const StageHost&) = delete;
  StageHost& operator=(const StageHost&) = delete;

  /// Takes the results of all workers.
  virtual void sync() = 0;
  /// Must be called after each change of a setting.
  virtual void touch() = 0;
  /// Notifies the host that something has changed. Thread-safe.
  virtual void notify() = 0;
  /// Returns true if this frame or state has been displayed, or if images are not being displayed at all.
  [[nodiscard]] virtual bool is_displayed(const scene::SequenceFrame& frame, bool is_rendered) const = 0;
  /// Must be called before a dynamic volume is shown.
  virtual void track(const std::shared_ptr<Live>& live) = 0;
};

}  // namespace cumulet::viewer
