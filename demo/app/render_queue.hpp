#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "picture_job.hpp"
#include "render_entry.hpp"
#include "time_left.hpp"

namespace cumulet::demo {

/// Thrown out of a job that the user has canceled.
struct PictureCancelled {};

/// The connection of a running job to the queue.
struct PictureWatch {
  std::function<bool()> cancelled;
  /// part: completed fraction; text: current work.
  std::function<void(double part, const std::string& text)> report;
};

/// Renders a job and returns a line about the result. Throws std::exception with the cause, or PictureCancelled.
using RenderJob = std::function<std::string(const PictureJob& job, const PictureWatch& watch)>;

/// Jobs that one thread carries out, one after the other. All functions from one thread.
class RenderQueue {
 public:
  /// render: called from the queue's thread. wake: called from that thread when an entry has changed.
  RenderQueue(RenderJob render, std::function<void()> wake) : render_(std::move(render)), wake_(std::move(wake)) {}
  RenderQueue(const RenderQueue&) = delete;
  RenderQueue& operator=(const RenderQueue&) = delete;
  /// Cancels all jobs and waits for the running one.
  ~RenderQueue();

  void add(PictureJob job);
  /// Cancels a job. One that has ended stays as it is.
  void cancel(std::uint64_t number);
  /// Removes the ended entries.
  void clear();
  [[nodiscard]] std::vector<RenderEntry> entries() const;
  /// Returns the entries that have ended since the last call.
  [[nodiscard]] std::vector<RenderEntry> take_ended();
  /// Returns the number of jobs that have not ended.
  [[nodiscard]] std::size_t unfinished() const;

 private:
  struct Job {
    RenderEntry entry;
    PictureJob picture;
    bool taken = false;  // take_ended() has returned it
  };

  void work();
  void carry_out(std::uint64_t number, const PictureJob& picture);
  void report(std::uint64_t number, double part, const std::string& text);
  void end(std::uint64_t number, RenderEntry::State state, const std::string& text);
  // Returns the job with this number; null if there is none. Call under the lock.
  [[nodiscard]] Job* find(std::uint64_t number);

  RenderJob render_;
  std::function<void()> wake_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Job> jobs_;
  std::uint64_t last_number_ = 0;
  std::optional<std::uint64_t> stopping_;  // number of the running job that is canceled
  bool stop_ = false;
  TimeLeft time_left_;     // of the running job
  double woken_at_ = 0.0;  // time of the last wake by a report
  std::thread thread_;     // started with the first job
};

}  // namespace cumulet::demo
