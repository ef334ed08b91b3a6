#include "held_lines.hpp"

#include <program.hpp>
#include <utility>

namespace cumulet::demo {

void HeldLines::hold() {
  const std::lock_guard lock(mutex_);
  holds_ = true;
}

std::optional<std::string> HeldLines::take(cumulet_log_level level, const std::string& message) {
  const std::lock_guard lock(mutex_);
  if (!holds_) return line_of({level, message});
  held_.push_back({level, message});
  return std::nullopt;
}

std::vector<std::string> HeldLines::release(const std::string& failure) {
  const std::lock_guard lock(mutex_);
  holds_ = false;
  std::vector<std::string> lines;
  for (const Message& message : std::exchange(held_, {}))
    if (failure.empty() || !message.text.starts_with(failure)) lines.push_back(line_of(message));
  return lines;
}

std::string HeldLines::line_of(const Message& message) {
  const char* const kind = message.level == CUMULET_LOG_INFO      ? "note: "
                           : message.level == CUMULET_LOG_WARNING ? "warning: "
                                                                  : "error: ";
  return kind + one_line(message.text);
}

}  // namespace cumulet::demo
