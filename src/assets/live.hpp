#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "assets/bounds.hpp"
#include "assets/volume_asset.hpp"
#include "base/listeners.hpp"
#include "base/progress.hpp"
#include "volume/state.hpp"

namespace cumulet::viewer {

/// Memory of the host, returned to it when the last copy is destroyed.
using Lease = std::shared_ptr<void>;
using MakeLease = std::function<Lease()>;

/// A dynamic (streamed) volume: the host submits one state after another. The first caller that needs the newest state
/// reads it. All calls are thread-safe. Calls by the host do not wait for reading.
class Live {
 public:
  /// gpu_resident: density submitted as GL textures stays GPU-resident until its voxels are needed in main memory.
  explicit Live(const std::optional<Bounds>& bounds, bool gpu_resident = false)
      : bounds_(bounds), values_wanted_(gpu_resident ? std::make_shared<volume::ValuesWanted>() : nullptr) {}

  /// Submits a complete new state. lease: called after all checks that may fail; the voxels are then read in place
  /// until it is destroyed. Null: they are copied. Throws the errors of check_fields(), and for copied voxels those of
  /// require_finite(); nothing is submitted then.
  void set(const std::vector<volume::MemoryField>& fields, std::string name, const MakeLease& lease = nullptr);
  /// Submits a state that equals the last one except for these bricks. Throws as set(), and Error(invalid_argument) for
  /// fields that accept no bricks.
  void update(const std::vector<volume::MemoryField>& fields, const std::string& name);

  /// Submit copies whose fields have been checked and whose voxels are finite. Fields of a state set in this way accept
  /// bricks as dense fields do.
  void set(std::vector<volume::FieldCopy> fields, std::string name);
  void update(volume::Changes changes, const std::string& name);
  /// Submits a GPU-resident state.
  void set(scene::StateInGl state);
  /// Returns the newest state, which must be GPU-resident, with these bricks replaced. The bricks need not be sorted or
  /// merged. Throws as update().
  [[nodiscard]] scene::StateInGl with(const scene::StateInGl& newest,
                                      const std::vector<scene::StateInGl::Field>& changed,
                                      const std::string& name) const;
  /// Submits a successor of the GPU-resident state with this number, if that is still the newest. Returns true if it
  /// was.
  bool set_if_newest(std::uint64_t in_gl, scene::StateInGl state);
  /// Submits copies of that state's voxels, if it is still the newest. Returns true if it was.
  bool set_if_newest(std::uint64_t in_gl, std::vector<volume::FieldCopy> fields, std::string name);
  /// Requests for voxels in main memory; null: the volume is never GPU-resident.
  [[nodiscard]] const volume::ValuesWantedPtr& values_wanted() const { return values_wanted_; }
  /// True if states submitted from GL stay GPU-resident. It becomes false for good once voxels are needed in main
  /// memory.
  [[nodiscard]] bool gpu_resident() const { return values_wanted_ && !values_wanted_->asked(); }
  /// The state submitted last, if it is GPU-resident, else null.
  struct InGl {
    scene::StateInGlPtr state;
    std::uint64_t number = 0;
  };
  [[nodiscard]] InGl in_gl() const;
  /// Replaces the storage of the GPU-resident state `from`, if it is still the newest. to: the same state in other
  /// memory. Null: its memory is gone, and updates are refused until a complete state is submitted.
  void move_in_gl(const scene::StateInGlPtr& from, scene::StateInGlPtr to);
  /// Requests the emission of GPU-resident states with these settings, for as long as the result is held.
  using Request = std::shared_ptr<const scene::Emission>;
  [[nodiscard]] Request want(const scene::Emission& emission);
  /// Returns the requested settings without duplicates.
  [[nodiscard]] std::vector<scene::Emission> wanted() const;
  /// Calls `changed` when emission is requested (Listeners::listen()).
  [[nodiscard]] std::shared_ptr<void> listen_to_requests(std::function<void()> changed) {
    return request_listeners_.listen(std::move(changed));
  }

  /// Throws if update() would throw for these channels. comes: channels of a complete state that is still in transfer;
  /// nullopt: check against the last state.
  void require_updatable(const std::vector<volume::Channel>& channels,
                         const std::optional<std::vector<volume::Channel>>& comes, const std::string& name);

