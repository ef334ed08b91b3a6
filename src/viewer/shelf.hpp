#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "viewer/worker.hpp"

namespace cumulet::viewer {

/// What several wishes are of, made one after another on a thread of its own, and kept as long as it is wished for. All
/// calls are safe from any thread.
template <class WishOf, class Made>
class Shelf {
 public:
  using Wish = WishOf;
  using Make = std::function<Made(const Wish&, Progress&)>;

  /// what, stage: of the work, as failures and Worker::status() tell. notify: called on the worker after each, and when
  /// a job ended.
  Shelf(const char* what, Progress::Stage stage, Make make, std::function<void()> notify, Trace trace = {},
        AllowancePtr allowance = std::make_shared<const Allowance>())
      : what_(what),
        stage_(stage),
        make_(std::move(make)),
        notify_(notify),
        allowance_(std::move(allowance)),
        worker_(std::move(notify), trace) {}

  /// In place of all wishes before. What is under way is finished, and is there until the next wishes, so that of
  /// wishes that change faster than they are built every one that is begun can be seen. What failed is not tried again.
  void wish(std::vector<Wish> wishes);
  /// What there is of a wish; none where it is not built yet, or could not be. O(wishes).
  [[nodiscard]] std::optional<Made> built(const Wish& wish) const;
  [[nodiscard]] bool is_under_way(const Wish& wish) const;
  /// With the next wishes, what failed is tried again.
  void forget_failures();
  /// Another after each that was made.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  /// Ends what is under way, and what waits, with ErrorCode::cancelled.
  void cancel() { worker_.cancel(); }

  [[nodiscard]] bool busy() const { return worker_.busy(); }
  [[nodiscard]] Worker::Status status() const { return worker_.status(); }
  /// Until idle, at most until then. Returns whether it is.
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const { return worker_.wait(until); }

 private:
  struct Shelved {
    Wish wish;
    std::optional<Made> built;
    std::optional<Error> failure;
    bool wanted = true;  // else it was under way when it was last wished for
    [[nodiscard]] bool is_missing() const { return wanted && !built && !failure; }
  };
  typename std::vector<Shelved>::iterator find(const Wish& wish);
  void build_missing(Progress& progress);

  const char* what_;
  Progress::Stage stage_;
  Make make_;
  std::function<void()> notify_;
  mutable std::mutex mutex_;
  std::vector<Shelved> shelf_;
  std::optional<Wish> under_way_;
  std::atomic<std::uint64_t> revision_ = 0;
  AllowancePtr allowance_;  // of each by itself: where threads are few, others have their turn between two
  Worker worker_;           // last: its thread uses all of the above
};

template <class Wish, class Made>
typename std::vector<typename Shelf<Wish, Made>::Shelved>::iterator Shelf<Wish, Made>::find(const Wish& wish) {
  return std::ranges::find_if(shelf_, [&](const Shelved& shelved) { return shelved.wish == wish; });
}

template <class Wish, class Made>
void Shelf<Wish, Made>::wish(std::vector<Wish> wishes) {
  bool missing = false;
  bool failed = false;
  std::vector<Shelved> before;  // ends after the lock: what it holds may be large
  {
    const std::scoped_lock lock(mutex_);
    before = std::exchange(shelf_, {});
    for (Wish& wish : wishes) {
      if (find(wish) != shelf_.end()) continue;
      const auto was = std::ranges::find_if(before, [&](const Shelved& shelved) { return shelved.wish == wish; });
      shelf_.push_back({std::move(wish), {}, {}});
      if (was == before.end()) continue;
      shelf_.back().built = std::move(was->built);
      shelf_.back().failure = was->failure;
    }
    if (under_way_ && find(*under_way_) == shelf_.end()) shelf_.push_back({*under_way_, {}, {}, false});
    missing = std::ranges::any_of(shelf_, &Shelved::is_missing);
    failed = std::ranges::any_of(shelf_, [](const Shelved& shelved) { return shelved.failure.has_value(); });
  }
  if (missing) {
    worker_.post({what_, stage_, [this](Progress& progress) { build_missing(progress); }});
  } else if (!failed) {
    worker_.forget_failure();
  }
}

template <class Wish, class Made>
std::optional<Made> Shelf<Wish, Made>::built(const Wish& wish) const {
  const std::scoped_lock lock(mutex_);
  const auto found = std::ranges::find_if(shelf_, [&](const Shelved& shelved) { return shelved.wish == wish; });
  return found == shelf_.end() ? std::nullopt : found->built;
}

template <class Wish, class Made>
bool Shelf<Wish, Made>::is_under_way(const Wish& wish) const {
  const std::scoped_lock lock(mutex_);
  return under_way_ == wish;
}

template <class Wish, class Made>
void Shelf<Wish, Made>::forget_failures() {
  const std::scoped_lock lock(mutex_);
  for (Shelved& shelved : shelf_) shelved.failure.reset();
}

template <class Wish, class Made>
void Shelf<Wish, Made>::build_missing(Progress& progress) {
  // Nothing is under way however this ends.
  const auto rest = [this] {
    const std::scoped_lock lock(mutex_);
    under_way_.reset();
  };
  for (;;) {
    std::optional<Wish> next;
    {
      const std::scoped_lock lock(mutex_);
      const auto missing = std::ranges::find_if(shelf_, &Shelved::is_missing);
      if (missing != shelf_.end()) next = missing->wish;
      under_way_ = next;
    }
    if (!next) break;
    std::optional<Made> built;
    std::optional<Error> failure;
    try {
      progress.begin(stage_);
      allowance_->run([&] { built = make_(*next, progress); });
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
      const auto place = find(*next);
      if (place != shelf_.end()) {
        place->built = std::move(built);
        place->failure = std::move(failure);
        ++revision_;
      }
    }
    notify_();
  }
  const std::scoped_lock lock(mutex_);
  for (const Shelved& shelved : shelf_) {
    if (shelved.failure && shelved.wanted) throw Error(*shelved.failure);
  }
}

}  // namespace cumulet::viewer
