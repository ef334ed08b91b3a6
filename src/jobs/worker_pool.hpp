#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "base/library_thread.hpp"

namespace cumulet::viewer {

/// The threads on which the workers of all viewers run. Their number depends on the machine and not on the number of
/// viewers. A thread starts when there is work, and ends after a second without work. All calls are thread-safe.
///
/// A thread inside a callback of the host does not count (InCallback), because the callback may wait for work that is
/// still queued: another thread starts instead.
class WorkerPool {
 public:
  /// Marks the calling thread, which need not be of a pool, as being inside a callback of the host.
  class InCallback {
   public:
    InCallback();
    ~InCallback();
    InCallback(const InCallback&) = delete;
    InCallback& operator=(const InCallback&) = delete;

   private:
    WorkerPool* pool_;  // null: the mark is not needed
  };

  class Task {
   public:
    /// work: the function that the pool runs. stop: makes it return soon. It is called on any thread when the process
    /// ends.
    Task(std::function<void()> work, std::function<void()> stop) : work_(std::move(work)), stop_(std::move(stop)) {}
    void work() const { work_(); }
    void stop() const {
      const std::scoped_lock lock(mutex_);
      if (stop_) stop_();
    }
    /// After this call, stop() does nothing.
    void forget_stop() {
      const std::scoped_lock lock(mutex_);
      stop_ = nullptr;
    }

   private:
    std::function<void()> work_;
    mutable std::mutex mutex_;
    std::function<void()> stop_;
  };
  using TaskPtr = std::shared_ptr<Task>;

  /// Returns the pool of this process, which exists while somebody holds it. A forked child gets another one.
  static std::shared_ptr<WorkerPool> of_process();
  /// Maximum number of threads of that pool. All workers of one viewer can work at the same time.
  static std::size_t max_threads();
  explicit WorkerPool(std::size_t max) : max_(max) {}
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  /// Ends its threads. No task may be left.
  ~WorkerPool();

  /// Runs the task, after earlier ones if all threads are busy. A task must not wait for another one that may not have
  /// begun. Throws std::system_error if no thread can be created, and Error(cancelled) if the process is ending; the
  /// task then does not run.
  void run(const TaskPtr& task);
  /// Returns true if the task was queued and will not run.
  bool remove(const TaskPtr& task);
  /// Whether tasks wait for a thread. A long task should then make way, and run again later.
  [[nodiscard]] bool is_contended() const;

 private:
  // The pool of the calling thread, unless it is inside a callback.
  static WorkerPool*& of_thread();
  void work();
  // Waits for a task, and takes it. Null: the thread is to end.
  TaskPtr next();
  void note_end(const TaskPtr& task);
  // Ends all tasks and threads soon.
  void stop();
  // mutex_ must be held for these.
  [[nodiscard]] bool needs_thread() const { return queue_.size() > idle_ && alive_ < max_ + in_callbacks_; }
  void start_thread();

  const std::size_t max_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<TaskPtr> queue_;
  std::vector<TaskPtr> running_;
  std::size_t alive_ = 0;         // threads that will look at the queue again
  std::size_t idle_ = 0;          // those of them that wait
  std::size_t in_callbacks_ = 0;  // those of them that are in a callback of the host
  bool stopping_ = false;
  std::list<LibraryThread> threads_;  // last: they use all of the above
};

}  // namespace cumulet::viewer
