#include "assets/sequence.hpp"

namespace cumulet::viewer {

namespace {

// Updates the clock. Returns true if the step changed, or if other steps come next.
bool go(SequenceState& state, const scene::Moment& to, bool forward) {
  const scene::Moment from = std::exchange(state.moment, to);
  const bool turned = std::exchange(state.forward, forward) != forward || from.forward != to.forward;
  return turned || scene::step_of(state.playback, from) != scene::step_of(state.playback, to);
}

}  // namespace

template <class Change>
void Sequence::edit(Change&& change) {
  {
    const std::scoped_lock lock(mutex_);
    if (!change(state_)) return;
    ++revision_;
  }
  listeners_.notify();
}

void Sequence::set_playback(const scene::Playback& playback) {
  edit([&](SequenceState& state) { return std::exchange(state.playback, playback) != playback; });
}

void Sequence::set_time(double seconds) {
  edit([&](SequenceState& state) {
    const bool forward = seconds_ && seconds != *seconds_ ? seconds > *seconds_ : state.forward;
    seconds_ = seconds;
    return go(state, scene::moment_at(state.playback, seconds), forward);
  });
}

void Sequence::set_position(double position) {
  edit([&](SequenceState& state) {
    const double before = state.moment.position;
    seconds_.reset();
    return go(state, {position, true}, position != before ? position > before : state.forward);
  });
}

SequenceState Sequence::get() const {
  const std::scoped_lock lock(mutex_);
  return state_;
}

std::uint64_t Sequence::revision() const {
  const std::scoped_lock lock(mutex_);
  return revision_;
}

}  // namespace cumulet::viewer
