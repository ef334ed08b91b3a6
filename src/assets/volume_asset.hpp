#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "assets/bounds.hpp"
#include "base/log.hpp"
#include "base/progress.hpp"
#include "grid/lattice.hpp"
#include "grid/statistics.hpp"
#include "scene/channels.hpp"
#include "scene/state_in_gl.hpp"
#include "volume/frame.hpp"
#include "volume/optical_depth.hpp"

namespace cumulet::viewer {

/// Metadata of a volume that is available without its voxels, for example to fit a camera.
struct VolumeInfo {
  bool empty = true;      ///< no field has an active voxel
  bool may_emit = false;  ///< it has a field that can emit light
  glm::ivec3 low{0};      ///< of the visible voxels, inclusive
  glm::ivec3 high{0};     ///< inclusive
  glm::dmat4 index_to_world{1.0};
  std::optional<std::string> anisotropy_grid;  ///< its name
  volume::CoarseVolume coarse;
  volume::CoarseVolume flame = {};        ///< empty: there is none, or its values are unknown
  volume::CoarseVolume temperature = {};  ///< as flame
  scene::EmissionDefaults emission_defaults = {};

  /// Returns true if it may emit anywhere.
  [[nodiscard]] bool has_unknown_emission() const { return may_emit && flame.empty() && temperature.empty(); }
  /// Returns the world bounds of the active voxels of density and flame, or of temperature if there are none.
  /// transform: instance transform.
  [[nodiscard]] Bounds bounds(const glm::dmat4& transform = glm::dmat4(1.0)) const {
    return world_bounds(low, high, transform * index_to_world);
  }
};
using VolumeInfoPtr = std::shared_ptr<const VolumeInfo>;

/// A volume and data derived from it, shared by all viewers that show it. Immutable for its users; thread-safe.
class VolumeAsset {
  struct Interpolated {};

 public:
  /// Throws Error(unsupported) if the volume does not fit into a control cube.
  explicit VolumeAsset(volume::VolumeFrame frame, const Progress* progress = nullptr);
  /// Creates the volume of a shutter interval, from its state at shutter open and close. Both must have the same
  /// lattice. Its fields are the means of both.
  VolumeAsset(volume::VolumeFrame open, volume::VolumeFrame close, const Progress* progress = nullptr);
  /// Creates a GPU-resident volume. temperature_scale: as VolumeFrame::temperature_scale.
  explicit VolumeAsset(scene::StateInGlPtr in_gl, const Progress* progress = nullptr,
                       std::optional<double> temperature_scale = {});
  explicit VolumeAsset(volume::ScalarVolume density, const Progress* progress = nullptr)
      : VolumeAsset(volume::VolumeFrame{.density = std::move(density)}, progress) {}
  /// See interpolated().
  VolumeAsset(const VolumeAsset& nearest, Interpolated tag);

