#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "base/listeners.hpp"
#include "viewer/live.hpp"
#include "viewer/sequence.hpp"
#include "viewer/settings.hpp"
#include "viewer/surface_asset.hpp"
#include "viewer/volume_asset.hpp"

namespace cumulet::viewer {

/// A volume in scenes, as its host has it.
struct InstanceSettings {
  VolumeAssetPtr volume;                    ///< null: none
  std::shared_ptr<Sequence> sequence = {};  ///< in its place; null: none
  std::shared_ptr<Live> live = {};          ///< likewise
  glm::dmat4 to_world{1.0};
  std::optional<scene::PlaceEnds> ends = {};  ///< as the shutter opens, and as it closes; nothing: it stands still
  Medium medium = {};
  Ramps ramps = {};
  bool hidden = false;
  std::uint64_t tag = 0;                      ///< the host's own
  std::optional<scene::Place> previous = {};  ///< where it was a frame ago; none: where it is
};

/// Surfaces in scenes, likewise.
struct ModelSettings {
  SurfaceAssetPtr surfaces;  ///< null: nothing
  SurfaceChoice choice;
  glm::dmat4 to_world{1.0};
  std::optional<scene::PlaceEnds> ends = {};  ///< likewise
  bool hidden = false;
  bool shadow_only = false;
  bool holdout = false;
  std::uint32_t group = 0;                   ///< of lights
  std::uint64_t tag = 0;                     ///< the host's own
  std::optional<glm::dmat4> previous = {};   ///< where it was a frame ago; none: where it is
  std::optional<double> previous_time = {};  ///< and at which moment; none: at this
};

/// What several viewers may show. All calls are safe from any thread.
template <class Settings>
class Shared {
 public:
  explicit Shared(Settings settings) : settings_(std::move(settings)) {}

  /// change is called under a lock, and must not throw.
  void edit(const std::function<void(Settings&)>& change) {
    {
      const std::scoped_lock lock(mutex_);
      change(settings_);
      ++revision_;
    }
    listeners_.tell();
  }
  [[nodiscard]] Settings get() const {
    const std::scoped_lock lock(mutex_);
    return settings_;
  }
  /// Another after each change.
  [[nodiscard]] std::uint64_t revision() const {
    const std::scoped_lock lock(mutex_);
    return revision_;
  }
  /// Listeners::listen() to changes; must not change one.
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
