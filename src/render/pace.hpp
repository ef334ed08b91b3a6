#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "gl/objects.hpp"
#include "render/row_revisions.hpp"

namespace cumulet::render {

/// What a round costs, by how much is under way in it: an upper estimate that errs on the safe side where it has to
/// guess. More at once take longer, but no longer than in proportion.
class RoundCost {
 public:
  /// What one round of that many slots takes at most, in ms; nothing while nothing is known. free: on a machine that
  /// does nothing else: for the least that a frame does, which shall not shrink because others are busy.
  [[nodiscard]] std::optional<double> most(double slots, bool free = false) const;
  /// A round of that many took between low and high; the first is not believed: drivers compile in it.
  void learn(double slots, double low_ms, double high_ms);

 private:
  struct Known {
    double slots = 0.0;
    double ms = 0.0;
    double best = 0.0;  // lately
  };
  std::array<Known, 32> known_;  // by the logarithm of slots
  bool warm_ = false;
  double last_ratio_ = 0.0;  // of the last dispatch, what it took at least to what was thought to be most
};

/// The part of a budget that is kept back while the host's own work shares the cores with ours, so that nineteen of
/// twenty calls end within it, nearly: what the system gives to which is not known before. Follows that quantile by
/// stochastic approximation (Robbins and Monro 1951).
/// Calls that are later than any reserve could make good teach nothing.
class Reserve {
 public:
  [[nodiscard]] double of(double budget_ms) const { return part_ * budget_ms; }
  /// What a call with that budget took.
  void learn(double budget_ms, double taken_ms);

 private:
  double part_ = 0.0;
};

/// Some of the lanes that sample a tile's pixels in one pass.
struct Block {
  std::uint32_t unfinished = 0;  // have a pixel, as far as is known: no more have
  std::uint32_t empty = 0;       // of those: one without a sample
  std::uint32_t under_way = 0;   // dispatches
  bool begins = true;
  std::uint32_t turn = 0;  // CM_TURN of glsl/path_blocks.glsl
};
using Blocks = std::vector<Block>;

/// Sums over the pixels that have two samples: what the noise of all of them is made of.
struct ErrorSums {
  double squared = 0.0;     // standard errors of their luminances, squared
  double brightness = 0.0;  // luminances
  double pixels = 0.0;

  ErrorSums& operator+=(const ErrorSums& other);
  /// Root of the mean squared standard error over the mean luminance; 0 of black. Nothing where it is unknown: of no
  /// pixels, and where a sum is not finite.
  [[nodiscard]] std::optional<double> noise() const;
};

/// Of a square of pixels, those with two samples: ErrorSums, of even and of odd rows apart where they are squared.
struct SquareError {
  std::array<double, 2> squared{};
  double brightness = 0.0;
  double pixels = 0.0;
};
/// A tile's, row by row; empty until they are known.
using SquareErrors = std::vector<SquareError>;

/// Samples that are known to be finished, and those of them whose light was not finite, which count as black.
struct SampleCount {
  std::uint64_t finished = 0;
  std::uint64_t not_finite = 0;
};

/// What was dispatched, and what it was thought to take.
struct Dispatched {
  std::shared_ptr<Blocks> tile;          // that it is of
  std::shared_ptr<SquareErrors> errors;  // of the tile, which it finds, and no samples
  std::shared_ptr<SampleCount> samples;  // of the picture
  std::shared_ptr<RowRevisions> rows;    // likewise
  std::uint32_t first_row = 0;           // of the tile, in the picture
  std::uint64_t revision = 0;            // the picture's, with it
  std::vector<std::uint32_t> blocks;
  std::uint32_t rounds = 1;
  double lanes = 0.0;  // that had something to do
  double slots = 0.0;  // vectors of them
  std::shared_ptr<RoundCost> cost;
  double aim_ms = 0.0;
  double most_ms = 0.0;
};

/// Lanes that cost what one of them costs, at least: a slot.
constexpr double lanes_a_slot = 8.0;
/// What a frame may take of the device whatever its budget, so that there is progress.
constexpr double least_ms = 1.0;
/// What a dispatch may take at most: well under any driver's watchdog, well over its own cost.
constexpr double dispatch_ms = 500.0;
/// Of the time left, that a dispatch may likely take.
constexpr double part_of_rest = 0.9;

/// What to dispatch of a tile's blocks, from that one on: as many as are worth a dispatch of aim_ms, and as many rounds
/// of them, but no more than most_rounds. Nothing if it is likely to take longer.
[[nodiscard]] std::optional<Dispatched> choose(const Blocks& blocks, std::size_t from,
                                               const std::shared_ptr<RoundCost>& cost, double aim_ms,
                                               std::uint32_t most_rounds);
/// The same for an aim of least_ms, and at least a round of a block, whatever that takes.
[[nodiscard]] std::optional<Dispatched> choose_least(const Blocks& blocks, std::size_t from,
                                                     const std::shared_ptr<RoundCost>& cost, std::uint32_t most_rounds);
/// What a dispatch that is over tells of its cost. ms: on the device, if that is known; full_rounds: how often its
/// lanes marched, all of them together.
void learn(const Dispatched& what, std::optional<double> ms, double at_most_ms, double full_rounds);

/// A dispatch that is over, for tests and tuning.
struct DispatchRecord {
  double aim_ms = 0.0;
  double ms = 0.0;  // on the device, whatever else was queued
  std::uint32_t lanes = 0;
  std::uint32_t alive = 0;  // of these, as far as was known
  std::uint32_t rounds = 0;
  bool known = false;  // not the first of its kind
};

/// The dispatches under way: what each has to tell, and how long it took on the device, whatever else the host has
/// queued there. Nothing waits but finish(). A driver that runs dispatches within the call has none under way.
class Flights {
 public:
  static constexpr std::size_t most = 3;
  static constexpr std::size_t most_words = 16384;  // uvec4, that a dispatch tells: one a square of a tile

