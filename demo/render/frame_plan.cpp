#include "frame_plan.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <frame_pattern.hpp>
#include <numeric>
#include <settings.hpp>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace cumulet::demo {
namespace {

namespace fs = std::filesystem;

/// Returns the pattern of the volume's file name; nullopt if the name means a single file.
std::optional<FramePattern> volume_pattern(const RenderOptions& options) {
  const std::string& volume = options.scene.volume;
  if (options.frames.empty()) {
    std::error_code error;
    if (volume.empty() || fs::exists(volume, error)) return std::nullopt;
    return FramePattern::parse(volume);
  }
  if (volume.empty()) throw UsageError("--frames needs a volume, but the scene has none");
  if (auto pattern = FramePattern::parse(volume)) return pattern;
  if (auto pattern = FramePattern::of_file(volume)) return pattern;
  throw UsageError("--frames: the name '" + volume + "' has no frame number and no placeholder such as ####");
}

/// Name of an output file per frame. All names have the same number of decimals, so that they sort in playback order.
class Written {
 public:
  Written(const char* flag, const std::string& name, const std::vector<Moment>& moments) : name_(name) {
    const std::size_t count = moments.size();
    for (const Moment& moment : moments) decimals_ = std::max(decimals_, moment.decimals());
    try {
      pattern_ = FramePattern::parse(name);
    } catch (const UsageError& error) {
      throw UsageError(std::string(flag) + ": " + error.what());
    }
    if (count > 1 && !name.empty() && !pattern_) {
      const fs::path path(name);
      throw UsageError(std::string(flag) + ": the name '" + name + "' is used for " + std::to_string(count) +
                       " frames and needs a placeholder for the frame number, such as " + path.stem().string() +
                       ".####" + path.extension().string());
    }
  }
  [[nodiscard]] std::string of(const Moment& moment) const {
    return pattern_ ? pattern_->file(moment, decimals_) : name_;
  }

 private:
  std::string name_;
  std::optional<FramePattern> pattern_;
  std::size_t decimals_ = 0;
};

/// Frame numbers of a sequence, starting at the first existing file, with a constant step.
struct Grid {
  Frame first;
  Frame step;

  explicit Grid(const std::vector<Frame>& there) : first(there.front()), step(step_of(there)) {}
  /// Returns the number of the last file at or before `frame`.
  [[nodiscard]] Frame before(Frame frame) const { return frame < first ? frame : frame - (frame - first) % step; }
};

/// Returns how to interpolate at `moment` between two files.
PlannedFrame::Next next_of(const Moment& moment, const FramePattern& volume, const Grid& grid) {
  constexpr std::int64_t max_parts = 1000;  // limit of the library
  const Frame before = grid.before(moment.frame);
  const std::int64_t way = moment.in_thousandths() - Moment(before).in_thousandths();
  const std::int64_t length = Moment(grid.step).in_thousandths();
  const std::int64_t common = std::gcd(way, length);
  if (length / common > max_parts)
    throw UsageError("frame " + moment.text() + ": the files are " + std::to_string(grid.step) +
                     " frames apart, and this is not a multiple of 1/1000 of that");
  return {volume.file(before + grid.step), static_cast<std::uint32_t>(way / common),
          static_cast<std::uint32_t>(length / common), static_cast<std::uint32_t>(grid.step)};
}

/// Returns the time of a frame on the scene's clock, in seconds.
double seconds_of(const Moment& moment, const SceneSequence& sequence, const Grid& grid) {
  cumulet_playback_desc playback = sequence.playback;
  settings::spell_out_zeros(playback);
  const Moment first(sequence.first.value_or(grid.first));
  const double frames = static_cast<double>(moment.in_thousandths() - first.in_thousandths()) / 1000.0;
  return playback.offset_seconds + frames / (grid.step * playback.frames_per_second);
}

}  // namespace

std::optional<FramePlan> plan_frames(const RenderOptions& options) {
  std::optional<FramePattern> volume = volume_pattern(options);
  if (!volume) {
    if (options.overwrite) throw UsageError("--overwrite needs a sequence; a single image always replaces the file");
    if (!options.sequence_cache.empty())
      throw UsageError("--sequence-cache needs a sequence, but this is a single image");
    return std::nullopt;
  }
  if (options.info) throw UsageError("--info needs a single file, but '" + volume->text() + "' is a sequence");
  volume->adopt_padding();
  const std::vector<Frame> there = volume->frames_there();
  if (there.empty()) throw std::runtime_error(volume->text() + ": no matching file exists");
  std::vector<Moment> frames = options.frames;
  if (frames.empty() && options.scene.sequence.frame) frames = {*options.scene.sequence.frame};
  if (frames.empty()) frames.assign(there.begin(), there.end());
  const Written output("--output", options.output, frames);
  const Written stats("--stats", options.stats, frames);
  const Written checkpoint("--checkpoint", options.checkpoint, frames);

  const Grid grid(there);
  const bool moments = std::ranges::any_of(frames, &Moment::is_between);
  FramePlan plan;
  plan.passed_over = volume->passed_over();
  for (const Moment& frame : frames) {
    PlannedFrame& planned = plan.frames.emplace_back();
    planned.number = frame;
    // If the list contains fractional frames and the files are more than one frame apart, whole numbers between two
    // files are interpolated too.
    const Frame before = grid.before(frame.frame);
    const bool between = frame.is_between() || (moments && before != frame.frame);
    planned.volume = volume->file(between ? before : frame.frame);
    if (between) planned.next = next_of(frame, *volume, grid);
    planned.seconds = seconds_of(frame, options.scene.sequence, grid);
    planned.output = output.of(frame);
    planned.stats = stats.of(frame);
    planned.checkpoint = checkpoint.of(frame);
    if (same_file(planned.checkpoint, planned.output) || same_file(planned.checkpoint, planned.stats) ||
        same_file(planned.stats, planned.output)) {
      throw UsageError("frame " + frame.text() + ": --output, --stats and --checkpoint must be different files");
    }
  }
  std::vector<std::string> files;
  files.reserve(there.size());
  for (const Frame frame : there) files.push_back(volume->file(frame));
  plan.analyzed_by = by_size(files);
  return plan;
}

bool is_made(const std::string& output) {
  std::error_code error;
  return fs::is_regular_file(output, error) && fs::file_size(output, error) > 0 && !error;
}

std::string frame_line(const Moment& number, std::size_t position, std::size_t count, FrameState state,
                       const std::string& what) {
  const char* word = "failed";
  if (state == FrameState::done) word = "done";
  if (state == FrameState::kept) word = "kept";
  return one_line("frame " + number.text() + " (" + std::to_string(position) + " of " + std::to_string(count) + ") " +
                  word + " " + what);
}

}  // namespace cumulet::demo
