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

#include "base/listeners.hpp"
#include "base/progress.hpp"
#include "viewer/bounds.hpp"
#include "viewer/volume_asset.hpp"
#include "volume/state.hpp"

namespace cumulet::viewer {

/// Memory of a host's, which it gets back with the last copy of this.
using Lease = std::shared_ptr<void>;
using MakeLease = std::function<Lease()>;

/// A volume whose states a host hands over one after another; the newest is read by whoever wants it first. All calls
/// are safe from any thread. Those of a host wait for no reading.
class Live {
 public:
  /// stays_in_gl: density that a host has there does, as long as nobody needs its voxels in main memory.
  explicit Live(const std::optional<Bounds>& bounds, bool stays_in_gl = false)
      : bounds_(bounds), values_wanted_(stays_in_gl ? std::make_shared<volume::ValuesWanted>() : nullptr) {}

  /// The whole of the next state. lease: called where nothing can fail any more, and voxels are read where they are
  /// until it goes; null: they are copied. Throws what check_fields does, and of voxels that are copied what
  /// require_finite does; then it is not handed over.
  void set(const std::vector<volume::MemoryField>& fields, std::string name, const MakeLease& lease = nullptr);
  /// The next state is the last one but for these bricks. Throws likewise, and Error(invalid_argument) for fields that
  /// take none.
  void update(const std::vector<volume::MemoryField>& fields, const std::string& name);

  /// The same of copies whose fields were checked, and whose voxels are finite; those of bricks take bricks as dense
  /// fields do.
  void set(std::vector<volume::FieldCopy> fields, std::string name);
  void update(volume::Changes changes, const std::string& name);
  /// The same of fields in GL.
  void set(scene::StateInGl state);
  /// What the newest, which is in GL, is with these bricks in their places; they need not be tidy. Throws as update()
  /// does.
  [[nodiscard]] scene::StateInGl with(const scene::StateInGl& newest,
                                      const std::vector<scene::StateInGl::Field>& changed,
                                      const std::string& name) const;
  /// What follows the state in GL of this number, if that is still the newest. Returns whether it is.
  bool set_if_newest(std::uint64_t in_gl, scene::StateInGl state);
  /// Voxels of it, likewise.
  bool set_if_newest(std::uint64_t in_gl, std::vector<volume::FieldCopy> fields, std::string name);
  /// Of those who need voxels; null: none has to be asked for.
  [[nodiscard]] const volume::ValuesWantedPtr& values_wanted() const { return values_wanted_; }
  /// Whether what is handed over by way of GL is to stay there; false once anyone needed its voxels.
  [[nodiscard]] bool stays_in_gl() const { return values_wanted_ && !values_wanted_->asked(); }
  /// The state that was handed over last, which is in GL; null: it is not.
  struct InGl {
    scene::StateInGlPtr state;
    std::uint64_t number = 0;
  };
  [[nodiscard]] InGl in_gl() const;
  /// If that is still the newest, what comes is on top of the same elsewhere; null: its memory is gone, and none is
  /// updated until a whole state is handed over.
  void move_in_gl(const scene::StateInGlPtr& from, scene::StateInGlPtr to);
  /// Somebody wants to know what states in GL give off by these settings, for as long as this is held.
  using Wish = std::shared_ptr<const scene::Emission>;
  [[nodiscard]] Wish want(const scene::Emission& emission);
  /// Each once.
  [[nodiscard]] std::vector<scene::Emission> wanted() const;
  /// Listeners::listen() to others being wanted.
  [[nodiscard]] std::shared_ptr<void> listen_to_wishes(std::function<void()> changed) {
    return wish_listeners_.listen(std::move(changed));
  }

  /// Throws where update() would, of these channels. comes: those of the whole state that will have been handed over by
  /// then; none: the last one.
  void require_updatable(const std::vector<volume::Channel>& channels,
                         const std::optional<std::vector<volume::Channel>>& comes, const std::string& name);

  /// A whole state that was announced was refused: none is updated until another is handed over.
  void refuse_updates();

  /// How many states were handed over; the newest has this number.
  [[nodiscard]] std::uint64_t newest() const { return newest_; }
  struct State {
    VolumeAssetPtr volume;     ///< null: there is none yet
    std::uint64_t number = 0;  ///< 0: none
  };
  /// The newest, read by this caller if nobody did; others wait. Throws Error(cancelled) if this caller's progress is,
  /// and of a state that was refused, once, what import_fields, require_finite and VolumeAsset throw: then the last
  /// good one is still the newest.
  [[nodiscard]] State read(Progress& progress);
  /// Of all that there will ever be, if it is known.
  [[nodiscard]] const std::optional<Bounds>& bounds() const { return bounds_; }
  /// Listeners::listen() to states that are handed over; must not hand over any.
  [[nodiscard]] std::shared_ptr<void> listen(std::function<void()> changed) {
    return listeners_.listen(std::move(changed));
  }

 private:
  // Voxels of a whole state: copies, or as long as the lease holds the host's; or in GL.
  struct Whole {
    std::variant<std::vector<volume::FieldCopy>, std::vector<volume::MemoryField>, scene::StateInGlPtr> fields;
    std::string name;
    Lease lease;
    [[nodiscard]] std::vector<volume::MemoryField> view() const;
  };
  // What was handed over, and nobody read yet.
  struct Next {
    std::optional<Whole> whole;
    volume::Changes changes;  // on top of that, or of what was read
  };
  // What bricks may be put into: of the state that was handed over last.
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
  // on_top_of: it follows this state in GL; none: whatever there is. Returns whether it does.
  bool hand_over(Whole whole, std::vector<Handed> handed, const MakeLease& lease,
                 std::optional<std::uint64_t> on_top_of = std::nullopt);
  bool hand_over(scene::StateInGl state, std::optional<std::uint64_t> on_top_of);
  // Of what was handed over last when they were made.
  void hand_over(volume::Changes changes, const std::vector<Handed>& handed, const std::string& name);
  // reading_ is held.
  [[nodiscard]] VolumeAssetPtr read_base(Progress& progress);
  // old: what it held before.
  void take_next(std::optional<Whole>& old);
  void refuse_base(std::optional<Whole>& old);

  std::optional<Bounds> bounds_;
  volume::ValuesWantedPtr values_wanted_;                     // null: what a host has in GL comes to main memory
  InGl in_gl_;                                                // the newest, under mutex_
  std::vector<std::weak_ptr<const scene::Emission>> wishes_;  // likewise
  std::atomic<std::uint64_t> newest_ = 0;
  mutable std::mutex mutex_;  // of these, held for moments
  Next next_;
  std::vector<Handed> handed_;
  std::mutex reading_;         // of all below, held while a state is read
  std::optional<Whole> base_;  // of the state that was taken last, to be read or changed; none where it was refused
  std::uint64_t base_number_ = 0;
  State state_;
  // VolumeFrame::temperature_scale of states from now on: once temperatures were kelvin they stay so, as a fire cools.
  std::optional<double> temperature_scale_;
  Listeners listeners_;
  Listeners wish_listeners_;
};

}  // namespace cumulet::viewer
