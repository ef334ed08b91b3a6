#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/listeners.hpp"
#include "scene/playback.hpp"
#include "viewer/builder.hpp"

namespace cumulet::viewer {

/// What frames are read from: files that are there or not.
struct FrameFiles {
  std::vector<std::string> paths;  ///< one at least, relative to the folder that the path of `shown` is relative to
  VolumeFile shown;                ///< of each

  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(paths.size()); }
  [[nodiscard]] VolumeFile file(std::uint32_t frame) const {
    VolumeFile file = shown;
    file.path = path(frame);
    return file;
  }
  [[nodiscard]] FilePath path(std::uint32_t frame) const { return {paths[frame], shown.path}; }
};
using FrameFilesPtr = std::shared_ptr<const FrameFiles>;

/// A sequence as it stands.
struct SequenceState {
  scene::Playback playback;
  std::uint64_t memory_bytes = 0;  ///< for frames that are ready
  scene::Moment moment;
  bool forward = true;  ///< the clock runs so
};

/// Volumes that follow each other, which several viewers may show, all at the same moment. All calls are safe from any
/// thread.
class Sequence {
 public:
  Sequence(FrameFilesPtr files, const SequenceState& state) : files_(std::move(files)), state_(state) {}

  [[nodiscard]] const FrameFilesPtr& files() const { return files_; }
  /// It stays at the frame where it is.
  void set_playback(const scene::Playback& playback);
  void set_time(double seconds);
  /// 0 to the last frame's number, whether it is played or not.
  void set_position(double position);
  [[nodiscard]] SequenceState get() const;
  /// Another after each change.
  [[nodiscard]] std::uint64_t revision() const;
  /// Listeners::listen() to changes; must not change a sequence.
  [[nodiscard]] std::shared_ptr<void> listen(std::function<void()> changed) {
    return listeners_.listen(std::move(changed));
  }

 private:
  // change returns whether viewers have to know.
  template <class Change>
  void edit(Change&& change);

  FrameFilesPtr files_;
  mutable std::mutex mutex_;
  SequenceState state_;
  std::optional<double> seconds_;  // as they were set last
  std::uint64_t revision_ = 1;
  Listeners listeners_;
};

}  // namespace cumulet::viewer
