#pragma once

#include <mutex>
#include <string>
#include <vector>

namespace cumulet::demo {

/// What a viewer tells of its work, for chrome://tracing and Perfetto. Any thread.
class Timeline {
 public:
  /// Fits cumulet_trace_fn; user is the Timeline.
  static void add(void* user, const char* name, double begin, double end);
  /// Chrome's trace event format: JSON, a line an event.
  [[nodiscard]] std::string json() const;

 private:
  struct Event {
    std::string name;
    long thread;  // the system's number
    double begin;
    double end;
  };
  mutable std::mutex mutex_;
  std::vector<Event> events_;
};

}  // namespace cumulet::demo
