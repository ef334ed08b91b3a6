#pragma once

#include <frames.hpp>
#include <optional>
#include <string>
#include <vector>

#include "options.hpp"

namespace cumulet::demo {

/// One frame of a sequence, or what is between two: which files it reads and writes.
struct PlannedFrame {
  Moment number;
  std::string volume;
  /// Where it is between two.
  struct Next {
    std::string volume;      ///< of the frame behind
    std::uint32_t part = 0;  ///< so many parts of the way to it
    std::uint32_t parts = 1;
    std::uint32_t frames = 1;  ///< that it is away
  };
  std::optional<Next> next;
  double seconds = 0.0;  ///< of the scene's clock
  std::string output;
  std::string stats;       ///< empty: none
  std::string checkpoint;  ///< likewise
};

struct FramePlan {
  std::vector<PlannedFrame> frames;  ///< at least one, in the order they are asked for
  /// All volumes of the sequence that are there, the largest file first. What the whole sequence has in common is taken
  /// from the first of them that can be read: whichever frames are asked for, it is the same.
  std::vector<std::string> judged_by;
  /// FramePattern::passed_over of the volume's name.
  std::string passed_over;
};

/// What --frames, and places for a frame's number in the names of volume, output and statistics, ask for; nothing where
/// neither does: one picture of what is named. Throws UsageError for names that do not go with so many frames, and
/// std::runtime_error, one line, for a sequence of which no file is there.
[[nodiscard]] std::optional<FramePlan> plan_frames(const RenderOptions& options);

/// Whether a frame's file is there already: one that is empty is none, but what somebody reserved its name by.
[[nodiscard]] bool is_made(const std::string& output);

enum class FrameState { done, kept, failed };

/// What a queue reads of a frame, a line each: "frame 12 (3 of 20) done out.0012.exr in 8.21 s", "frame 13 (4 of 20)
/// kept out.0013.exr", "frame 14 (5 of 20) failed fire.0014.vdb: it is not there".
[[nodiscard]] std::string frame_line(const Moment& number, std::size_t place, std::size_t count, FrameState state,
                                     const std::string& what);

}  // namespace cumulet::demo
