#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "jobs/job_source.hpp"
#include "jobs/worker.hpp"

namespace cumulet::viewer {

/// Asynchronous cache: makes one value per request on a worker thread, one after another, and keeps it while it is
/// requested. All calls are thread-safe.
template <class RequestOf, class Made>
class RequestCache : public JobSource {
 public:
  using Request = RequestOf;
  using Make = std::function<Made(const Request&, Progress&)>;

  /// what, stage: description of the work in failures and in Worker::status().
  RequestCache(const char* what, Progress::Stage stage, Make make, const JobContext& context)
      : JobSource(context),
        what_(what),
        stage_(stage),
        make_(std::move(make)),
        notify_(context.notify),
        resource_limits_(context.resource_limits),
        worker_(context.notify, context.trace) {}

  /// Replaces all requests. Running work is finished and its value kept until the next call, so that with fast-changing
  /// requests every value that was begun can be displayed. Failed requests are not retried.
  void request(std::vector<Request> requests);
  /// Returns the value of a request; nullopt if it is not made yet or failed. O(requests).
  [[nodiscard]] std::optional<Made> built(const Request& request) const;
  [[nodiscard]] bool is_under_way(const Request& request) const;
  /// Failed requests are retried with the next call of request().
  void rebuild() override;
  /// Changes after each value that was made.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  /// Ends running and queued work with ErrorCode::cancelled.
  void cancel() override {
    log_call(what_, "cancel");
    worker_.cancel();
  }

  /// Returns true if values were made or failed since the last call.
  bool take_changes();
  // Check in this order: a job counts its values before it ends.
  [[nodiscard]] bool busy() const override { return worker_.busy() || revision_ != taken_revision_; }
  [[nodiscard]] Worker::Status status() const override { return worker_.status(); }
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const override { return worker_.wait(until); }

 private:
  struct Entry {
    Request request;
    std::optional<Made> built;
    std::optional<Error> failure;
    bool wanted = true;  // false: it was running when the requests were last replaced
    [[nodiscard]] bool is_missing() const { return wanted && !built && !failure; }
  };
  typename std::vector<Entry>::iterator find(const Request& request);
  [[nodiscard]] Worker::Job job() {
    return {what_, stage_, [this](Progress& progress) { build_missing(progress); }};
  }
  void build_missing(Progress& progress);

  const char* what_;
  Progress::Stage stage_;
  Make make_;
  std::function<void()> notify_;
  mutable std::mutex mutex_;
  std::vector<Entry> cache_;
  std::optional<Request> under_way_;
  std::atomic<std::uint64_t> revision_ = 0;
  std::atomic<std::uint64_t> taken_revision_ = 0;
  ResourceLimitsPtr
      resource_limits_;  // applied to each value separately: with a thread limit, other jobs run between two values
  Worker worker_;        // last: its thread uses all of the above
};

template <class Request, class Made>
typename std::vector<typename RequestCache<Request, Made>::Entry>::iterator RequestCache<Request, Made>::find(
    const Request& request) {
  return std::ranges::find_if(cache_, [&](const Entry& entry) { return entry.request == request; });
}

template <class Request, class Made>
void RequestCache<Request, Made>::request(std::vector<Request> requests) {
  if (job_log() != nullptr) job_log()->request(requests);
  bool missing = false;
  bool failed = false;
  std::vector<Entry> before;  // destroyed after the lock is released, because its contents may be large
  {
    const std::scoped_lock lock(mutex_);
    before = std::exchange(cache_, {});
    for (Request& request : requests) {
      if (find(request) != cache_.end()) continue;
      const auto was = std::ranges::find_if(before, [&](const Entry& entry) { return entry.request == request; });
      cache_.push_back({std::move(request), {}, {}});
      if (was == before.end()) continue;
      cache_.back().built = std::move(was->built);
      cache_.back().failure = was->failure;
    }
    if (under_way_ && find(*under_way_) == cache_.end()) cache_.push_back({*under_way_, {}, {}, false});
    missing = std::ranges::any_of(cache_, &Entry::is_missing);
    failed = std::ranges::any_of(cache_, [](const Entry& entry) { return entry.failure.has_value(); });
  }
  if (missing) {
    worker_.post(job());
  } else if (!failed) {
    worker_.forget_failure();
  }
}

template <class Request, class Made>
std::optional<Made> RequestCache<Request, Made>::built(const Request& request) const {
  const std::scoped_lock lock(mutex_);
  const auto found = std::ranges::find_if(cache_, [&](const Entry& entry) { return entry.request == request; });
  return found == cache_.end() ? std::nullopt : found->built;
}

template <class Request, class Made>
bool RequestCache<Request, Made>::is_under_way(const Request& request) const {
  const std::scoped_lock lock(mutex_);
  return under_way_ == request;
}

template <class Request, class Made>
void RequestCache<Request, Made>::rebuild() {
  log_call(what_, "forget failures");
  const std::scoped_lock lock(mutex_);
  for (Entry& entry : cache_) entry.failure.reset();
}

template <class Request, class Made>
bool RequestCache<Request, Made>::take_changes() {
  const std::uint64_t revision = revision_;
  return taken_revision_.exchange(revision) != revision;
}

template <class Request, class Made>
void RequestCache<Request, Made>::build_missing(Progress& progress) {
  // Must be called on every exit.
  const auto rest = [this] {
    const std::scoped_lock lock(mutex_);
    under_way_.reset();
  };
  for (;;) {
    std::optional<Request> next;
    {
      const std::scoped_lock lock(mutex_);
      const auto missing = std::ranges::find_if(cache_, &Entry::is_missing);
      if (missing != cache_.end()) next = missing->request;
      under_way_ = next;
    }
    if (!next) break;
    std::optional<Made> built;
    std::optional<Error> failure;
    try {
      progress.begin(stage_);
      resource_limits_->run([&] { built = make_(*next, progress); });
      progress.check();
    } catch (...) {
      failure = caught(what_);
    }
    if (failure && failure->code() == ErrorCode::cancelled) {
      rest();
      throw Error(*failure);
    }
    {
      const std::scoped_lock lock(mutex_);
      under_way_.reset();
      const auto found = find(*next);
      if (found != cache_.end()) {
        found->built = std::move(built);
        found->failure = std::move(failure);
        ++revision_;
      }
    }
    notify_();
    if (worker_.continue_later(job())) return;
  }
  const std::scoped_lock lock(mutex_);
  for (const Entry& entry : cache_) {
    if (entry.failure && entry.wanted) throw Error(*entry.failure);
  }
}

}  // namespace cumulet::viewer
