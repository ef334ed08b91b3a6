#pragma once

#include <cumulet/cumulet.h>

#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "held_lines.hpp"
#include "progress.hpp"

namespace cumulet::demo {

/// Prints the library's log to standard error: notes, warnings and errors. Any thread.
class Messages {
 public:
  /// progress: cleared before each line; must outlive this object.
  explicit Messages(Progress& progress) : progress_(progress) {}

  /// Callback for cumulet_create_desc::log. user: a Messages object.
  static void print(void* user, cumulet_log_level level, const char* message);

  /// See HeldLines.
  void hold() { lines_.hold(); }
  [[nodiscard]] std::vector<std::string> release(const std::string& failure = {}) { return lines_.release(failure); }

 private:
  // Returns true if the note was not printed before. Notes are compared without the file name, so that the frames of a
  // sequence do not repeat them.
  bool is_new(const std::string& note);

  Progress& progress_;
  HeldLines lines_;
  std::mutex mutex_;
  std::set<std::string> notes_;
};

}  // namespace cumulet::demo
