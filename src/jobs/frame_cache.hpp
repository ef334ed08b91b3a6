#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "assets/sequence.hpp"
#include "jobs/built.hpp"
#include "jobs/job_source.hpp"

namespace cumulet::viewer {

/// Steps of a sequence's frames, including interpolated ones.
struct FrameSteps {
  scene::Between between = scene::Between::none;
  std::uint32_t a_frame = 1;  ///< steps per frame; 1: no interpolation
  double seconds = 0.0;       ///< for velocities: from a frame to the next
  bool operator==(const FrameSteps&) const = default;

  /// Steps of a playback.
  static FrameSteps of(const scene::Playback& playback) {
    const bool moves = playback.between == scene::Between::advect;
    const double seconds = moves ? playback.velocity_scale / playback.frames_per_second : 0.0;
    return {playback.between, playback.steps, seconds};
  }
  /// Number of steps of this many frames; `frames` is at least 1.
  [[nodiscard]] std::size_t count(std::uint32_t frames) const { return own(frames - 1) + 1; }
  /// Step of the frame itself.
  [[nodiscard]] std::size_t own(std::uint32_t frame) const { return std::size_t{frame} * a_frame; }
  [[nodiscard]] std::uint32_t frame(std::uint32_t step) const { return step / a_frame; }
  [[nodiscard]] bool is_between(std::uint32_t step) const { return step % a_frame != 0; }
  /// Position between its frame and the next, 0 to less than 1.
  [[nodiscard]] double part(std::uint32_t step) const { return static_cast<double>(step % a_frame) / a_frame; }
  [[nodiscard]] double position(std::uint32_t step) const { return frame(step) + part(step); }
};

/// The steps that a FrameCache is to make.
struct FrameRequest {
  FrameFilesPtr files;
  std::vector<std::uint32_t> order;       ///< required steps without duplicates, the soonest first; at least one
  std::optional<BuildSettings> settings;  ///< nullopt: analyze the sequence, build nothing yet
  std::uint64_t memory_bytes = 0;         ///< main memory limit; the first step is kept at any limit
  FrameSteps steps = {};
  bool takes_suggested = true;  ///< apply the density scale suggested for the sequence, if its file asks for it
};

/// Asynchronous cache of a sequence's grids. Frames are read and built ahead on a worker thread, as many as fit a
/// memory limit, the soonest needed first. All calls are thread-safe; none waits for a frame except wait().
///
/// Interpolated steps between frames are cached too. A frame has `a_frame` steps: the first is the file's own, the
/// others are made from this file and the next. If an interpolated step cannot be made, the previous frame replaces it.
///
/// The sequence is analyzed first, with the largest readable file that is not empty. The result has the bounds for
/// cameras and ground, and one density scale for all frames, so that nothing jumps. A frame that cannot be read is
/// logged once and replaced by the nearest earlier readable frame, or else by the nearest later one.
class FrameCache : public JobSource {
 public:
  using Steps = FrameSteps;
  using Request = FrameRequest;

  /// Results of analyzing the whole sequence.
  struct AnalyzedFrame {
    VolumeInfoPtr volume_info;
    std::optional<double> density_scale;  ///< suggested for the sequence
  };

  struct Ready {
    std::uint32_t frame = 0;
    double part = 0.0;   ///< position between this frame and the next
    Built built;         ///< its volume is null if there was no memory for voxels
    bool wanted = true;  ///< final: the requested step or its replacement, with the requested settings
  };

  enum class State { waiting = 0, ready = 1, failed = 2 };
  struct Status {
    std::vector<State> frames;  ///< per file frame, without interpolated steps
    std::uint64_t bytes = 0;    ///< main memory of everything cached, including interpolated steps
  };

  explicit FrameCache(const JobContext& context);

  /// Replaces the request. Running frames are finished, so that with fast-changing requests every frame that was begun
  /// can be displayed. Other files: everything cached is dropped.
  void request(Request request);
  /// Removes the request and everything cached.
  void clear();
  /// Rebuilds all frames, also failed ones. The old ones are available until then.
  void rebuild() override;
  /// Ends running and queued work until the next request.
  void cancel() override;

  /// Returns the result of the analysis, once.
  std::optional<AnalyzedFrame> take_analyzed();
  /// Returns the cached data of the first requested step, or of the nearest step that has any.
  [[nodiscard]] std::optional<Ready> nearest() const;
  /// Returns nearest() to show it. After a final result nothing else is awaited until the next request.
  std::optional<Ready> take();
  [[nodiscard]] bool is_final_taken() const { return final_taken_; }
  /// Changes after each frame that was built or failed.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  [[nodiscard]] Status frames() const;
  /// Returns why a frame cannot be shown. Nullopt if it can, or if this is not known yet.
  [[nodiscard]] std::optional<Error> failure_of(std::uint32_t frame) const;

