#include "timeline.hpp"

#include <unistd.h>

#include <nlohmann/json.hpp>

namespace cumulet::demo {

void Timeline::add(void* user, const char* name, double begin, double end) {
  auto* timeline = static_cast<Timeline*>(user);
  const std::lock_guard lock(timeline->mutex_);
  timeline->events_.push_back({name, static_cast<long>(gettid()), begin, end});
}

std::string Timeline::json() const {
  using Json = nlohmann::ordered_json;
  constexpr double microseconds = 1e6;
  const std::lock_guard lock(mutex_);
  std::string text = "{\"traceEvents\": [";
  const char* separator = "\n";
  for (const Event& event : events_) {
    const Json line{{"name", event.name},
                    {"ph", "X"},
                    {"pid", getpid()},
                    {"tid", event.thread},
                    {"ts", microseconds * event.begin},
                    {"dur", microseconds * (event.end - event.begin)}};
    // A file name may have any encoding.
    text += separator + line.dump(-1, ' ', false, Json::error_handler_t::replace);
    separator = ",\n";
  }
  return text + "\n]}\n";
}

}  // namespace cumulet::demo
