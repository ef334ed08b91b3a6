#include "measurements.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <cmath>
#include <utility>

namespace cumulet::demo {

void Measurements::change(double now, std::uint64_t number) {
  if (changed_at_) return;
  changed_at_ = now;
  changed_number_ = number;
}

void Measurements::take_frame(const std::vector<Event>& events, bool drawn, bool picture, bool due, bool pending) {
  for (const Event& event : events)
    if (event.time > 0.0) frame_times_.hand(event.time);
  if (!drawn) {
    if (!pending && !due) frame_times_.rest();
    return;
  }
  if (const auto seconds = frame_times_.shown(glfwGetTime(), picture, due))
    charts_.frame_ms.add(static_cast<float>(1000.0 * *seconds));
}

void Measurements::take_status(const Status& status, std::uint64_t drawn, double now) {
  if (changed_at_ && drawn >= changed_number_)
    charts_.picture_ms.add(static_cast<float>(1000.0 * (glfwGetTime() - *std::exchange(changed_at_, std::nullopt))));

  const double device = device_seconds(status.stats);
  if (device > device_seconds_) charts_.device_ms.add(static_cast<float>(1000.0 * (device - device_seconds_)));
  device_seconds_ = device;

  constexpr double rate_period = 0.5;
  const bool more = (status.frame.flags & CUMULET_RENDER_INCOMPLETE) != 0;
  const bool preview = (status.frame.flags & CUMULET_RENDER_PREVIEW) != 0;
  // The first sample takes longer: the sizes of dispatches are still unknown.
  if (more && !preview && status.frame.width > 0 && status.frame.progress > 0.0)
    time_left_.see(status.frame.progress, now);
  else
    time_left_.rest();
  const double elapsed = now - rate_since_;
  // A decreasing count means that the image was restarted.
  if (status.stats.samples < rate_samples_ || !more) {
    rate_samples_ = status.stats.samples;
    rate_since_ = now;
  } else if (elapsed > rate_period && status.stats.samples > rate_samples_) {
    charts_.samples_per_second.add(
        static_cast<float>(static_cast<double>(status.stats.samples - rate_samples_) / elapsed));
    rate_samples_ = status.stats.samples;
    rate_since_ = now;
  }
}

std::optional<double> Measurements::seconds_left(const cumulet_sampling_desc& sampling) const {
  const auto seconds = time_left_.seconds(part_of_a_sample(sampling));
  return seconds ? std::optional(std::ceil(*seconds)) : std::nullopt;
}

}  // namespace cumulet::demo
