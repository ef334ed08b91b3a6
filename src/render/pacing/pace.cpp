#include "render/pacing/pace.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "base/milliseconds.hpp"

namespace cumulet::render {

namespace {

using Clock = std::chrono::steady_clock;

// If the begin and the end were observed this closely, the clock gives the time of a dispatch.
constexpr double close_ms = 0.3;
// Fallback for drivers that show marks no earlier than fences.
constexpr double patience_ms = 200.0;
// Maximum growth of the estimate by two dispatches.
constexpr double max_growth = 4.0;
// The most expensive rounds take about three times as long as the cheapest in which all lanes traverse cells. Longer
// times are caused by other processes.
constexpr double spread = 4.0;
constexpr double free_spread = 1.5;
constexpr double forgetting = 1.005;  // the scene may have become more expensive
// Loading and storing paths must cost little compared with running them.
constexpr double worthwhile_rounds = 8.0;
constexpr std::uint32_t first_rounds = 4;  // while their cost is unknown

// Adds blocks that have this many dispatches in flight, until the dispatch is likely to take longer than its aim.
// Returns the estimated time of one round, if it is known.
std::optional<double> choose_blocks(const Blocks& blocks, std::size_t from, std::uint32_t under_way, bool free,
                                    Dispatched& what) {
  std::optional<double> round_ms;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const std::size_t index = (from + i) % blocks.size();
    const Block& block = blocks[index];
    if (block.unfinished == 0 || block.under_way != under_way) continue;
    const double lanes = what.lanes + block.unfinished;
    const double slots = what.slots + std::ceil(block.unfinished / lanes_per_slot);
    const auto ms = what.cost->most(slots, free);
    if (!what.blocks.empty() && (!ms || *ms * worthwhile_rounds > what.aim_ms)) break;
    what.blocks.push_back(static_cast<std::uint32_t>(index));
    what.lanes = lanes;
    what.slots = slots;
    round_ms = ms;
  }
  return round_ms;
}

std::optional<Dispatched> choose_for(const Blocks& blocks, std::size_t from, const std::shared_ptr<RoundCost>& cost,
                                     double aim_ms, std::uint32_t max_rounds, bool least) {
  Dispatched what;
  what.cost = cost;
  what.aim_ms = aim_ms;
  // Blocks without dispatches in flight are chosen first. If there are none, blocks with one are, whose dispatch may be
  // too small.
  auto round_ms = choose_blocks(blocks, from, 0, least, what);
  if (what.blocks.empty()) round_ms = choose_blocks(blocks, from, 1, least, what);
  if (what.blocks.empty() || (!least && round_ms.value_or(min_ms) > aim_ms)) return std::nullopt;
  what.rounds = first_rounds;
  if (round_ms) {
    what.rounds = static_cast<std::uint32_t>(std::clamp(aim_ms / *round_ms, 1.0, double(max_rounds)));
    what.max_ms = *round_ms * what.rounds;
  }
  return what;
}

}  // namespace

std::optional<Dispatched> choose(const Blocks& blocks, std::size_t from, const std::shared_ptr<RoundCost>& cost,
                                 double aim_ms, std::uint32_t max_rounds) {
  return choose_for(blocks, from, cost, aim_ms, max_rounds, false);
}

std::optional<Dispatched> choose_minimum(const Blocks& blocks, std::size_t from, const std::shared_ptr<RoundCost>& cost,
                                         std::uint32_t max_rounds) {
  return choose_for(blocks, from, cost, min_ms, max_rounds, true);
}

void learn(const Dispatched& what, std::optional<double> ms, double at_most_ms, double full_rounds) {
  if (!what.cost) return;
  // Fraction of the possible rounds that the lanes ran. Lanes that end early, or hit nothing, cost less and say little
  // about the cost of others.
  const double high =
      full_rounds > 0.0 ? ms.value_or(at_most_ms) * what.lanes / full_rounds : std::numeric_limits<double>::infinity();
  what.cost->learn(what.slots, ms ? *ms / what.rounds : 0.0, high);
}

