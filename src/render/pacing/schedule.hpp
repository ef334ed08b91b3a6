#pragma once

#include <chrono>

namespace cumulet::render {

/// State machine of the work on a request. It has no GL and no clock: events are methods, and the caller acts on the
/// state.
///
///     state      | a change           | begun     | complete | finished | extended | dropped | failed
///     idle       | due                |           |          |          |          |         |
///     due        | due                | answering |          |          |          | due     | failed
///     answering  | due, or overtaken  |           | refining |          |          | due     | failed
///     overtaken  | due, or overtaken  |           | due      |          |          | due     | failed
///     refining   | due                |           |          | done     |          | due     | failed
///     done       | due                |           |          |          | refining | due     | failed
///     failed     | due                |           |          |          |          |         | failed
///
/// An event without an entry leaves the state unchanged.
class Schedule {
 public:
  enum class State {
    idle,       // there is no request
    due,        // no picture of the request has been started: start one
    answering,  // the first picture is being rendered, and has pixels without a sample
    // the first picture is of an older request, and is finished first: otherwise none would be while requests keep
    // changing
    overtaken,
    refining,  // more samples, then finer pictures
    done,      // everything requested is done
    failed,    // it cannot be made, until the request changes
  };
  [[nodiscard]] State state() const { return state_; }

  /// The request changed. finish_answer: a first picture in progress is still worth showing.
  void change(bool finish_answer);
  /// The first picture of the request has been started.
  void begin();
  /// Every pixel of the current picture has a sample.
  void complete();
  /// The current picture is the finest, and has all its samples.
  void finish();
  /// The current picture needs more samples.
  void extend();
  /// The current picture is not usable.
  void drop();
  void fail();
  void reset() { state_ = State::idle; }

 private:
  State state_ = State::idle;
};

/// Detects whether a request has come to rest or is about to change again.
class Stillness {
 public:
  using Clock = std::chrono::steady_clock;
  /// Call it whenever the request is read. held: the user is dragging.
  void see(bool changed, bool held, Clock::time_point now);
  /// True if some time has passed since the last change, a longer time while the user is dragging; or if the user has
  /// released.
  [[nodiscard]] bool rests(Clock::time_point now) const;

 private:
  Clock::time_point changed_{};
  bool held_ = false;
  bool let_go_ = false;  // since the last change
};

}  // namespace cumulet::render
