#pragma once

#include <cstdint>
#include <vector>

namespace cumulet::scene {

/// Behavior before the first and after the last frame.
enum class Repeat {
  hold = 0,      ///< the first or last frame stays
  loop = 1,      ///< starts over
  ping_pong = 2  ///< runs backward, then forward again; the end frames are not repeated
};

/// Interpolation between two frames.
enum class Between {
  none = 0,   ///< shows the earlier frame
  blend = 1,  ///< blends both frames
  advect = 2  ///< advects both along their velocities and blends them; blends if there are no velocities
};

/// Maps a clock to the frames of a sequence, which are numbered from 0.
struct Playback {
  double frames_per_second = 24.0;  ///< > 0
  double offset_seconds = 0.0;      ///< clock time at which the first frame begins
  Repeat repeat = Repeat::hold;
  std::uint32_t first = 0;
  std::uint32_t count = 1;  ///< number of frames to play, starting with `first`; at least 1
  Between between = Between::none;
  std::uint32_t steps = 1;      ///< images per frame interval; 1: none between frames
  double velocity_scale = 1.0;  ///< scale factor for the frames' velocities
  bool operator==(const Playback&) const = default;
};

/// A playback position.
struct Moment {
  double position = 0.0;  ///< in frames: 2.25 is a quarter of the way from frame 2 to frame 3
  bool forward = true;    ///< whether frame numbers ascend at this position as the clock advances
  bool operator==(const Moment&) const = default;
};

/// Returns the position at a clock time. Positions within a millionth of a frame of a whole frame are rounded to it.
[[nodiscard]] Moment moment_at(const Playback& playback, double seconds);
/// Returns the latest step at or before the moment in playback order. Between the last frame of a loop and its first
/// there are no intermediate steps.
[[nodiscard]] std::uint32_t step_of(const Playback& playback, const Moment& moment);
/// Returns the frame of that step; between two frames, the earlier one.
[[nodiscard]] inline std::uint32_t frame_of(const Playback& playback, const Moment& moment) {
  return step_of(playback, moment) / playback.steps;
}
/// Returns the first time, from the offset on, at which the position is reached. For a position outside the played
/// range, extrapolates.
[[nodiscard]] double time_of(const Playback& playback, double position);

/// Returns the current step and all played steps, each once, in the order in which they will be shown. Steps that will
/// not be shown come last, nearest first. forward: in the direction of the clock, else against it. O(steps).
[[nodiscard]] std::vector<std::uint32_t> upcoming(const Playback& playback, const Moment& moment, bool forward);

}  // namespace cumulet::scene