std::optional<double> RoundCost::most(double slots, bool free) const {
  std::optional<double> most;
  for (const Known& known : known_) {
    if (known.slots <= 0.0) continue;
    const double ms =
        std::min(known.ms, (free ? free_spread : spread) * known.best) * std::max(1.0, slots / known.slots);
    if (!most || ms < *most) most = ms;
  }
  return most;
}

void RoundCost::learn(double slots, double low_ms, double high_ms) {
  slots = std::max(1.0, slots);
  if (!warm_) {
    warm_ = true;
    return;
  }
  const auto before = most(slots);
  Known& own = known_.at(std::min<std::size_t>(known_.size() - 1, static_cast<std::size_t>(std::log2(slots))));
  if (std::isfinite(high_ms) && high_ms > 0.0) {
    if (own.slots > 0.0) {
      const double scale = std::max(1.0, slots / own.slots);
      const double was = own.ms * scale;
      own.best = std::min(own.best * scale * forgetting, high_ms);
      own.ms = high_ms < was ? 0.5 * (was + high_ms) : was;
      own.slots = slots;
    } else {
      own = {slots, high_ms, high_ms};
    }
  }
  // A minimum above the estimate raises all estimates, unless the machine was interrupted. Two in a row are not
  // considered interruptions.
  const double ratio = before ? low_ms / *before : 0.0;
  const double sure = std::min(ratio, std::exchange(last_ratio_, ratio));
  if (!(sure > 1.0)) return;
  low_ms = std::min(sure, max_growth) * *before;
  for (Known& known : known_) {
    if (known.slots > 0.0) known.ms = std::max(known.ms, low_ms * std::min(1.0, known.slots / slots));
  }
}

std::optional<std::uint32_t> RoundCost::resident_lanes() const {
  if (resident_groups_ == 0) return std::nullopt;
  return CM_SQUARE_PIXELS * resident_groups_;
}

void RoundCost::learn_groups(std::uint32_t sent, std::uint32_t most) {
  // Drivers that run on processors have about a group per core, and share them with the host.
  constexpr std::uint32_t least = 32;
  if (most < sent && most >= least) resident_groups_ = std::max(resident_groups_, most);
}

void Reserve::learn(double budget_ms, double taken_ms) {
  constexpr double late_at = 1.15;
  constexpr double may_be_late = 0.05;
  constexpr double step = 0.2;
  constexpr double max_part = 0.5;
  if (taken_ms > (1.0 + max_part) * budget_ms) return;
  const bool late = taken_ms > late_at * budget_ms;
  part_ = std::clamp(part_ + step * ((late ? 1.0 : 0.0) - may_be_late), 0.0, max_part);
}

void InFlightDispatches::leave(Mark mark) {
  gl_->ClearNamedBufferSubData(ring_.name(), GL_R32UI, static_cast<GLintptr>(mark_at(next_, mark)), 4, GL_RED_INTEGER,
                               GL_UNSIGNED_INT, &next_.serial);
}

bool InFlightDispatches::left(const InFlightDispatch& pending, Mark mark) const {
  // The device may write it at any time.
  const auto* word = reinterpret_cast<const volatile std::uint32_t*>(ring_.data() + mark_at(pending, mark));
  return *word == pending.serial;
}

bool InFlightDispatches::has_begun(const InFlightDispatch& pending) const {
  return gl_->dispatches_in_call ? pending.before.passed() : left(pending, Mark::begun);
}

bool InFlightDispatches::is_over(InFlightDispatch& pending, Clock::time_point now) const {
  if (!left(pending, Mark::over) && milliseconds(now - pending.asked) < patience_ms) return false;
  pending.asked = now;
  return pending.after.passed();
}

