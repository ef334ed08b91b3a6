#include "base/library_thread.hpp"

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

#include "base/callback_scope.hpp"
#include "base/error.hpp"
#include "base/never_destroyed.hpp"

namespace cumulet {

struct LibraryThread::Entry {
  explicit Entry(std::function<void()> stop) : request_stop(std::move(stop)), stoppable(request_stop != nullptr) {}

  pid_t process = getpid();
  std::atomic<bool> ended = false;
  std::mutex mutex;
  std::function<void()> request_stop;  // null once the owner is about to go
  std::thread thread;                  // moved out by who joins it
  const bool stoppable;
};

namespace {

using Clock = std::chrono::steady_clock;
using EntryPtr = std::shared_ptr<LibraryThread::Entry>;

// How long the end of the process waits for what may itself wait for the thread that exits.
constexpr std::chrono::seconds patience{10};
constexpr std::chrono::seconds patience_in_callback{1};
constexpr std::chrono::milliseconds poll{1};

// What this thread has under way.
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

// A thread cannot join itself: a callback on it has called exit().
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
        // However it ends: a host's callback may end the thread itself, as Python's do.
        struct End {
          LibraryThread::Entry& entry;
          ~End() { entry.ended = true; }
        } const end{*entry};
        work();
        work = nullptr;  // what it owns may take long to free
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
      if (entry->process != getpid() || entry->thread.get_id() == std::this_thread::get_id()) return true;
      if (entry->request_stop) entry->request_stop();
      return false;
    });
    for (const EntryPtr& entry : all) sleep_until_ended(*entry, entry->stoppable ? until : Clock::time_point::max());
    while (calls_ > own.calls && Clock::now() < until) std::this_thread::sleep_for(poll);
    for (const EntryPtr& entry : all) {
      if (entry->ended) join(*entry);
    }
  }

  [[nodiscard]] bool ending() const { return ending_; }
  [[nodiscard]] std::atomic<int>& calls() { return calls_; }
  [[nodiscard]] std::uint64_t count(StaticsOf of) { return ++kept_.at(static_cast<std::size_t>(of)); }

 private:
  // In a forked child: what the parent's other threads do is not done here.
  void forget_parent() {
    const pid_t before = process_.exchange(getpid());
    if (before != 0 && before != getpid()) calls_ = of_thread().calls;
  }

  std::mutex mutex_;
  std::list<EntryPtr> entries_;
  std::atomic<pid_t> process_ = 0;  // that has started a thread
  std::atomic<bool> ending_ = false;
  std::atomic<int> calls_ = 0;
  std::array<std::atomic<std::uint64_t>, 3> kept_{};  // by StaticsOf
};

Registry& registry() {
  static const NeverDestroyed<Registry> only;
  return only.get();
}

void end_threads() { registry().end(); }

void end_call() {
  --of_thread().calls;
  --registry().calls();
}

}  // namespace

bool process_is_ending() { return registry().ending(); }

void keep_statics(StaticsOf of) noexcept {
  // The first, second, fourth, eighth ... time: handlers cannot be taken back, and hosts may run for ever.
  if (!std::has_single_bit(registry().count(of))) return;
  // Where there is no memory for another, those before serve.
  static_cast<void>(std::atexit(end_threads));
}

LibraryThread::LibraryThread(std::function<void()> work, std::function<void()> request_stop)
    : entry_(std::make_shared<Entry>(std::move(request_stop))) {
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

HostCall::HostCall() {
  OfThread& own = of_thread();
  ++own.calls;
  ++registry().calls();
  // After it is counted: the end of the process sees the call, or the call sees the end.
  refused_ = registry().ending() && !own.ends_process;
  if (refused_) end_call();
}

HostCall::~HostCall() {
  if (!refused_) end_call();
}

}  // namespace cumulet
