#pragma once

#include <cumulet/cumulet.h>

#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "held_lines.hpp"
#include "progress.hpp"

namespace cumulet::demo {

/// What the library logs, as lines on standard error: notes, warnings and errors. Any thread.
class Messages {
 public:
  /// progress: is cleared before a line; it has to outlive this.
  explicit Messages(Progress& progress) : progress_(progress) {}

  /// For cumulet_create_desc::log. user: one of these.
  static void print(void* user, cumulet_log_level level, const char* message);

  /// As HeldLines has them.
  void hold() { lines_.hold(); }
  [[nodiscard]] std::vector<std::string> release(const std::string& failure = {}) { return lines_.release(failure); }

 private:
  // Whether the note is printed for the first time. Frames of a sequence have the same notes but for the file's name.
  bool is_new(const std::string& note);

  Progress& progress_;
  HeldLines lines_;
  std::mutex mutex_;
  std::set<std::string> notes_;
};

}  // namespace cumulet::demo
