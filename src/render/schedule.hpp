#pragma once

#include <chrono>

namespace cumulet::render {

/// Where the work on a wish stands. No GL and no clock: what happens is told, and what is to be done follows.
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
/// What has no entry leaves the state as it is.
class Schedule {
 public:
  enum class State {
    idle,       // nothing is wished
    due,        // no picture of the wish is under way: one is to be begun
    answering,  // the first one is, and has pixels without a sample
    overtaken,  // such a one is of an older wish, and finished first: else, as wishes go on changing, none ever were
    refining,   // more samples, then finer pictures
    done,       // all that was wished is there
    failed,     // it cannot be made; until the wish changes
  };
  [[nodiscard]] State state() const { return state_; }

  /// The wish is another. finish_answer: a first picture that is under way is still worth to be shown.
  void change(bool finish_answer);
  /// The first picture of the wish is under way.
  void begin();
  /// Every pixel of the picture under way has a sample.
  void complete();
  /// The picture under way is the finest, and has all its samples.
  void finish();
  /// It shall have more.
  void extend();
  /// What is under way is of no use.
  void drop();
  void fail();
  void reset() { state_ = State::idle; }

 private:
  State state_ = State::idle;
};

/// Tells a wish that rests from one that is about to change again.
class Stillness {
 public:
  using Clock = std::chrono::steady_clock;
  /// At each look at the wish. held: a hand is at what changes it.
  void see(bool changed, bool held, Clock::time_point now);
  /// Since it last changed some time has passed, longer where a hand may hold still; or the hand has let go.
  [[nodiscard]] bool rests(Clock::time_point now) const;

 private:
  Clock::time_point changed_{};
  bool held_ = false;
  bool let_go_ = false;  // since the last change
};

}  // namespace cumulet::render
