#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace cumulet::demo {

/// An entry of the render queue: a picture or a sequence.
struct RenderEntry {
  enum class State { waiting, running, done, failed, cancelled };
  std::uint64_t number = 0;  // from 1
  std::string path;          // of the picture, or the pattern of a sequence
  State state = State::waiting;
  double part = 0.0;                        // completed fraction
  std::optional<double> seconds_left = {};  // nullopt: unknown
  std::string text = {};                    // current work, result, or cause of the failure

  [[nodiscard]] bool has_ended() const { return state != State::waiting && state != State::running; }
};

}  // namespace cumulet::demo
