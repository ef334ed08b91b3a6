#pragma once

#include <cstddef>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "frame_plan.hpp"
#include "progress.hpp"

namespace cumulet::demo {

/// Prints one status line per frame.
class FrameReport {
 public:
  explicit FrameReport(const FramePlan& plan) : plan_(plan) {}
  void say(std::size_t index, FrameState state, const std::string& what, Progress* progress) {
    const Moment number = plan_.frames[index].number;
    if (progress != nullptr) progress->clear();
    std::cout << frame_line(number, index + 1, plan_.frames.size(), state, what) << std::endl;
    if (state == FrameState::failed) failed_.push_back(number);
  }
  /// Returns the text that the frames from `index` on have not been rendered.
  [[nodiscard]] std::string not_made(std::size_t index) const {
    std::vector<Moment> rest;
    for (std::size_t i = index; i < plan_.frames.size(); ++i) rest.push_back(plan_.frames[i].number);
    return (rest.size() > 1 ? "frames " : "frame ") + frames_text(rest) + " not rendered";
  }
  /// Throws if any frame failed.
  void end() const {
    if (failed_.empty()) return;
    throw std::runtime_error(std::to_string(failed_.size()) + " of " + std::to_string(plan_.frames.size()) +
                             " frames failed: " + frames_text(failed_));
  }

 private:
  const FramePlan& plan_;
  std::vector<Moment> failed_;
};

}  // namespace cumulet::demo
