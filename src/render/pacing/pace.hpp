#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "gl/objects.hpp"
#include "render/pacing/dispatch_results.hpp"
#include "render/pacing/row_revisions.hpp"

namespace cumulet::render {

/// Estimates the time of one round (one step of every lane) as a function of the number of lanes. The estimate is an
/// upper bound. More lanes take longer, but at most in proportion.
class RoundCost {
 public:
  /// Returns the estimated maximum time of one round of this many slots, in ms; nullopt if nothing is known. free:
  /// estimate for an otherwise idle machine. It is used for the minimum work per frame, which must not shrink because
  /// other processes are busy.
  [[nodiscard]] std::optional<double> most(double slots, bool free = false) const;
  /// Records that a round of this many slots took between low_ms and high_ms. The first call is ignored, because
  /// drivers compile in it.
  void learn(double slots, double low_ms, double high_ms);

  /// Returns the number of lanes that the device runs at once; nullopt if no dispatch had more. Further lanes wait
  /// until others end, in a second wave that fills the device only partly.
  [[nodiscard]] std::optional<std::uint32_t> resident_lanes() const;
  /// Records that of `sent` work groups with paths at most `most` ran at once.
  void learn_groups(std::uint32_t sent, std::uint32_t most);

 private:
  struct Known {
    double slots = 0.0;
    double ms = 0.0;
    double best = 0.0;  // recent minimum
  };
  std::array<Known, 32> known_;  // indexed by log2 of slots
  bool warm_ = false;
  double last_ratio_ = 0.0;  // of the last dispatch: its minimum time over the estimated maximum
  std::uint32_t resident_groups_ = 0;
};

/// Fraction of a time budget to hold back, so that about 95 % of the calls end within the budget. The host's own work
/// shares the cores, and the scheduler's decisions are not known in advance. Follows that quantile by stochastic
/// approximation (Robbins and Monro 1951). Calls that exceed the budget by more than any reserve could cover are
/// ignored.
class Reserve {
 public:
  [[nodiscard]] double of(double budget_ms) const { return part_ * budget_ms; }
  /// Records the time of a call with that budget.
  void learn(double budget_ms, double taken_ms);

 private:
  double part_ = 0.0;
};

/// A dispatch, and its estimated cost.
struct Dispatched {
  std::shared_ptr<Blocks> tile;          // the tile's blocks
  std::shared_ptr<SquareErrors> errors;  // set if the dispatch measures the tile's error and takes no samples
  std::shared_ptr<SampleCount> samples;  // of the picture
  std::shared_ptr<RowRevisions> rows;    // of the picture
  std::uint32_t first_row = 0;           // of the tile, in the picture
  std::uint64_t revision = 0;            // of the picture, with this dispatch
  std::vector<std::uint32_t> blocks;
  std::uint32_t rounds = 1;
  double lanes = 0.0;  // lanes that had work
  double slots = 0.0;  // groups of lanes_per_slot lanes
  std::shared_ptr<RoundCost> cost;
  double aim_ms = 0.0;
  double max_ms = 0.0;
};

/// A slot: this many lanes cost about as much as one.
constexpr double lanes_per_slot = 8.0;
/// Minimum GPU time per frame for any budget, so that there is progress.
constexpr double min_ms = 1.0;
/// Maximum time of a dispatch: well below any driver's watchdog, well above its overhead.
constexpr double dispatch_ms = 500.0;
/// Fraction of the remaining time that a dispatch may be estimated to take.
constexpr double part_of_rest = 0.9;

/// Chooses blocks of a tile, from block `from` on, and the number of rounds (at most max_rounds) for a dispatch of
/// aim_ms. Returns nullopt if one round would take longer.
[[nodiscard]] std::optional<Dispatched> choose(const Blocks& blocks, std::size_t from,
                                               const std::shared_ptr<RoundCost>& cost, double aim_ms,
                                               std::uint32_t max_rounds);
/// Chooses a dispatch of min_ms, with at least one round of one block even if that takes longer.
[[nodiscard]] std::optional<Dispatched> choose_minimum(const Blocks& blocks, std::size_t from,
                                                       const std::shared_ptr<RoundCost>& cost,
                                                       std::uint32_t max_rounds);
/// Updates the cost estimate with a finished dispatch. ms: GPU time, if known; at_most_ms: its upper bound.
/// full_rounds: number of rounds that all lanes together traversed cells in.
void learn(const Dispatched& what, std::optional<double> ms, double at_most_ms, double full_rounds);

/// A finished dispatch, for tests and tuning.
struct DispatchRecord {
  double aim_ms = 0.0;
  double ms = 0.0;  // GPU time, without other queued work
  std::uint32_t lanes = 0;
  std::uint32_t alive = 0;  // lanes with a pixel, as far as was known
  std::uint32_t rounds = 0;
  bool known = false;  // false for the first of its kind
};

/// In-flight dispatches: reads back their results, and measures their time on the device without other work that the
/// host has queued. Only finish() waits. If a driver runs dispatches within the call, none are in flight.
class InFlightDispatches {
 public:
  static constexpr std::size_t most = 3;
  static constexpr std::size_t max_words = 16384;  // maximum result size in uvec4: one per block of a tile

