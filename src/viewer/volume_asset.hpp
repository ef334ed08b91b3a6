#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/log.hpp"
#include "base/progress.hpp"
#include "grid/lattice.hpp"
#include "grid/statistics.hpp"
#include "scene/channels.hpp"
#include "scene/state_in_gl.hpp"
#include "viewer/bounds.hpp"
#include "volume/frame.hpp"
#include "volume/optical_depth.hpp"

namespace cumulet::viewer {

/// What is known of a volume without its voxels: enough to stand a camera before it.
struct VolumeFacts {
  bool empty = true;      ///< no field has an active voxel
  bool may_emit = false;  ///< a field is there that can give off light
  glm::ivec3 low{0};      ///< of the voxels that are seen
  glm::ivec3 high{0};     ///< both inclusive
  glm::dmat4 index_to_world{1.0};
  std::optional<std::string> anisotropy_grid;  ///< its name
  volume::CoarseVolume coarse;

  /// World bounds of the active voxels of density and flame; of the temperature's, if there are no such. place: where
  /// it stands there.
  [[nodiscard]] Bounds bounds(const glm::dmat4& place = glm::dmat4(1.0)) const {
    return world_bounds(low, high, place * index_to_world);
  }
};
using VolumeFactsPtr = std::shared_ptr<const VolumeFacts>;

/// A volume and what is computed of it once, however many viewers show it. Immutable to its users; any thread.
class VolumeAsset {
 public:
  /// Throws Error(unsupported) for what no control cube holds.
  explicit VolumeAsset(volume::VolumeFrame frame, const Progress* progress = nullptr);
  /// As it is while the shutter is open, from one frame to the other, of one lattice: its fields are the means of both.
  VolumeAsset(volume::VolumeFrame open, volume::VolumeFrame close, const Progress* progress = nullptr);
  /// What is in GL. temperature_scale: as VolumeFrame has it.
  explicit VolumeAsset(scene::StateInGlPtr in_gl, const Progress* progress = nullptr,
                       std::optional<double> temperature_scale = {});
  explicit VolumeAsset(volume::ScalarVolume density, const Progress* progress = nullptr)
      : VolumeAsset(volume::VolumeFrame{.density = std::move(density)}, progress) {}

  /// Its density.
  [[nodiscard]] const volume::ScalarVolume& volume() const { return frame_->density; }
  [[nodiscard]] const volume::VolumeFrame& frame() const { return *frame_; }
  /// Its density; of fire alone the flame, or the temperature.
  [[nodiscard]] const volume::ScalarVolume& main_field() const;
  [[nodiscard]] const std::string& name() const { return main_field().name; }
  /// They may outlive it.
  [[nodiscard]] const VolumeFactsPtr& facts() const { return facts_; }
  [[nodiscard]] bool may_emit() const { return facts_->may_emit; }
  /// Kelvin where its temperature is 1, for media that do not say.
  [[nodiscard]] double temperature_scale() const;
  [[nodiscard]] bool has_anisotropy() const { return frame_->anisotropy.has_value(); }
  /// Whether anything of it has a velocity.
  [[nodiscard]] bool moves() const { return fastest() > 0.0; }
  /// In voxels a second, along the axis where that is most.
  [[nodiscard]] double fastest() const { return scene::fastest_of(*frame_); }
  /// What it is from half of these seconds before its moment to half of them after it, by its velocity
  /// (volume/advection.hpp), backwards where they are negative; null where nothing moves. Kept is the last. Throws
  /// Error(cancelled), and Error(file).
  [[nodiscard]] std::shared_ptr<const VolumeAsset> while_open(double seconds, Progress& progress) const;
  [[nodiscard]] bool empty() const { return facts_->empty; }
  [[nodiscard]] Bounds bounds(const glm::dmat4& place = glm::dmat4(1.0)) const { return facts_->bounds(place); }
  [[nodiscard]] const volume::CoarseVolume& coarse() const { return facts_->coarse; }
  /// Main memory that it holds by now, with what was computed of it.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Density as marches see it; the statistics are good while the voxels are there. Channels that density weighs have
  /// the same unit.
  struct Density {
    std::shared_ptr<const volume::ScalarVolume> voxels;
    std::shared_ptr<const grid::Statistics> statistics;
    double unit = 1.0;  ///< values of the grid = this x values here (volume::value_unit)
  };
  /// The first caller computes it; others wait, and if the first is cancelled the next one computes it. Kept are that
  /// without a ramp and the last with one. seconds receives what computing took, 0 if it was there. Throws
  /// Error(cancelled) if this caller's progress is.
  [[nodiscard]] Density density(const volume::Ramp& ramp, Progress& progress, double& seconds) const;
  /// Of density with that ramp and what channels() gave: what grids of any view are built from. The last is kept.
  /// Throws as density() does.
  [[nodiscard]] grid::LatticePtr lattice(const volume::Ramp& ramp, const grid::Channels& channels,
                                         const grid::RefineSettings& refine, Progress& progress) const;
  /// By which settings what burns or is hot gives off light where these are asked for.
  [[nodiscard]] scene::Emission emission_by(const scene::Emission& emission) const;
  /// The state that is in GL; null: its voxels are in main memory.
  [[nodiscard]] const scene::StateInGlPtr& in_gl() const { return in_gl_; }
  /// Whether density without a ramp has another unit than 1.
  [[nodiscard]] bool is_extreme() const { return unit() != 1.0; }
  /// What it has beside density; anisotropic: its anisotropy, too. Of one that is in GL it was made there.
  /// The last that were asked for are kept: another threshold or camera asks for the same. log hears of what is left
  /// out, when it is made.
  [[nodiscard]] grid::Channels channels(const volume::Ramp& density_ramp, const scene::Emission& emission,
                                        bool anisotropic, Progress& progress, const Log& log = {}) const;

