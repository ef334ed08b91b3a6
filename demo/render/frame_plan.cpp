#include "frame_plan.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <frame_pattern.hpp>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace cumulet::demo {
namespace {

namespace fs = std::filesystem;

/// The volume's; nothing where one file is meant, whatever its name.
std::optional<FramePattern> volume_pattern(const RenderOptions& options) {
  const std::string& volume = options.scene.volume;
  if (options.frames.empty()) {
    std::error_code error;
    if (volume.empty() || fs::exists(volume, error)) return std::nullopt;
    return FramePattern::parse(volume);
  }
  if (volume.empty()) throw UsageError("--frames counts volumes, and the scene has none");
  if (auto pattern = FramePattern::parse(volume)) return pattern;
  if (auto pattern = FramePattern::of_file(volume)) return pattern;
  throw UsageError("--frames: the name '" + volume + "' has neither a number nor a place for one, such as ####");
}

/// A file to write in each frame.
class Written {
 public:
  Written(const char* flag, const std::string& name, std::size_t count) : name_(name) {
    try {
      pattern_ = FramePattern::parse(name);
    } catch (const UsageError& error) {
      throw UsageError(std::string(flag) + ": " + error.what());
    }
    if (count > 1 && !name.empty() && !pattern_) {
      const fs::path path(name);
      throw UsageError(std::string(flag) + ": the name '" + name + "' is that of " + std::to_string(count) +
                       " frames, and needs a place for their numbers, such as " + path.stem().string() + ".####" +
                       path.extension().string());
    }
  }
  [[nodiscard]] std::string of(Frame frame) const { return pattern_ ? pattern_->file(frame) : name_; }

 private:
  std::string name_;
  std::optional<FramePattern> pattern_;
};

}  // namespace

std::optional<FramePlan> plan_frames(const RenderOptions& options) {
  const std::optional<FramePattern> volume = volume_pattern(options);
  if (!volume) {
    if (options.overwrite) throw UsageError("--overwrite is of a sequence: one picture replaces what is there");
    if (!options.settled.empty()) throw UsageError("--settled is of a sequence, and this is one picture");
    return std::nullopt;
  }
  if (options.info) throw UsageError("--info is of one file, and '" + volume->text() + "' are many");
  const std::vector<Frame> there = volume->frames_there();
  if (there.empty()) throw std::runtime_error(volume->text() + ": no file of such a name is there");
  std::vector<Frame> frames = options.frames;
  if (frames.empty() && options.scene.sequence.frame) frames = {*options.scene.sequence.frame};
  if (frames.empty()) frames = there;
  const Written output("--output", options.output, frames.size());
  const Written stats("--stats", options.stats, frames.size());
  const Written checkpoint("--checkpoint", options.checkpoint, frames.size());

  FramePlan plan;
  for (const Frame frame : frames) {
    plan.frames.push_back({frame, volume->file(frame), output.of(frame), stats.of(frame), checkpoint.of(frame)});
    const PlannedFrame& planned = plan.frames.back();
    if (same_file(planned.checkpoint, planned.output) || same_file(planned.checkpoint, planned.stats) ||
        same_file(planned.stats, planned.output)) {
      throw UsageError("frame " + std::to_string(frame) +
                       ": --output, --stats and --checkpoint shall be files of their own");
    }
  }
  std::vector<std::pair<std::uintmax_t, std::string>> sized;
  for (const Frame frame : there) {
    std::string file = volume->file(frame);
    std::error_code error;
    const std::uintmax_t size = fs::file_size(file, error);
    sized.emplace_back(error ? 0 : size, std::move(file));
  }
  std::ranges::stable_sort(sized, [](const auto& a, const auto& b) { return a.first > b.first; });
  for (auto& [size, file] : sized) plan.judged_by.push_back(std::move(file));
  return plan;
}

bool is_made(const std::string& output) {
  std::error_code error;
  return fs::is_regular_file(output, error) && fs::file_size(output, error) > 0 && !error;
}

std::string frame_line(Frame number, std::size_t place, std::size_t count, FrameState state, const std::string& what) {
  const char* word = "failed";
  if (state == FrameState::done) word = "done";
  if (state == FrameState::kept) word = "kept";
  return one_line("frame " + std::to_string(number) + " (" + std::to_string(place) + " of " + std::to_string(count) +
                  ") " + word + " " + what);
}

}  // namespace cumulet::demo
