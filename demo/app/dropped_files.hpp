#pragma once

#include <string>
#include <vector>

#include "model.hpp"

namespace cumulet::demo {

/// How files that were dropped on the window together are opened.
struct DroppedFiles {
  std::vector<Command> commands;
  std::vector<std::string> left_out;  // files that another one replaces
  bool plays = false;                 // a sequence is opened, which then plays
};

/// The first file of each kind is opened, and further volumes and models are added. Numbered files of one sequence are
/// opened as that sequence. Only the first scene and the first environment map are used.
[[nodiscard]] DroppedFiles open_dropped(const std::vector<std::string>& files);

}  // namespace cumulet::demo
