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

#include "viewer/sequence.hpp"

namespace cumulet::viewer {

/// Grids of a sequence's frames, read and built ahead on a thread of its own, as many as fit a memory: those that come
/// soonest. All calls are safe from any thread; none waits for a frame but wait().
///
/// What there is between two frames is of the shelf, too: a frame has so many steps, of which the first is the file's
/// own, and the others are made of both files. Where one of these cannot be, the frame before stands in.
///
/// First it judges the sequence by the largest file that can be read and shows something: what cameras and grounds go
/// by, and the density scale that all frames have, so that nothing jumps. Frames that cannot be read are told once, and
/// the nearest earlier one that can stands in for them; without one, the nearest later.
class FrameShelf {
 public:
  struct Steps {
    scene::Between between = scene::Between::none;
    std::uint32_t a_frame = 1;  ///< 1 where there is nothing between
    double seconds = 0.0;       ///< from a frame to the next, of their velocities
    bool operator==(const Steps&) const = default;

    /// Of a playback.
    static Steps of(const scene::Playback& playback) {
      const bool moves = playback.between == scene::Between::advect;
      const double seconds = moves ? playback.velocity_scale / playback.frames_per_second : 0.0;
      return {playback.between, playback.steps, seconds};
    }
    /// Of so many frames, one at least.
    [[nodiscard]] std::size_t count(std::uint32_t frames) const { return own(frames - 1) + 1; }
    /// A frame's own.
    [[nodiscard]] std::size_t own(std::uint32_t frame) const { return std::size_t{frame} * a_frame; }
    [[nodiscard]] std::uint32_t frame(std::uint32_t step) const { return step / a_frame; }
    [[nodiscard]] bool is_between(std::uint32_t step) const { return step % a_frame != 0; }
    /// How far it is from its frame to the next.
    [[nodiscard]] double part(std::uint32_t step) const { return static_cast<double>(step % a_frame) / a_frame; }
    [[nodiscard]] double position(std::uint32_t step) const { return frame(step) + part(step); }
  };
  struct Wish {
    FrameFilesPtr files;
    std::vector<std::uint32_t> order;       ///< steps that are needed, the soonest first; one at least, each once
    std::optional<BuildSettings> settings;  ///< none yet: the sequence is judged, and nothing is built
    std::uint64_t memory_bytes = 0;         ///< of main memory; the first is there at any
    Steps steps = {};
    bool takes_suggested = true;  ///< the density scale that suits the sequence, where its file asks for that
  };

  /// What the whole sequence goes by.
  struct Judged {
    VolumeFactsPtr facts;
    std::optional<double> density_scale;  ///< that suits it
  };

  struct Ready {
    std::uint32_t frame = 0;
    double part = 0.0;   ///< of the way to the next
    Built built;         ///< its volume is null where there was no memory for voxels
    bool wanted = true;  ///< nothing better comes: it is the step, or stands in for it, as it is to be
  };

  enum class State { waiting = 0, ready = 1, failed = 2 };
  struct Status {
    std::vector<State> frames;  ///< of files' own
    std::uint64_t bytes = 0;    ///< main memory of what is ready, between them, too
  };

  /// notify: called on a worker after each frame, and when a job ended.
  FrameShelf(Log log, std::function<void()> notify, Trace trace = {},
             AllowancePtr allowance = std::make_shared<const Allowance>());

  /// In place of the wish before. Frames under way are finished, so that of wishes that change faster than frames are
  /// built every one that is begun can be seen. Other files: all that there was goes.
  void wish(Wish wish);
  /// Nothing is wished for any more.
  void clear();
  /// All are read and built anew, those that failed, too; until they are, there are those before.
  void rebuild();
  /// Ends what is under way, and what waits, until the next wish.
  void cancel();

  /// What is known of the sequence, once.
  std::optional<Judged> take_judged();
  /// What there is of the first step that is wished for, or of the nearest one of which there is something.
  [[nodiscard]] std::optional<Ready> nearest() const;
  /// Another after each frame that was built, or failed.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  [[nodiscard]] Status frames() const;
  /// Why a frame cannot be shown; nothing where it can be, or that is not known yet.
  [[nodiscard]] std::optional<Error> failure_of(std::uint32_t frame) const;

  /// Whether the first frame that is wished for is under way.
  [[nodiscard]] bool busy() const;
  /// Of the first frame; failed: no frame can be shown, or no more are made.
  [[nodiscard]] Worker::Status status() const;
  /// Until the first frame is there, or none can be. Returns whether it is so.
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const;

