#include "messages.hpp"

#include <algorithm>
#include <cstdio>
#include <program.hpp>

namespace cumulet::demo {

void Messages::print(void* user, cumulet_log_level level, const char* message) {
  if (level < CUMULET_LOG_INFO) return;
  auto& messages = *static_cast<Messages*>(user);
  if (level == CUMULET_LOG_INFO && !messages.is_new(one_line(message))) return;
  const auto line = messages.lines_.take(level, message);
  if (!line) return;
  messages.progress_.clear();
  std::fprintf(stderr, "%s\n", line->c_str());
}

bool Messages::is_new(const std::string& note) {
  const std::lock_guard lock(mutex_);
  return notes_.insert(note.substr(std::min(note.find(": "), note.size()))).second;
}

}  // namespace cumulet::demo
