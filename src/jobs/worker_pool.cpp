#include "jobs/worker_pool.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <iterator>
#include <thread>

#include "base/error.hpp"
#include "base/process_shared.hpp"

namespace cumulet::viewer {

namespace {

constexpr std::chrono::seconds patience{1};
constexpr std::size_t workers_of_viewer = 8;

}  // namespace

std::size_t WorkerPool::max_threads() {
  return std::max<std::size_t>(workers_of_viewer, 2 * std::size_t{std::thread::hardware_concurrency()});
}

std::shared_ptr<WorkerPool> WorkerPool::of_process() {
  return std::static_pointer_cast<WorkerPool>(
      shared_in_process([] { return std::make_shared<WorkerPool>(max_threads()); }));
}

WorkerPool*& WorkerPool::of_thread() {
  static thread_local WorkerPool* pool = nullptr;
  return pool;
}

WorkerPool::InCallback::InCallback() : pool_(std::exchange(of_thread(), nullptr)) {
  if (pool_ == nullptr) return;
  const std::scoped_lock lock(pool_->mutex_);
  ++pool_->in_callbacks_;
  if (!pool_->needs_thread()) return;
  try {
    pool_->start_thread();
  } catch (const std::exception&) {  // queued tasks wait for another thread
  }
}

WorkerPool::InCallback::~InCallback() {
  if (pool_ == nullptr) return;
  of_thread() = pool_;
  const std::scoped_lock lock(pool_->mutex_);
  --pool_->in_callbacks_;
}

WorkerPool::~WorkerPool() { stop(); }

void WorkerPool::start_thread() {
  threads_.emplace_back([this] { work(); }, [this] { stop(); });
  ++alive_;
}

void WorkerPool::run(const TaskPtr& task) {
  std::list<LibraryThread> ended;  // joined after the lock is released
  {
    const std::scoped_lock lock(mutex_);
    for (auto thread = threads_.begin(); thread != threads_.end();) {
      const auto next = std::next(thread);
      if (thread->ended()) ended.splice(ended.end(), threads_, thread);
      thread = next;
    }
    if (stopping_) throw Error(ErrorCode::cancelled, "the process is exiting");
    queue_.push_back(task);
    if (needs_thread()) {
      try {
        start_thread();
      } catch (...) {
        if (alive_ == 0 || process_is_ending()) {
          queue_.pop_back();
          throw;
        }
      }
    }
  }
  changed_.notify_one();
}

bool WorkerPool::remove(const TaskPtr& task) {
  const std::scoped_lock lock(mutex_);
  return std::erase(queue_, task) > 0;
}

bool WorkerPool::is_contended() const {
  const std::scoped_lock lock(mutex_);
  return queue_.size() > idle_;
}

void WorkerPool::stop() {
  std::vector<TaskPtr> tasks;
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
    tasks = running_;
    tasks.insert(tasks.end(), queue_.begin(), queue_.end());
  }
  changed_.notify_all();
  for (const TaskPtr& task : tasks) task->stop();
}

WorkerPool::TaskPtr WorkerPool::next() {
  std::unique_lock lock(mutex_);
  ++idle_;
  changed_.wait_for(lock, patience, [this] { return stopping_ || !queue_.empty(); });
  --idle_;
  // There are too many threads after callbacks have returned.
  if (queue_.empty() || alive_ > max_ + in_callbacks_) {
    --alive_;
    if (!queue_.empty()) changed_.notify_one();
    return nullptr;
  }
  // Also after stop(): each task ends soon.
  TaskPtr task = queue_.front();
  queue_.pop_front();
  running_.push_back(task);
  return task;
}

void WorkerPool::note_end(const TaskPtr& task) {
  const std::scoped_lock lock(mutex_);
  // One of them: the task may be running again already.
  running_.erase(std::ranges::find(running_, task));
}

void WorkerPool::work() {
  of_thread() = this;
  // A callback of the host may end the thread, as Python's do.
  struct End {
    WorkerPool& pool;
    TaskPtr task;
    ~End() {
      if (!task) return;
      pool.note_end(task);
      const std::scoped_lock lock(pool.mutex_);
      --pool.alive_;
    }
  } end{*this, nullptr};
  while ((end.task = next())) {
    end.task->work();
    note_end(end.task);
  }
}

}  // namespace cumulet::viewer
