#include "sequence_clock.hpp"

#include <algorithm>
#include <settings.hpp>
#include <utility>

namespace cumulet::demo {

void SequenceClock::go_to(std::uint32_t index) {
  const auto& play = model_.status.play;
  if (!play) return;
  static_cast<void>(cumulet_sequence_set_frame(play->sequence.get(), index));
  static_cast<void>(cumulet_sequence_get_time_of(play->sequence.get(), index, &model_.clock));
}

void SequenceClock::go_to_end(bool last) {
  const auto& play = model_.status.play;
  if (!play) return;
  const cumulet_playback_desc playback = playback_of(model_.scene.sequence, play->row);
  go_to(last ? playback.first_frame + std::max(playback.frame_count, 1U) - 1 : playback.first_frame);
}

void SequenceClock::step(int frames) {
  const auto& play = model_.status.play;
  if (!play) return;
  model_.playing = false;
  const auto last = static_cast<std::int64_t>(play->row.count()) - 1;
  go_to(
      static_cast<std::uint32_t>(std::clamp<std::int64_t>(std::int64_t{play->info.requested_frame} + frames, 0, last)));
}

void SequenceClock::play_or_pause() {
  const auto& play = model_.status.play;
  if (!play) return;
  model_.playing = !model_.playing;
  const cumulet_playback_desc playback = playback_of(model_.scene.sequence, play->row);
  const bool at_end = play->info.requested_frame >= playback.first_frame + playback.frame_count - 1;
  if (model_.playing && playback.repeat == CUMULET_REPEAT_HOLD && at_end) go_to(playback.first_frame);
}

void SequenceClock::play_row() {
  const auto& row = model_.status.neighbours;
  if (!row) return;
  SceneOptions& scene = model_.scene;
  for (std::uint32_t i = 0; i < row->count(); ++i)
    if (row->file(i) == scene.volume) scene.sequence.frame = row->number(i);
  scene.volume = row->pattern().text();
}

void SequenceClock::advance(double seconds) {
  const auto& play = model_.status.play;
  if (!play) {
    model_.playing = false;
    return;
  }
  model_.clock += seconds;
  const cumulet_playback_desc playback = playback_of(model_.scene.sequence, play->row);
  const double length = playback.frame_count / playback.frames_per_second;
  // With CUMULET_REPEAT_HOLD, playback stops at the last frame.
  if (playback.repeat == CUMULET_REPEAT_HOLD && model_.clock >= playback.offset_seconds + length) {
    model_.playing = false;
    go_to(playback.first_frame + playback.frame_count - 1);
    return;
  }
  static_cast<void>(cumulet_sequence_set_time(play->sequence.get(), model_.clock));
}

void SequenceClock::follow(const SceneSequence& before, bool loads) {
  const auto& play = model_.status.play;
  if (!loads && std::exchange(plays_when_loaded_, false) && play) model_.playing = true;
  if (!play) return;
  const cumulet_playback_desc now = playback_of(model_.scene.sequence, play->row);
  const bool known = std::exchange(known_, play->sequence.get()) == play->sequence.get();
  if (known && settings::same(now, playback_of(before, play->row))) return;
  // After a change of the playback settings the clock is set so that the displayed frame stays.
  model_.clock = now.offset_seconds + (double(play->info.requested_frame) - now.first_frame) / now.frames_per_second;
}

}  // namespace cumulet::demo
