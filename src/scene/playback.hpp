#pragma once

#include <cstdint>
#include <vector>

namespace cumulet::scene {

/// What follows the last frame, and what comes before the first.
enum class Repeat {
  hold = 0,      ///< these stay
  loop = 1,      ///< the others again
  ping_pong = 2  ///< back, and forth again; neither end comes twice
};

/// What is shown between two frames.
enum class Between {
  none = 0,   ///< the one that came last
  blend = 1,  ///< both, blended
  advect = 2  ///< both, moved along their velocities and blended; without velocities, blended
};

/// How a clock runs through frames of a sequence, which count from 0.
struct Playback {
  double frames_per_second = 24.0;  ///< above 0
  double offset_seconds = 0.0;      ///< the clock's, when the first frame begins
  Repeat repeat = Repeat::hold;
  std::uint32_t first = 0;
  std::uint32_t count = 1;  ///< of frames that are played, from the first on; one at least
  Between between = Between::none;
  std::uint32_t steps = 1;      ///< from a frame to the next, at each of which there is a picture; none between: 1
  double velocity_scale = 1.0;  ///< of frames' velocities
  bool operator==(const Playback&) const = default;
};

/// Where a sequence stands.
struct Moment {
  double position = 0.0;  ///< in frames: 2.25 is a quarter of the way from frame 2 to frame 3
  bool forward = true;    ///< whether frames come in ascending order about here, as the clock runs
  bool operator==(const Moment&) const = default;
};

/// A frame's time is its own to within a millionth of a frame: rounding takes none to the one before.
[[nodiscard]] Moment moment_at(const Playback& playback, double seconds);
/// The step that has come last: each is there for as long as the next takes to come. Between the last frame of a loop
/// and its first there is none.
[[nodiscard]] std::uint32_t step_of(const Playback& playback, const Moment& moment);
/// The frame of that step, the earlier of the two where it is between them.
[[nodiscard]] inline std::uint32_t frame_of(const Playback& playback, const Moment& moment) {
  return step_of(playback, moment) / playback.steps;
}
/// The first time, from the offset on, at which a frame that is played comes; of others what that would be.
[[nodiscard]] double time_of(const Playback& playback, double position);

/// The moment's own step and all that are played, each once, in the order in which they come from here on; behind
/// those that come, those that do not, the nearest first. forward: as the clock runs, else against it. O(steps).
[[nodiscard]] std::vector<std::uint32_t> upcoming(const Playback& playback, const Moment& moment, bool forward);

}  // namespace cumulet::scene