  explicit Flights(gl::FunctionsPtr gl) : gl_(std::move(gl)) {}

  enum class Kind { dispatch, draws };
  struct Landed {
    Dispatched what;
    std::vector<glm::uvec4> words;
    /// On the device. Without: no more than at_most_ms, with all that the host had queued.
    std::optional<double> ms;
    double at_most_ms = 0.0;
  };

  /// Around a dispatch; at most `most` of them may be under way. words of the buffer are kept as they are then.
  void begin(Kind kind);
  void end(Dispatched what, GLuint buffer, std::size_t words);
  /// Instead of end(): nothing came of it.
  void give_up();
  /// The oldest, if it is over. Never waits.
  std::optional<Landed> land();
  /// Waits until all are over; land() gives them.
  void finish() const;
  /// What this context does from now on comes after them, whichever made them.
  void order() const;

  [[nodiscard]] bool empty() const { return flying_.empty(); }
  [[nodiscard]] bool full() const { return flying_.size() >= most; }
  /// Milliseconds that those under way will likely take.
  [[nodiscard]] double expected_ms() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Flight {
    Dispatched what;
    std::size_t words = 0;
    std::size_t place = 0;
    std::uint32_t serial = 0;
    gl::Fence before;
    gl::Fence after;
    Clock::time_point sent;
    Clock::time_point asked;                 // last, about the fence
    Clock::time_point looked;                // last seen under way
    std::optional<Clock::time_point> began;  // when those before it were seen to be over, if that is known closely
    bool waits = true;                       // for those before it, as far as is known
    bool timed = false;
    bool in_call = false;  // over when its call returns
    std::optional<double> in_call_ms;
  };
  // What a flight has of the ring: its words, two times, and two marks that the device leaves as it comes to it and as
  // it is through: zink waits for what the host has queued when it is asked for a fence. (Drivers that dispatch within
  // the call leave marks at once, too, whatever is queued; there fences tell.)
  static constexpr std::size_t times_bytes = 16;
  static constexpr std::size_t place_bytes = most_words * 16 + times_bytes + 16;
  enum class Mark : std::size_t { begun = 0, over = 1 };
  [[nodiscard]] static std::size_t times_at(const Flight& flight) {
    return flight.place * place_bytes + most_words * 16;
  }
  [[nodiscard]] static std::size_t mark_at(const Flight& flight, Mark mark) {
    return times_at(flight) + times_bytes + 4 * static_cast<std::size_t>(mark);
  }
  void leave(Mark mark);
  [[nodiscard]] bool left(const Flight& flight, Mark mark) const;
  [[nodiscard]] bool has_begun(const Flight& flight) const;
  [[nodiscard]] bool is_over(Flight& flight, Clock::time_point now) const;

  gl::FunctionsPtr gl_;
  gl::ReadBack ring_;
  std::size_t next_place_ = 0;
  std::uint32_t serial_ = 0;  // of the newest: what its marks say
  std::deque<Flight> flying_;
  std::array<GLuint, 2> queries_{};
  Flight next_;
  bool timers_ = true;   // tell the truth
  double likely_ = 0.5;  // of what a dispatch takes at most
};

/// While there is nothing to do but to wait for the device: no call into GL waits.
void pass_time();

/// What a dispatch of rows that has landed tells of its cost, if it has one.
void learn_rows(const Flights::Landed& landed);
/// Sends rows, from row on, of what is a round for each of its pixels, until all are sent or about the deadline; what
/// follows in GL comes after them. send gets the first row and the one after the last, and dispatches them; collect
/// takes up what has landed, and teaches cost.
void send_rows(Flights& flights, const std::shared_ptr<RoundCost>& cost, glm::uvec2 size, std::uint32_t& row,
               std::chrono::steady_clock::time_point deadline, const std::function<void(glm::uvec2 rows)>& send,
               const std::function<void()>& collect);

}  // namespace cumulet::render
