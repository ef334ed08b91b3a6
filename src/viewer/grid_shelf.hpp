#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "viewer/builder.hpp"

namespace cumulet::viewer {

/// Grids of several volumes, built one after another on a thread of its own, and kept as long as they are wished for.
/// All calls are safe from any thread.
class GridShelf {
 public:
  struct Wish {
    VolumeAssetPtr volume;
    BuildSettings settings;
    bool operator==(const Wish&) const = default;
  };

  /// notify: called on the worker after each grid, and when a job ended.
  GridShelf(Log log, std::function<void()> notify, Trace trace = {})
      : log_(std::move(log)), notify_(notify), worker_(std::move(notify), trace) {}

  /// In place of all wishes before. The grid under way is finished, and is there until the next wishes, so that of
  /// wishes that change faster than they are built every one that is begun can be seen. What failed is not tried again.
  void wish(std::vector<Wish> wishes);
  /// What there is of a wish; none where it is not built yet, or could not be. O(wishes).
  [[nodiscard]] std::optional<Built> built(const Wish& wish) const;
  [[nodiscard]] bool is_under_way(const Wish& wish) const;
  /// With the next wishes, what failed is tried again.
  void forget_failures();
  /// Another after each grid that was built.
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
    std::optional<Built> built;
    std::optional<Error> failure;
    bool wanted = true;  // else it was under way when it was last wished for
    [[nodiscard]] bool is_missing() const { return wanted && !built && !failure; }
  };
  std::vector<Shelved>::iterator find(const Wish& wish);
  void build_missing(Progress& progress);

  Log log_;
  std::function<void()> notify_;
  mutable std::mutex mutex_;
  std::vector<Shelved> shelf_;
  std::optional<Wish> under_way_;
  std::atomic<std::uint64_t> revision_ = 0;
  Worker worker_;  // last: its thread uses all of the above
};

}  // namespace cumulet::viewer
