#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>

#include "model.hpp"

namespace cumulet::demo {

/// Controls the clock and the frame of the displayed sequence. Without a sequence its functions do nothing.
class SequenceClock {
 public:
  /// The model must outlive it.
  explicit SequenceClock(Model& model) : model_(model) {}

  /// Shows the frame with this index in the sequence.
  void go_to(std::uint32_t index);
  /// Shows the first or the last frame of the playback.
  void go_to_end(bool last);
  /// Plays the sequence that the volume's file belongs to.
  void play_row();
  /// Plays or pauses. At the end of a sequence that is not repeated it starts again at the beginning.
  void play_or_pause();
  /// Pauses and shows another frame. frames: negative for backwards.
  void step(int frames);
  /// Advances the clock and the sequence.
  void advance(double seconds);
  /// Plays the next sequence as soon as it is loaded, or not.
  void play_when_loaded(bool plays) { plays_when_loaded_ = plays; }
  /// Sets the clock after a change of the playback settings, so that the displayed frame stays. before: the settings
  /// that the viewer has. loads: files are still loading.
  void follow(const SceneSequence& before, bool loads);

 private:
  Model& model_;
  bool plays_when_loaded_ = false;
  const cumulet_sequence* known_ = nullptr;  // sequence that the clock belongs to
};

}  // namespace cumulet::demo