  /// True while the first requested step is being made, unless a final result was taken.
  [[nodiscard]] bool busy() const override;
  /// Status of the first requested step. failure: no frame can be shown, or no more frames are made.
  [[nodiscard]] Worker::Status status() const override;
  /// Waits until the first requested step is ready or cannot be made, or until the given time. Returns true unless the
  /// time ran out.
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const override;
  void set_awaited(bool awaited) override;

 private:
  struct Entry {
    std::optional<Built> built;    // without its volume
    VolumeAssetPtr volume;         // its source volume, if kept
    std::uint64_t grid_bytes = 0;  // set once it has been built
    std::uint64_t volume_bytes = 0;
    std::optional<Error> failure;
    bool stale = false;  // to be rebuilt even if its settings are unchanged
  };
  struct Which {
    FrameFilesPtr files;
    Steps steps;
    std::uint32_t step = 0;
  };
  // The two frames around an interpolated step, kept for the next step between them.
  struct Ends {
    FrameFilesPtr files;
    std::uint32_t frame = 0;
    VolumeAssetPtr before, after;
  };
  enum class Analysis { due, done, in_vain };

  [[nodiscard]] Worker::Job job();
  void work(Progress& progress);
  void analyze(const FrameFilesPtr& files, Progress& progress);
  void settle_temperature(const FrameFiles& files, const VolumeAsset& volume);
  void build(const Which& which, const BuildSettings& settings, std::optional<Ends>& ends, Progress& progress);
  // Returns the volume of a step. reading: receives the frame whose file is at fault on failure; nullopt for the
  // interpolation itself.
  VolumeAssetPtr read(const Which& which, std::optional<Ends>& ends, std::optional<std::uint32_t>& reading,
                      Progress& progress);
  // Returns the volume of a file frame, from the cache or the file.
  VolumeAssetPtr read_frame(const Which& which, std::uint32_t frame, Progress& progress);
  // Returns a log that drops messages already logged for another file of the sequence.
  [[nodiscard]] Log log_of(const std::string& path);
  // Records that a frame, or else the step, cannot be made. Returns false if it is no longer requested.
  bool fail(const Which& which, std::optional<std::uint32_t> frame, const Error& failure, const Progress& progress);
  void say_failures(std::span<const Error> failures, bool another_is_shown) const;
  void notify();

  // mutex_ must be held for all of these.
  void start();
  [[nodiscard]] bool is_requested(const FrameFilesPtr& files) const { return request_ && request_->files == files; }
  [[nodiscard]] bool is_requested(const Which& which) const {
    return is_requested(which.files) && request_->steps == which.steps;
  }
  // Entry of a file frame.
  [[nodiscard]] Entry& own(std::uint32_t frame) { return cache_[request_->steps.own(frame)]; }
  [[nodiscard]] const Entry& own(std::uint32_t frame) const { return cache_[request_->steps.own(frame)]; }
  [[nodiscard]] bool is_possible(std::uint32_t step) const;
  // Changes the cache to other steps; entries of file frames are kept. The caller must free the result without the
  // lock.
  [[nodiscard]] std::vector<Entry> take_other_steps(const Steps& steps);
  [[nodiscard]] bool is_ready(const Entry& entry) const;
  [[nodiscard]] bool is_analyzed() const { return analysis_ != Analysis::due; }
  // Must be called when the set of possible steps has changed.
  void find_substitutes();
  [[nodiscard]] std::optional<std::uint32_t> first() const { return substitutes_[request_->order.front()]; }
  // Returns the steps to keep: as many as the memory holds, by their known or estimated sizes.
  [[nodiscard]] std::vector<std::uint32_t> kept() const;
  [[nodiscard]] std::optional<std::uint32_t> next() const;
  [[nodiscard]] bool waits() const;
  // Evicts entries that do not fit: voxels first, then grids, the least needed first. The caller must free the result
  // without the lock.
  [[nodiscard]] std::vector<Entry> take_excess();

  Log log_;
  std::function<void()> notify_;
  Trace trace_;
  ResourceLimitsPtr resource_limits_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::optional<Request> request_;
  std::vector<Entry> cache_;  // one per step
  // Per step: the step that is shown for it. It is the step itself if possible, else a fallback frame; nullopt if no
  // frame can be shown.
  std::vector<std::optional<std::uint32_t>> substitutes_;
  Analysis analysis_ = Analysis::due;
  std::optional<AnalyzedFrame> analyzed_;  // not taken yet
  // VolumeFrame::temperature_scale of all frames, from the first frame with a temperature that is read. The largest
  // file is read first.
  std::optional<double> temperature_scale_;
  std::set<std::string> said_;  // logged messages, without file names
  bool cancelled_ = false;      // until the next request
  bool awaited_ = true;         // see set_awaited()
  std::atomic<std::uint64_t> revision_ = 0;
  std::atomic<bool> final_taken_ = false;  // since the last request
  Worker worker_;                          // last: its thread uses all of the above
};

}  // namespace cumulet::viewer
