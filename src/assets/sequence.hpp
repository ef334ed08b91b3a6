#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "assets/volume_file.hpp"
#include "base/listeners.hpp"
#include "scene/playback.hpp"

namespace cumulet::viewer {

/// The files of a sequence's frames, which may or may not exist.
struct FrameFiles {
  std::vector<std::string> paths;  ///< at least one, relative to the folder that the path of `shown` is relative to
  VolumeFile shown;                ///< applies to each frame; its path is replaced

  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(paths.size()); }
  [[nodiscard]] VolumeFile file(std::uint32_t frame) const {
    VolumeFile file = shown;
    file.path = path(frame);
    return file;
  }
  [[nodiscard]] FilePath path(std::uint32_t frame) const { return {paths[frame], shown.path}; }
};
using FrameFilesPtr = std::shared_ptr<const FrameFiles>;

/// Playback state of a sequence.
struct SequenceState {
  scene::Playback playback;
  std::uint64_t memory_bytes = 0;  ///< memory limit for cached frames
  scene::Moment moment;
  bool forward = true;  ///< direction of the clock
};

/// A sequence of volumes. Several viewers may show it, all at the same time of its clock. All calls are thread-safe.
class Sequence {
 public:
  Sequence(FrameFilesPtr files, const SequenceState& state) : files_(std::move(files)), state_(state) {}

  [[nodiscard]] const FrameFilesPtr& files() const { return files_; }
  /// The current frame is kept.
  void set_playback(const scene::Playback& playback);
  void set_time(double seconds);
  /// From 0 to the last frame's number, inside or outside the played range.
  void set_position(double position);
  [[nodiscard]] SequenceState get() const;
  /// Changes after each change that viewers must process.
  [[nodiscard]] std::uint64_t revision() const;
  /// Calls `changed` after each change (Listeners::listen()); it must not change a sequence.
  [[nodiscard]] std::shared_ptr<void> listen(std::function<void()> changed) {
    return listeners_.listen(std::move(changed));
  }

 private:
  // change: returns true if viewers must be notified.
  template <class Change>
  void edit(Change&& change);

  FrameFilesPtr files_;
  mutable std::mutex mutex_;
  SequenceState state_;
  std::optional<double> seconds_;  // as set last
  std::uint64_t revision_ = 1;
  Listeners listeners_;
};

}  // namespace cumulet::viewer
