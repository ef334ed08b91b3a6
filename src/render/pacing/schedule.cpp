#include "render/pacing/schedule.hpp"

#include "base/milliseconds.hpp"

namespace cumulet::render {

namespace {

constexpr double rest_ms = 100.0;
constexpr double held_rest_ms = 300.0;

}  // namespace

void Schedule::change(bool finish_answer) {
  const bool answers = state_ == State::answering || state_ == State::overtaken;
  state_ = answers && finish_answer ? State::overtaken : State::due;
}

void Schedule::begin() {
  if (state_ == State::due) state_ = State::answering;
}

void Schedule::complete() {
  if (state_ == State::answering) {
    state_ = State::refining;
  } else if (state_ == State::overtaken) {
    state_ = State::due;
  }
}

void Schedule::finish() {
  if (state_ == State::refining) state_ = State::done;
}

void Schedule::extend() {
  if (state_ == State::done) state_ = State::refining;
}

void Schedule::drop() {
  if (state_ != State::idle && state_ != State::failed) state_ = State::due;
}

void Schedule::fail() {
  if (state_ != State::idle) state_ = State::failed;
}

void Stillness::see(bool changed, bool held, Clock::time_point now) {
  if (changed) changed_ = now;
  let_go_ = !held && (held_ || (let_go_ && !changed));
  held_ = held;
}

bool Stillness::rests(Clock::time_point now) const {
  return let_go_ || milliseconds(now - changed_) >= (held_ ? held_rest_ms : rest_ms);
}

}  // namespace cumulet::render