  explicit InFlightDispatches(gl::FunctionsPtr gl) : gl_(std::move(gl)) {}

  enum class Kind { dispatch, draws };
  struct Completed {
    Dispatched what;
    std::vector<glm::uvec4> words;
    /// GPU time. nullopt: unknown, but no more than at_most_ms, which includes all that the host had queued.
    std::optional<double> ms;
    double at_most_ms = 0.0;
  };

  /// Call begin() before and end() after a dispatch; at most `most` may be in flight. end() copies the first `words`
  /// uvec4 of the buffer.
  void begin(Kind kind);
  void end(Dispatched what, GLuint buffer, std::size_t words);
  /// Call it instead of end() if the dispatch failed.
  void give_up();
  /// Returns the oldest dispatch if it is finished. Never waits.
  std::optional<Completed> take_completed();
  /// Waits until all are finished; take_completed() returns them.
  void finish() const;
  /// Makes later commands of this context run after the dispatches, whichever context sent them.
  void order() const;

  [[nodiscard]] bool empty() const { return in_flight_.empty(); }
  [[nodiscard]] bool full() const { return in_flight_.size() >= most; }
  /// Estimated time of the in-flight dispatches, in milliseconds.
  [[nodiscard]] double expected_ms() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct InFlightDispatch {
    Dispatched what;
    std::size_t words = 0;
    std::size_t slot = 0;
    std::uint32_t serial = 0;
    gl::Fence before;
    gl::Fence after;
    Clock::time_point sent;
    Clock::time_point asked;                 // when the fence was queried last
    Clock::time_point looked;                // when it was last seen unfinished
    std::optional<Clock::time_point> began;  // when its predecessors were seen to be finished, if that is known closely
    bool waits = true;                       // for its predecessors, as far as is known
    bool timed = false;
    bool in_call = false;  // finished when its call returns
    std::optional<double> in_call_ms;
  };
  // Layout of a slot of the ring: the results, two timestamps, and two marks. The device writes the marks when it
  // reaches and when it finishes the dispatch. Marks are polled because zink waits for all work of the host when a
  // fence is queried. (Drivers that run dispatches within the call also write marks at once, before queued work; fences
  // are used there.)
  static constexpr std::size_t times_bytes = 16;
  static constexpr std::size_t slot_bytes = max_words * 16 + times_bytes + 16;
  enum class Mark : std::size_t { begun = 0, over = 1 };
  [[nodiscard]] static std::size_t times_at(const InFlightDispatch& pending) {
    return pending.slot * slot_bytes + max_words * 16;
  }
  [[nodiscard]] static std::size_t mark_at(const InFlightDispatch& pending, Mark mark) {
    return times_at(pending) + times_bytes + 4 * static_cast<std::size_t>(mark);
  }
  void leave(Mark mark);
  [[nodiscard]] bool left(const InFlightDispatch& pending, Mark mark) const;
  [[nodiscard]] bool has_begun(const InFlightDispatch& pending) const;
  [[nodiscard]] bool is_over(InFlightDispatch& pending, Clock::time_point now) const;

  gl::FunctionsPtr gl_;
  gl::ReadBack ring_;
  std::size_t next_slot_ = 0;
  std::uint32_t serial_ = 0;  // of the newest; the value of its marks
  std::deque<InFlightDispatch> in_flight_;
  std::array<GLuint, 2> queries_{};
  InFlightDispatch next_;
  bool timers_ = true;   // timestamp queries work
  double likely_ = 0.5;  // mean actual time over the estimated maximum
};

}  // namespace cumulet::render