  /// The density field.
  [[nodiscard]] const volume::ScalarVolume& volume() const { return frame_->density; }
  [[nodiscard]] const volume::VolumeFrame& frame() const { return *frame_; }
  /// The density; for fire without density the flame, else the temperature.
  [[nodiscard]] const volume::ScalarVolume& main_field() const;
  [[nodiscard]] const std::string& name() const { return main_field().name; }
  /// The metadata may outlive the asset.
  [[nodiscard]] const VolumeInfoPtr& volume_info() const { return volume_info_; }
  [[nodiscard]] bool may_emit() const { return volume_info_->may_emit; }
  /// Kelvin at temperature 1, for media that do not set a scale.
  [[nodiscard]] double temperature_scale() const;
  [[nodiscard]] bool has_anisotropy() const { return frame_->anisotropy.has_value(); }
  /// True if it has a non-zero velocity.
  [[nodiscard]] bool moves() const { return fastest() > 0.0; }
  /// Maximum velocity component along any axis, in voxels per second.
  [[nodiscard]] double fastest() const { return scene::fastest_of(*frame_); }
  /// Returns the volume for a shutter interval of `seconds`, centered at its own time, advected by its velocity
  /// (volume/advection.hpp); backwards if `seconds` is negative. Null if nothing moves. The last result is cached.
  /// Throws Error(cancelled) and Error(file).
  [[nodiscard]] std::shared_ptr<const VolumeAsset> while_open(double seconds, Progress& progress) const;
  [[nodiscard]] bool empty() const { return volume_info_->empty; }
  [[nodiscard]] Bounds bounds(const glm::dmat4& transform = glm::dmat4(1.0)) const {
    return volume_info_->bounds(transform);
  }
  [[nodiscard]] const volume::CoarseVolume& coarse() const { return volume_info_->coarse; }
  /// Returns the volume with linear interpolation between its voxels: it shares them and has its own derived data. It
  /// is made once. The voxels must be in main memory. Throws Error(unsupported) if it does not fit into a control cube.
  [[nodiscard]] std::shared_ptr<const VolumeAsset> interpolated() const;
  /// Main memory in bytes, including data derived so far.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Density for grid builds. The statistics are valid while `voxels` is held. Channels weighted by density have the
  /// same unit.
  struct Density {
    std::shared_ptr<const volume::ScalarVolume> voxels;
    std::shared_ptr<const grid::Statistics> statistics;
    double unit = 1.0;  ///< grid values = unit x values here (volume::value_unit)
  };
  /// The first caller computes the density and others wait; if the first is cancelled, the next one computes it. The
  /// result without a ramp and the last one with a ramp are cached. seconds: receives the computing time, 0 if cached.
  /// Throws Error(cancelled) if this caller's progress is cancelled.
  [[nodiscard]] Density density(const volume::Ramp& ramp, Progress& progress, double& seconds) const;
  /// Returns the lattice from which grids for any view are built, for density with this ramp and the result of
  /// channels(). The last one is cached. Throws as density().
  [[nodiscard]] grid::LatticePtr lattice(const volume::Ramp& ramp, const grid::Channels& channels,
                                         const grid::RefineSettings& refine, Progress& progress) const;
  /// Returns the emission settings that apply to this volume: fills in values that `emission` leaves open.
  [[nodiscard]] scene::Emission emission_by(const scene::Emission& emission) const;
  /// Returns the object that users of the volume share beside it, made by the first call. There is one type of it.
  template <class Kept>
  [[nodiscard]] std::shared_ptr<Kept> kept() const {
    const std::scoped_lock lock(mutex_);
    if (!kept_) kept_ = std::make_shared<Kept>();
    return std::static_pointer_cast<Kept>(kept_);
  }
  /// The GPU-resident state; null: voxels are in main memory.
  [[nodiscard]] const scene::StateInGlPtr& in_gl() const { return in_gl_; }
  /// True if density without a ramp has another unit than 1.
  [[nodiscard]] bool is_extreme() const { return unit() != 1.0; }
  /// Returns the fields beside density. anisotropic: include anisotropy. For a GPU-resident volume they were computed
  /// on the GPU, without color ramps. The last result is cached, because other thresholds and cameras need the same.
  /// log: receives messages about omitted fields when the result is computed.
  [[nodiscard]] grid::Channels channels(const scene::DensityRamps& ramps, const scene::Emission& emission,
                                        bool anisotropic, Progress& progress, const Log& log = {}) const;

 private:
  void begin(const Progress* progress);
  [[nodiscard]] std::uint64_t derived_bytes() const;
  using Frames = std::vector<std::shared_ptr<const volume::VolumeFrame>>;
  // The frame, or the frames at shutter open and close.
  [[nodiscard]] Frames frames() const;
  // Unit of density without a ramp.
  [[nodiscard]] double unit() const;
  // Source of the channels weighted by density: the frame, and the ramps that have not been applied to its density.
  struct Weighing {
    std::shared_ptr<const volume::VolumeFrame> frame;
    scene::DensityRamps ramps;
    std::shared_ptr<const volume::VolumeFrame> colored_by = frame;  // its densities have colors
  };
  [[nodiscard]] Weighing weighing(const std::shared_ptr<const volume::VolumeFrame>& frame,
                                  const scene::DensityRamps& ramps, Progress& progress) const;
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
  std::shared_ptr<const volume::VolumeFrame> close_;  // null: no shutter interval
  VolumeInfoPtr volume_info_;
  // Inclusive bounds of the voxels of all fields that are shown.
  struct Box {
    glm::ivec3 low{std::numeric_limits<int>::max()};
    glm::ivec3 high{std::numeric_limits<int>::min()};

    void add(const volume::ScalarVolume& field);
    [[nodiscard]] bool empty() const { return low.x > high.x; }
  };
  Box box_;
  grid::Cube cube_;
  // Results are computed under the first mutex, one at a time, and stored under the second one too, so that bytes()
  // does not wait for a computation.
  mutable std::mutex computing_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const grid::Statistics> statistics_;
  struct Ramped {
    volume::Ramp ramp;
    Density density;
    std::shared_ptr<const grid::DensityEnds> ends;  // for a shutter interval
  };
  // Returns the density for this ramp; the last one is cached. computing_ must be held.
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
  mutable std::mutex exposing_;  // like computing_, for exposed_, whose asset computes its own data
  mutable std::optional<Exposed> exposed_;
  struct Glowing {
    scene::Emission settings;
    decltype(grid::Channels::emission) emission;
  };
  mutable std::optional<Glowing> glowing_;
  struct Weighted {
    scene::DensityRamps ramps;
    grid::Channels fields;
    bool anisotropic = false;  // whether fields has the anisotropy, if the volume has one
  };
  mutable std::optional<Weighted> weighted_;  // by density
  mutable std::shared_ptr<const VolumeAsset> interpolated_;
  mutable std::shared_ptr<void> kept_;  // SharedGrids
};

using VolumeAssetPtr = std::shared_ptr<const VolumeAsset>;

}  // namespace cumulet::viewer
