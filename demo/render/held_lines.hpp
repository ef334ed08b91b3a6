#pragma once

#include <cumulet/cumulet.h>

#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace cumulet::demo {

/// The library's messages as lines for standard error, which can be kept back until it is known how a frame ended. Any
/// thread may call any of its functions.
class HeldLines {
 public:
  /// Keeps the next ones back.
  void hold();
  /// The line to print now; nothing while lines are kept back.
  [[nodiscard]] std::optional<std::string> take(cumulet_log_level level, const std::string& message);
  /// Ends that. Returns the lines in the order of their messages, without those whose message begins with failure: the
  /// frame's own line says that. An empty failure is none.
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