void InFlightDispatches::begin(Kind kind) {
  if (!ring_) ring_ = gl::ReadBack(gl_, (most + 1) * slot_bytes, "creating the counters' ring");
  next_ = {};
  next_.slot = next_slot_;
  next_slot_ = (next_slot_ + 1) % (most + 1);
  next_.serial = ++serial_;
  next_.in_call = kind == Kind::dispatch && gl_->dispatches_in_call;
  if (!next_.in_call) {
    if (gl_->dispatches_in_call && in_flight_.empty()) next_.before = gl::Fence(gl_);
    leave(Mark::begun);
    if (timers_ && !gl_->dispatches_in_call) {
      // The queries are created per dispatch, because contexts do not share queries.
      gl_->CreateQueries(GL_TIMESTAMP, 2, queries_.data());
      if (queries_[0] != 0) gl_->QueryCounter(queries_[0], GL_TIMESTAMP);
    }
  }
  next_.sent = next_.asked = next_.looked = Clock::now();
}

void InFlightDispatches::end(Dispatched what, GLuint buffer, std::size_t words) {
  if (next_.in_call) next_.in_call_ms = milliseconds(Clock::now() - next_.sent);
  next_.what = std::move(what);
  next_.words = words;
  if (queries_[0] != 0) {
    gl_->QueryCounter(queries_[1], GL_TIMESTAMP);
    for (std::size_t i = 0; i < 2; ++i) {
      gl_->GetQueryBufferObjectui64v(queries_.at(i), ring_.name(), GL_QUERY_RESULT,
                                     static_cast<GLintptr>(times_at(next_) + 8 * i));
    }
    gl_->DeleteQueries(2, queries_.data());
    queries_ = {};
    next_.timed = true;
  }
  if (words > 0) {
    gl::memory_barrier(*gl_, GL_BUFFER_UPDATE_BARRIER_BIT);
    gl_->CopyNamedBufferSubData(buffer, ring_.name(), 0, static_cast<GLintptr>(next_.slot * slot_bytes),
                                static_cast<GLsizeiptr>(words * 16));
  }
  if (!next_.in_call) {
    leave(Mark::over);
    next_.after = gl::Fence(gl_);
  }
  in_flight_.push_back(std::move(next_));
}

void InFlightDispatches::give_up() {
  if (queries_[0] != 0) gl_->DeleteQueries(2, queries_.data());
  queries_ = {};
  next_slot_ = next_.slot;
}

std::optional<InFlightDispatches::Completed> InFlightDispatches::take_completed() {
  if (in_flight_.empty()) return std::nullopt;
  InFlightDispatch& first = in_flight_.front();
  const auto now = Clock::now();
  const bool close = milliseconds(now - first.looked) < close_ms;
  if (!first.in_call && first.waits && has_begun(first)) {
    first.waits = false;
    if (close) first.began = now;
  }
  if (!first.in_call && !is_over(first, now)) {
    first.looked = now;
    return std::nullopt;
  }
  Completed completed;
  completed.ms = first.in_call_ms;
  completed.at_most_ms = milliseconds(now - first.sent);
  if (first.timed) {
    std::array<std::uint64_t, 2> times{};
    std::memcpy(times.data(), ring_.data() + times_at(first), sizeof(times));
    timers_ = times[1] > times[0];
    if (timers_) completed.ms = 1e-6 * static_cast<double>(times[1] - times[0]);
  }
  if (!completed.ms && first.began && close) completed.ms = milliseconds(now - *first.began);
  completed.words.resize(first.words);
  if (first.words > 0) std::memcpy(completed.words.data(), ring_.data() + first.slot * slot_bytes, first.words * 16);
  completed.what = std::move(first.what);
  if (completed.ms && completed.what.max_ms > 0.0) {
    likely_ += 0.1 * (std::clamp(*completed.ms / completed.what.max_ms, 0.05, 1.0) - likely_);
  }
  in_flight_.pop_front();
  if (!in_flight_.empty()) {
    InFlightDispatch& next = in_flight_.front();
    next.waits = false;
    next.looked = now;
    if (close) next.began = now;
  }
  return completed;
}

void InFlightDispatches::finish() const {
  if (!in_flight_.empty()) in_flight_.back().after.wait();
}

void InFlightDispatches::order() const {
  if (!in_flight_.empty()) in_flight_.back().after.order();
}

double InFlightDispatches::expected_ms() const {
  double sum = 0.0;
  for (const InFlightDispatch& pending : in_flight_) sum += pending.what.max_ms;
  return likely_ * sum;
}

}  // namespace cumulet::render