 private:
  struct Shelved {
    std::optional<Built> built;    // without its volume
    VolumeAssetPtr volume;         // that it was built of, or is to be
    std::uint64_t grid_bytes = 0;  // known once it was built
    std::uint64_t volume_bytes = 0;
    std::optional<Error> failure;
    bool stale = false;  // to be built anew, whatever its settings
  };
  struct Which {
    FrameFilesPtr files;
    Steps steps;
    std::uint32_t step = 0;
  };
  // Of a step between two frames: theirs, kept for the next one between the same.
  struct Ends {
    FrameFilesPtr files;
    std::uint32_t frame = 0;
    VolumeAssetPtr before, after;
  };
  enum class Judging { due, done, in_vain };

  void work(Progress& progress);
  void judge(const FrameFilesPtr& files, Progress& progress);
  void settle_temperature(const FrameFiles& files, const VolumeAsset& volume);
  void build(const Which& which, const BuildSettings& settings, std::optional<Ends>& ends, Progress& progress);
  // What a step shows. reading: whose file is at fault where it fails; none: what is between two.
  VolumeAssetPtr read(const Which& which, std::optional<Ends>& ends, std::optional<std::uint32_t>& reading,
                      Progress& progress);
  // What a frame's own step shows, from the shelf or the file.
  VolumeAssetPtr read_frame(const Which& which, std::uint32_t frame, Progress& progress);
  // That tells once a sequence what it is told of each file.
  [[nodiscard]] Log log_of(const std::string& path);
  // Keeps that a frame, or else the step, cannot be made. False where that is no longer asked for.
  bool fail(const Which& which, std::optional<std::uint32_t> frame, const Error& failure, const Progress& progress);
  void say_failures(std::span<const Error> failures, bool another_is_shown) const;
  void tell();

  // All of these under the lock.
  void start();
  [[nodiscard]] bool is_wished(const FrameFilesPtr& files) const { return wish_ && wish_->files == files; }
  [[nodiscard]] bool is_wished(const Which& which) const {
    return is_wished(which.files) && wish_->steps == which.steps;
  }
  // Of a frame's own.
  [[nodiscard]] Shelved& own(std::uint32_t frame) { return shelf_[wish_->steps.own(frame)]; }
  [[nodiscard]] const Shelved& own(std::uint32_t frame) const { return shelf_[wish_->steps.own(frame)]; }
  [[nodiscard]] bool is_possible(std::uint32_t step) const;
  // The shelf of other steps: what is files' own stays. What is returned is to be freed without the lock.
  [[nodiscard]] std::vector<Shelved> take_other_steps(const Steps& steps);
  [[nodiscard]] bool is_ready(const Shelved& shelved) const;
  [[nodiscard]] bool is_judged() const { return judging_ != Judging::due; }
  // Once other steps are possible than before.
  void find_stand_ins();
  [[nodiscard]] std::optional<std::uint32_t> first() const { return stand_ins_[wish_->order.front()]; }
  // Steps that are to be there: as many as the memory holds, by what they are known or likely to take.
  [[nodiscard]] std::vector<std::uint32_t> kept() const;
  [[nodiscard]] std::optional<std::uint32_t> next() const;
  [[nodiscard]] bool waits() const;
  // Gives up what does not fit: voxels first, then frames, the least needed first. What is returned is for its owner to
  // free without the lock.
  [[nodiscard]] std::vector<Shelved> take_excess();

  Log log_;
  std::function<void()> notify_;
  Trace trace_;
  AllowancePtr allowance_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::optional<Wish> wish_;
  std::vector<Shelved> shelf_;  // one a step
  // Of each step the one that is shown for it: itself unless it cannot be; nothing if no frame can.
  std::vector<std::optional<std::uint32_t>> stand_ins_;
  Judging judging_ = Judging::due;
  std::optional<Judged> judged_;  // that nobody took
  // VolumeFrame::temperature_scale of all frames, once one with a temperature was read: the largest, unless it has
  // none.
  std::optional<double> temperature_scale_;
  std::set<std::string> said_;  // by the log, but for files' names
  bool cancelled_ = false;      // until the next wish
  std::atomic<std::uint64_t> revision_ = 0;
  Worker worker_;  // last: its thread uses all of the above
};

}  // namespace cumulet::viewer
