#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "assets/volume_asset.hpp"
#include "jobs/built.hpp"
#include "jobs/job_source.hpp"
#include "scene/snapshot.hpp"

namespace cumulet::viewer {

/// Arguments that all feeds of a stage have in common.
struct FeedContext {
  std::uint64_t id = 0;          ///< identifies the feed, as scene::SequenceFrame::sequence
  std::uint64_t& last_taken;     ///< counts the results that all feeds took; outlives the feed
  std::function<void()> notify;  ///< called on any thread when the source has changed
};

/// Requests grids of a source of volumes, and takes them one after another. The viewer's own volume and instances use
/// the same classes. Functions are called under the state lock.
class VolumeFeed {
 public:
  explicit VolumeFeed(const FeedContext& context) : id_(context.id), last_taken_(context.last_taken) {}
  virtual ~VolumeFeed() = default;
  VolumeFeed(const VolumeFeed&) = delete;
  VolumeFeed& operator=(const VolumeFeed&) = delete;

  /// Requests grids with these settings. Nullopt: they depend on a view, which is not known yet.
  virtual void request(const std::optional<BuildSettings>& settings) = 0;
  /// Takes new metadata of all frames. Returns true if there are any.
  virtual bool take_info() = 0;
  /// Result of take().
  enum class Taken {
    nothing,  ///< nothing is ready
    same,     ///< the same grid as before, whose voxels may have been dropped
    former,   ///< a grid of a former volume, which was requested before this one
    other     ///< another grid
  };
  /// Sends outdated requests. Takes the newest result, unless the previous one must be displayed first, so that each
  /// one that is taken is displayed. is_seen: the previous one has been displayed.
  virtual Taken take(bool is_seen) = 0;
  /// True if a result may be ready, but waits until the previous one has been displayed.
  [[nodiscard]] virtual bool waits() const = 0;
  /// True if there is work pending beside that of jobs().
  [[nodiscard]] virtual bool is_due() const = 0;
  /// Metadata of the volume; null: not known yet.
  [[nodiscard]] virtual VolumeInfoPtr info() const = 0;
  /// Voxels of the result taken last; null: none, or they are not in memory.
  [[nodiscard]] virtual VolumeAssetPtr volume() const = 0;
  /// Identifies the source.
  [[nodiscard]] virtual const void* source() const = 0;
  [[nodiscard]] virtual std::shared_ptr<JobSource> jobs() const = 0;

  /// Density scale suggested for the volume or for all frames, in the volume's own world space, which the medium is to
  /// use once a grid has been built for it. Nullopt: none, or take_suggestion() was called.
  [[nodiscard]] const std::optional<double>& suggested_density_scale() const { return suggested_density_scale_; }
  std::optional<double> take_suggestion() { return std::exchange(suggested_density_scale_, std::nullopt); }

  [[nodiscard]] std::uint64_t id() const { return id_; }
  [[nodiscard]] const std::optional<BuildSettings>& settings() const { return settings_; }
  /// The grid taken last; nullopt: none.
  [[nodiscard]] const std::optional<Built>& built() const { return built_; }
  /// Frame or state of that grid; nullopt: none.
  [[nodiscard]] const std::optional<scene::SequenceFrame>& frame() const { return frame_; }
  /// Returns the frame or state of this feed among those that are displayed; nullopt: none.
  [[nodiscard]] std::optional<scene::SequenceFrame> find_in(const scene::SequenceFrames& displayed) const {
    const auto found = std::ranges::find(displayed, id_, &scene::SequenceFrame::sequence);
    return found == displayed.end() ? std::nullopt : std::optional(*found);
  }
  /// True if a frame has rendered it.
  [[nodiscard]] bool is_rendered() const { return is_rendered_; }
  void note_rendered() { is_rendered_ = true; }

 protected:
  void set_settings(const std::optional<BuildSettings>& settings) { settings_ = settings; }
  void suggest(const std::optional<double>& density_scale) { suggested_density_scale_ = density_scale; }
  // Records a result that was taken.
  void set_taken(std::uint64_t number, double part, Built built) {
    frame_ = scene::SequenceFrame{number, id_, ++last_taken_, part};
    is_rendered_ = false;
    set_built(std::move(built));
  }
  // Records a result that is no frame or state.
  void set_built(Built built) { built_ = std::move(built); }

 private:
  std::uint64_t id_;
  std::uint64_t& last_taken_;
  std::optional<BuildSettings> settings_;
  std::optional<double> suggested_density_scale_;
  std::optional<Built> built_;
  std::optional<scene::SequenceFrame> frame_;
  bool is_rendered_ = false;
};

using VolumeFeedPtr = std::shared_ptr<VolumeFeed>;

}  // namespace cumulet::viewer