 private:
  void begin(const Progress* progress);
  // Of what the ramp makes of its temperature.
  [[nodiscard]] double scale_of(const volume::Ramp& temperature_ramp) const;
  using Frames = std::vector<std::shared_ptr<const volume::VolumeFrame>>;
  // As it is, or as the shutter opens and as it closes.
  [[nodiscard]] Frames frames() const;
  // Of density without a ramp.
  [[nodiscard]] double unit() const;
  // What channels that density weighs are made of: the frame, and the ramp that its density is still without.
  struct Weighing {
    std::shared_ptr<const volume::VolumeFrame> frame;
    volume::Ramp ramp;
  };
  [[nodiscard]] Weighing weighing(const std::shared_ptr<const volume::VolumeFrame>& frame, const volume::Ramp& ramp,
                                  Progress& progress) const;
  template <class Kept, class Made>
  void put(Kept& kept, Made&& made) const {
    const std::scoped_lock lock(mutex_);
    kept = std::forward<Made>(made);
  }
  template <class Kept>
  void drop(Kept& kept) const {
    const std::scoped_lock lock(mutex_);
    kept.reset();
  }

  scene::StateInGlPtr in_gl_;
  std::shared_ptr<const volume::VolumeFrame> frame_;
  std::shared_ptr<const volume::VolumeFrame> close_;  // null: there is no shutter
  VolumeFactsPtr facts_;
  grid::Cube cube_;
  // What is computed is so under the first, one thing at a time, and put here under the second, too: whoever asks how
  // much there is does not wait for it.
  mutable std::mutex computing_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const grid::Statistics> statistics_;
  struct Ramped {
    volume::Ramp ramp;
    Density density;
    std::shared_ptr<const grid::DensityEnds> ends;  // of a shutter
  };
  // Of the last ramp; computing_ is held.
  const Ramped& ramped(const volume::Ramp& ramp, Progress& progress) const;
  mutable std::optional<Ramped> ramped_;
  struct Latticed {
    volume::Ramp ramp;
    grid::Channels channels;
    grid::RefineSettings refine;
    grid::LatticePtr lattice;
  };
  mutable std::optional<Latticed> latticed_;
  struct Exposed {
    double seconds;
    std::shared_ptr<const VolumeAsset> asset;
  };
  mutable std::mutex exposing_;  // as computing_, of the one that computes itself
  mutable std::optional<Exposed> exposed_;
  struct Glowing {
    scene::Emission settings;
    decltype(grid::Channels::emission) emission;
  };
  mutable std::optional<Glowing> glowing_;
  struct Weighted {
    volume::Ramp density_ramp;
    decltype(grid::Channels::scattering) scattering;
    decltype(grid::Channels::momentum) momentum;
    std::optional<decltype(grid::Channels::forward)> forward;
  };
  mutable std::optional<Weighted> weighted_;  // by density
};

using VolumeAssetPtr = std::shared_ptr<const VolumeAsset>;

}  // namespace cumulet::viewer