  /// A complete state that was announced has been refused: updates are refused until another is submitted.
  void refuse_updates();

  /// Number of submitted states, which is the number of the newest.
  [[nodiscard]] std::uint64_t newest() const { return newest_; }
  struct State {
    VolumeAssetPtr volume;     ///< null: no state yet
    std::uint64_t number = 0;  ///< 0: none
  };
  /// Returns the newest state. The first caller reads it, others wait. Throws Error(cancelled) if this caller's
  /// progress is cancelled. For a state that is refused it throws the error of import_fields(), require_finite() or
  /// VolumeAsset once; the last valid state then stays the newest.
  [[nodiscard]] State read(Progress& progress);
  /// Bounds of all states, if known.
  [[nodiscard]] const std::optional<Bounds>& bounds() const { return bounds_; }
  /// Calls `changed` when a state is submitted (Listeners::listen()); it must not submit one.
  [[nodiscard]] std::shared_ptr<void> listen(std::function<void()> changed) {
    return listeners_.listen(std::move(changed));
  }

 private:
  // Voxels of a complete state: copies, or the host's memory while the lease is held, or GPU-resident.
  struct Whole {
    std::variant<std::vector<volume::FieldCopy>, std::vector<volume::MemoryField>, scene::StateInGlPtr> fields;
    std::string name;
    Lease lease;
    [[nodiscard]] std::vector<volume::MemoryField> view() const;
  };
  // Submitted data that has not been read.
  struct Next {
    std::optional<Whole> whole;
    volume::Changes changes;  // applied to `whole`, or to the state that was read
  };
  // Kind of bricks that a field of the last submitted state accepts in an update.
  enum class Takes { zeros, bricks, nothing, bricks_in_gl };
  struct Handed {
    volume::Channel channel;
    Takes takes;
    bool operator==(const Handed&) const = default;
  };
  [[nodiscard]] std::vector<Handed> handed() const;
  static std::vector<Handed> handed_as_zeros(const std::vector<volume::FieldCopy>& fields);
  static const Handed& updatable(const std::vector<Handed>& handed, volume::Channel channel, const std::string& name);
  static const Handed& updatable_from_memory(const std::vector<Handed>& handed, volume::Channel channel,
                                             const std::string& name);
  // on_top_of: number of the GPU-resident state that it must follow; nullopt: any. Returns true if it was submitted.
  bool hand_over(Whole whole, std::vector<Handed> handed, const MakeLease& lease,
                 std::optional<std::uint64_t> on_top_of = std::nullopt);
  bool hand_over(scene::StateInGl state, std::optional<std::uint64_t> on_top_of);
  // handed: fields of the last state when the changes were made.
  void hand_over(volume::Changes changes, const std::vector<Handed>& handed, const std::string& name);
  // reading_ must be held.
  [[nodiscard]] VolumeAssetPtr read_base(Progress& progress);
  // old: receives the previous contents.
  void take_next(std::optional<Whole>& old);
  void refuse_base(std::optional<Whole>& old);

  std::optional<Bounds> bounds_;
  volume::ValuesWantedPtr values_wanted_;                       // null: states submitted from GL are copied to main
                                                                // memory
  InGl in_gl_;                                                  // the newest; guarded by mutex_
  std::vector<std::weak_ptr<const scene::Emission>> requests_;  // guarded by mutex_
  std::atomic<std::uint64_t> newest_ = 0;
  mutable std::mutex mutex_;  // guards the following; held only briefly
  Next next_;
  std::vector<Handed> handed_;
  std::mutex reading_;         // guards everything below; held while a state is read
  std::optional<Whole> base_;  // data of the state taken last, to be read or changed; none if it was refused
  std::uint64_t base_number_ = 0;
  State state_;
  // VolumeFrame::temperature_scale of later states. Once temperatures were in kelvin they stay so, even when a fire
  // cools.
  std::optional<double> temperature_scale_;
  Listeners listeners_;
  Listeners request_listeners_;
};

}  // namespace cumulet::viewer
