#pragma once

#include <mutex>
#include <string>
#include <vector>

namespace cumulet::demo {

/// Collects the trace events of a viewer for chrome://tracing and Perfetto. Any thread.
class Timeline {
 public:
  /// Matches cumulet_trace_fn. user: the Timeline.
  static void add(void* user, const char* name, double begin, double end);
  /// Returns Chrome's trace event format: JSON, one line per event.
  [[nodiscard]] std::string json() const;

 private:
  struct Event {
    std::string name;
    long thread;  // thread ID of the operating system
    double begin;
    double end;
  };
  mutable std::mutex mutex_;
  std::vector<Event> events_;
};

}  // namespace cumulet::demo
