#pragma once

#include <frames.hpp>
#include <optional>
#include <string>
#include <vector>

#include "options.hpp"

namespace cumulet::demo {

/// A frame of a sequence, possibly interpolated between two files, and the files that it reads and writes.
struct PlannedFrame {
  Moment number;
  std::string volume;
  /// Set if the frame is interpolated between two files.
  struct Next {
    std::string volume;      ///< file of the following frame
    std::uint32_t part = 0;  ///< position between the two files: part / parts
    std::uint32_t parts = 1;
    std::uint32_t frames = 1;  ///< distance of the two files in frames
  };
  std::optional<Next> next;
  double seconds = 0.0;  ///< on the scene's clock
  std::string output;
  std::string stats;       ///< empty: none
  std::string checkpoint;  ///< empty: none
};

struct FramePlan {
  std::vector<PlannedFrame> frames;  ///< at least one, in the requested order
  /// All existing volumes of the sequence, largest file first. Settings shared by the sequence are derived from the
  /// first one that can be read, so that they do not depend on the requested frames.
  std::vector<std::string> analyzed_by;
  /// FramePattern::passed_over() of the volume: a warning about files that the pattern skips.
  std::string passed_over;
};

/// Plans the frames requested by --frames and by frame-number placeholders in the names of volume, output and
/// statistics. Returns nullopt for a single image. Throws UsageError if the names do not suit the number of frames, and
/// std::runtime_error, one line, if no file of the sequence exists.
[[nodiscard]] std::optional<FramePlan> plan_frames(const RenderOptions& options);

/// Returns true if the frame's output exists and is not empty. An empty file only reserves the name.
[[nodiscard]] bool is_made(const std::string& output);

enum class FrameState { done, kept, failed };

/// Returns the status line of a frame, for render farms to parse: "frame 12 (3 of 20) done out.0012.exr in 8.21 s",
/// "frame 13 (4 of 20) kept out.0013.exr", "frame 14 (5 of 20) failed fire.0014.vdb: it is not there".
[[nodiscard]] std::string frame_line(const Moment& number, std::size_t position, std::size_t count, FrameState state,
                                     const std::string& what);

}  // namespace cumulet::demo
