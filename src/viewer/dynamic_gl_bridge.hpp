#pragma once

#include <array>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "assets/live.hpp"
#include "render/dynamic/voxel_transfers.hpp"
#include "scene/channels.hpp"
#include "scene/state_in_gl.hpp"
#include "volume/memory.hpp"

namespace cumulet::viewer {

class Context;

/// Moves states of dynamic volumes from GL to main memory, and makes the emission of states that stay GPU-resident.
/// track() may be called on any thread; other calls must not overlap.
class DynamicGlBridge {
 public:
  /// notify: called on any thread when voxels or emission are requested.
  explicit DynamicGlBridge(std::function<void()> notify) : notify_(std::move(notify)) {}

  /// Checks the fields as far as possible without voxels. Returns their channels.
  [[nodiscard]] static std::vector<volume::Channel> check(const render::GlState& state);
  /// Submits the next state of a dynamic volume from voxels in GL: a complete state, or the changes to the last one.
  /// channels: result of check().
  void submit(Context& g, const std::shared_ptr<Live>& live, const render::GlState& state,
              const std::vector<volume::Channel>& channels);
  /// Registers a dynamic volume with GPU-resident states for per-frame service (read-back, emission).
  void track(const std::shared_ptr<Live>& live);
  void clear();
  [[nodiscard]] bool empty() const;
  /// For GPU-resident states: starts the computation of emission and the transfer to main memory, as requested.
  void update(Context& g);
  /// True if such work is pending.
  [[nodiscard]] bool is_due(Context& g) const;
  /// Takes voxels whose transfer from GL has completed.
  static void follow_transfers(Context& g, double budget_ms);

 private:
  // A dynamic volume whose voxels may be resident in this context.
  struct InGl {
    std::weak_ptr<Live> live;
    std::array<std::shared_ptr<void>, 2> listeners;  // for requests of voxels, and of emission
    // States for which this was started or has failed; failed work is not retried.
    std::weak_ptr<const scene::StateInGl> brought, made;
    std::vector<scene::Emission> made_by;
    // True if the newest state, which is in this context, needs to be copied to main memory, or needs emission.
    [[nodiscard]] bool needs_values(Context& g, const scene::StateInGlPtr& state) const;
    [[nodiscard]] bool needs_products(const scene::StateInGlPtr& state) const;
  };
  static void bring_back(Context& g, const std::shared_ptr<Live>& live, const std::vector<volume::Channel>& channels);
  // Returns the transform for a state that stays GPU-resident; nullopt if the state must go to main memory.
  static std::optional<glm::dmat4> transform_in_gl(Context& g, const std::shared_ptr<Live>& live,
                                                   const render::GlState& state);
  static void make_products(Context& g, const std::shared_ptr<Live>& live);
  // Sorts and merges the scattered bricks of its newest state.
  static void gather(Context& g, Live& live);

  std::function<void()> notify_;
  mutable std::mutex mutex_;  // of added_, and of changes to the number of tracked_
  std::vector<InGl> added_;   // since the last update()
  std::vector<InGl> tracked_;
};

}  // namespace cumulet::viewer
