#include "base/library_thread.hpp"

#include <tbb/task_group.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <list>
#include <mutex>
#include <thread>
#include <utility>

#include "base/error.hpp"
#include "base/never_destroyed.hpp"
#include "base/process_shared.hpp"

namespace cumulet {

struct LibraryThread::Entry {
  explicit Entry(std::function<void()> stop) : request_stop(std::move(stop)), stoppable(request_stop != nullptr) {}

  pid_t process = getpid();
  std::atomic<bool> ended = false;
  std::mutex mutex;
  std::function<void()> request_stop;  // null once the owner is being destroyed
  std::thread thread;                  // moved out by the thread that joins it
  const bool stoppable;
};

namespace {

using Clock = std::chrono::steady_clock;
using EntryPtr = std::shared_ptr<LibraryThread::Entry>;

// Time that process exit waits for threads and calls that may themselves wait for the exiting thread.
constexpr std::chrono::seconds patience{10};
constexpr std::chrono::seconds patience_in_callback{1};
constexpr std::chrono::milliseconds poll{1};

// State of the calling thread.
struct OfThread {
  int calls = 0;
  bool ends_process = false;
};
OfThread& of_thread() {
  static thread_local OfThread own;
  return own;
}

void sleep_until_ended(const LibraryThread::Entry& entry, Clock::time_point until) {
  while (!entry.ended && Clock::now() < until) std::this_thread::sleep_for(poll);
}

// Joins the thread. It cannot join itself, which happens if a callback on it has called exit(); it is then detached.
void join(LibraryThread::Entry& entry) {
  std::thread thread;
  {
    const std::scoped_lock lock(entry.mutex);
    std::swap(thread, entry.thread);
  }
  if (!thread.joinable()) {
    sleep_until_ended(entry, Clock::time_point::max());  // another thread joins it
  } else if (thread.get_id() == std::this_thread::get_id()) {
    thread.detach();
  } else {
    thread.join();
  }
}

class Registry {
 public:
  void start(const EntryPtr& entry, std::function<void()> work) {
    const std::scoped_lock lock(mutex_);
    if (ending_) throw Error(ErrorCode::cancelled, "the process is exiting");
    forget_parent();
    entries_.push_back(entry);
    try {
      entry->thread = std::thread([entry, work = std::move(work)]() mutable {
        // Set even if a callback of the host ends the thread itself, as Python's do.
        struct End {
          LibraryThread::Entry& entry;
          ~End() { entry.ended = true; }
        } const end{*entry};
        work();
        work = nullptr;  // destroyed before `ended` is set: its captures may take long to free
      });
    } catch (...) {
      entries_.pop_back();
      throw;
    }
  }

  void forget(const EntryPtr& entry) {
    const std::scoped_lock lock(mutex_);
    entries_.remove(entry);
  }

  void end() {
    if (process_ != getpid()) return;  // a forked child has none of the threads, and may never get the mutex
    std::list<EntryPtr> all;
    {
      const std::scoped_lock lock(mutex_);
      ending_ = true;
      all = entries_;
    }
    OfThread& own = of_thread();
    own.ends_process = true;
    const auto until = Clock::now() + (CallbackScope::inside() ? patience_in_callback : patience);
    std::erase_if(all, [](const EntryPtr& entry) {
      const std::scoped_lock lock(entry->mutex);
      if (entry->process != getpid()) return true;
      // Also on this thread itself, whose callback may have called exit(): other threads may wait for its work.
      if (entry->request_stop) entry->request_stop();
      return entry->thread.get_id() == std::this_thread::get_id();
    });
    for (const EntryPtr& entry : all) sleep_until_ended(*entry, entry->stoppable ? until : Clock::time_point::max());
    while (calls_ > own.calls && Clock::now() < until) std::this_thread::sleep_for(poll);
    for (const EntryPtr& entry : all) {
      if (entry->ended) join(*entry);
    }
  }

  [[nodiscard]] std::shared_ptr<void> shared(const std::function<std::shared_ptr<void>()>& make) {
    const std::scoped_lock lock(mutex_);
    std::shared_ptr<void> found = shared_process_ == getpid() ? shared_.lock() : nullptr;
    if (found) return found;
    found = make();
    shared_ = found;
    shared_process_ = getpid();
    return found;
  }

  [[nodiscard]] bool ending() const { return ending_; }
  [[nodiscard]] std::atomic<int>& calls() { return calls_; }
  [[nodiscard]] std::uint64_t count(StaticsOf of) { return ++kept_.at(static_cast<std::size_t>(of)); }

 private:
  // In a forked child, forgets the calls that the other threads of the parent had under way.
  void forget_parent() {
    const pid_t before = process_.exchange(getpid());
    if (before != 0 && before != getpid()) calls_ = of_thread().calls;
  }

  std::mutex mutex_;
  std::list<EntryPtr> entries_;
  std::weak_ptr<void> shared_;
  pid_t shared_process_ = 0;        // the process that made it
  std::atomic<pid_t> process_ = 0;  // the process that last started a thread
  std::atomic<bool> ending_ = false;
  std::atomic<int> calls_ = 0;
  std::array<std::atomic<std::uint64_t>, 3> kept_{};  // by StaticsOf
};

Registry& registry() {
  static const NeverDestroyed<Registry> only;
  return only.get();
}

void end_threads() { registry().end(); }

// TBB loads libraries (its allocator, for one) when it first runs a task. A thread of the library that did so during
// dlclose() would wait for the loader's lock, which dlclose() holds while it waits for that thread. TBB therefore loads
// them before the first thread starts. The thread that runs this task keeps no data of TBB, unlike the host's.
void load_libraries_of_tbb() {
  static std::once_flag once;
  std::call_once(once, [] {
    std::thread([] {
      tbb::task_group tasks;
      tasks.run([] {});
      tasks.wait();
    }).join();
  });
}

void end_call() {
  --of_thread().calls;
  --registry().calls();
}

}  // namespace

bool process_is_ending() { return registry().ending(); }

void keep_statics(StaticsOf of) noexcept {
  // Registers at the first, second, fourth, eighth ... call: handlers cannot be removed, and hosts may run forever.
  if (!std::has_single_bit(registry().count(of))) return;
  // If there is no memory for another handler, the earlier handlers still run.
  static_cast<void>(std::atexit(end_threads));
}

LibraryThread::LibraryThread(std::function<void()> work, std::function<void()> request_stop)
    : entry_(std::make_shared<Entry>(std::move(request_stop))) {
  load_libraries_of_tbb();
  keep_statics(StaticsOf::thread);
  registry().start(entry_, std::move(work));
}

LibraryThread::~LibraryThread() {
  if (entry_->process != getpid()) return;
  {
    const std::scoped_lock lock(entry_->mutex);
    entry_->request_stop = nullptr;
  }
  join(*entry_);
  registry().forget(entry_);
}

bool LibraryThread::ended() const { return entry_->ended; }

std::shared_ptr<void> shared_in_process(const std::function<std::shared_ptr<void>()>& make) {
  return registry().shared(make);
}

HostCall::HostCall() {
  OfThread& own = of_thread();
  ++own.calls;
  ++registry().calls();
  // Checked after counting: either the exiting thread sees this call, or this call sees the exit.
  refused_ = registry().ending() && !own.ends_process;
  if (refused_) end_call();
}

HostCall::~HostCall() {
  if (!refused_) end_call();
}

}  // namespace cumulet
