#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "assets/live.hpp"
#include "assets/medium.hpp"
#include "assets/sequence.hpp"
#include "assets/surface_asset.hpp"
#include "assets/volume_asset.hpp"
#include "base/listeners.hpp"
#include "scene/snapshot.hpp"

namespace cumulet::viewer {

/// Settings of a volume instance.
struct InstanceSettings {
  VolumeAssetPtr volume;                    ///< null: none
  std::shared_ptr<Sequence> sequence = {};  ///< replaces the volume; null: none
  std::shared_ptr<Live> live = {};          ///< replaces the volume; null: none
  glm::dmat4 to_world{1.0};
  std::optional<scene::ShutterTransforms> ends = {};  ///< transforms at shutter open and close; nullopt: no motion
  Medium medium = {};
  Ramps ramps = {};
  scene::ClipPlanes clip = {};
  bool hidden = false;
  std::uint64_t tag = 0;                                  ///< for the host's own use
  std::optional<scene::InstanceTransform> previous = {};  ///< transform one frame ago; nullopt: unchanged
};

/// Settings of a model instance.
struct ModelSettings {
  SurfaceAssetPtr surfaces;  ///< null: none
  SurfaceChoice choice;
  glm::dmat4 to_world{1.0};
  std::optional<scene::ShutterTransforms> ends = {};  ///< transforms at shutter open and close; nullopt: no motion
  bool hidden = false;
  bool shadow_only = false;
  bool holdout = false;
  std::uint32_t group = 0;                   ///< light group
  std::uint64_t tag = 0;                     ///< for the host's own use
  std::optional<glm::dmat4> previous = {};   ///< transform one frame ago; nullopt: unchanged
  std::optional<double> previous_time = {};  ///< animation time one frame ago; nullopt: unchanged
};

/// Settings that several viewers may share. All calls are thread-safe.
template <class Settings>
class Shared {
 public:
  explicit Shared(Settings settings) : settings_(std::move(settings)) {}

  /// Calls `change` under a lock; it must not throw.
  void edit(const std::function<void(Settings&)>& change) {
    {
      const std::scoped_lock lock(mutex_);
      change(settings_);
      ++revision_;
    }
    listeners_.notify();
  }
  [[nodiscard]] Settings get() const {
    const std::scoped_lock lock(mutex_);
    return settings_;
  }
  /// Changes after each edit.
  [[nodiscard]] std::uint64_t revision() const {
    const std::scoped_lock lock(mutex_);
    return revision_;
  }
  /// Calls `changed` after each edit (Listeners::listen()); it must not edit.
  [[nodiscard]] std::shared_ptr<void> listen(std::function<void()> changed) {
    return listeners_.listen(std::move(changed));
  }

 private:
  mutable std::mutex mutex_;
  Settings settings_;
  std::uint64_t revision_ = 1;
  Listeners listeners_;
};

using Instance = Shared<InstanceSettings>;
using ModelInstance = Shared<ModelSettings>;

}  // namespace cumulet::viewer
