#include "scene/playback.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace cumulet::scene {

namespace {

constexpr double rounding = 1e-6;  // tolerance, in frames

double wrapped(double x, double period) {
  const double rest = std::fmod(x, period);
  const double above = rest < 0.0 ? rest + period : rest;
  return above < period ? above : 0.0;  // rounding of a tiny negative x
}

double at_whole(double x) {
  const double whole = std::round(x);
  return std::abs(x - whole) < rounding ? whole : x;
}

}  // namespace

Moment moment_at(const Playback& playback, double seconds) {
  const double x = at_whole((seconds - playback.offset_seconds) * playback.frames_per_second);
  const double first = playback.first;
  const double last = playback.count - 1.0;
  if (playback.repeat == Repeat::loop) return {first + wrapped(x, playback.count), true};
  if (playback.repeat == Repeat::hold || last == 0.0) return {first + std::clamp(x, 0.0, last), true};
  const double y = wrapped(x, 2.0 * last);
  return y < last ? Moment{first + y, true} : Moment{first + 2.0 * last - y, false};
}

double time_of(const Playback& playback, double position) {
  return playback.offset_seconds + (position - playback.first) / playback.frames_per_second;
}

std::uint32_t step_of(const Playback& playback, const Moment& moment) {
  const double x = at_whole(moment.position * playback.steps);
  const auto step = static_cast<std::uint32_t>(std::max(0.0, moment.forward ? std::floor(x) : std::ceil(x)));
  const std::uint32_t last = (playback.first + playback.count - 1) * playback.steps;
  const bool around = playback.repeat == Repeat::loop && step > last && step < last + playback.steps;
  return around ? last : step;
}

std::vector<std::uint32_t> upcoming(const Playback& playback, const Moment& moment, bool forward) {
  const std::int64_t now = step_of(playback, moment);
  const std::int64_t first = std::int64_t{playback.first} * playback.steps;
  const std::int64_t last = first + std::int64_t{playback.count - 1} * playback.steps;
  std::vector<std::uint32_t> order;
  std::vector<bool> known(static_cast<std::size_t>(last - first + 1));
  const auto add = [&](std::int64_t step) {
    if (step < first || step > last || known[static_cast<std::size_t>(step - first)]) return;
    known[static_cast<std::size_t>(step - first)] = true;
    order.push_back(static_cast<std::uint32_t>(step));
  };
  const auto run = [&](std::int64_t from, std::int64_t to) {
    const std::int64_t by = from <= to ? 1 : -1;
    for (std::int64_t step = from; step != to + by; step += by) add(step);
  };
  // A position outside the played range continues at the nearer end.
  const std::int64_t begin = std::clamp(now, first, last);
  if (now != begin) order.push_back(static_cast<std::uint32_t>(now));
  const bool ascending = moment.forward == forward;
  run(begin, ascending ? last : first);
  if (playback.repeat == Repeat::loop) run(ascending ? first : last, begin);
  run(begin, ascending ? first : last);
  return order;
}

}  // namespace cumulet::scene
