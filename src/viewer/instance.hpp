#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <mutex>
#include <utility>

#include "base/listeners.hpp"
#include "viewer/settings.hpp"
#include "viewer/volume_asset.hpp"

namespace cumulet::viewer {

/// A volume in scenes, as its host has it.
struct InstanceSettings {
  VolumeAssetPtr volume;  ///< null: nothing
  glm::dmat4 to_world{1.0};
  Medium medium = {};
  Ramps ramps = {};
  bool hidden = false;
  std::uint64_t tag = 0;  ///< the host's own
};

/// What several viewers may show. All calls are safe from any thread.
class Instance {
 public:
  explicit Instance(InstanceSettings settings) : settings_(std::move(settings)) {}

  /// change is called under a lock, and must not throw.
  void edit(const std::function<void(InstanceSettings&)>& change);
  [[nodiscard]] InstanceSettings get() const;
  /// Another after each change.
  [[nodiscard]] std::uint64_t revision() const;
  /// Listeners::listen() to changes; must not change an instance.
  [[nodiscard]] std::shared_ptr<void> listen(std::function<void()> changed) {
    return listeners_.listen(std::move(changed));
  }

 private:
  mutable std::mutex mutex_;
  InstanceSettings settings_;
  std::uint64_t revision_ = 1;
  Listeners listeners_;
};

}  // namespace cumulet::viewer
