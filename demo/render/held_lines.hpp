#pragma once

#include <cumulet/cumulet.h>

#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace cumulet::demo {

/// Formats the library's messages as lines for standard error. Lines can be held back until the result of a frame is
/// known. All functions are thread-safe.
class HeldLines {
 public:
  /// Holds back the messages that follow.
  void hold();
  /// Returns the line to print now; nullopt while messages are held back.
  [[nodiscard]] std::optional<std::string> take(cumulet_log_level level, const std::string& message);
  /// Stops holding back. Returns the held lines in order, except messages that begin with `failure`, because the
  /// frame's own status line reports that. An empty `failure` excludes none.
  [[nodiscard]] std::vector<std::string> release(const std::string& failure = {});

 private:
  struct Message {
    cumulet_log_level level;
    std::string text;
  };
  [[nodiscard]] static std::string line_of(const Message& message);

  std::mutex mutex_;
  bool holds_ = false;
  std::vector<Message> held_;
};

}  // namespace cumulet::demo
