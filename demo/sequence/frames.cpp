#include "frames.hpp"

#include <algorithm>
#include <charconv>
#include <program.hpp>
#include <unordered_set>

namespace cumulet::demo {
namespace {

[[noreturn]] void refuse(std::string_view text, const std::string& why) {
  throw UsageError("'" + std::string(text) + "' " + why);
}

Frame parse_frame(std::string_view digits, std::string_view whole) {
  Frame frame = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), frame);
  const bool number = !digits.empty() && end == digits.data() + digits.size();
  if (!number || error == std::errc::invalid_argument) refuse(whole, "is not a frame or a range, such as 5 or 1-100x2");
  if (error != std::errc{} || frame > last_frame) refuse(whole, "goes beyond frame " + std::to_string(last_frame));
  return frame;
}

/// What stands before the character, and what behind it; all and nothing, where it is not.
std::pair<std::string_view, std::string_view> cut(std::string_view text, char at) {
  const auto place = text.find(at);
  if (place == std::string_view::npos) return {text, {}};
  return {text.substr(0, place), text.substr(place + 1)};
}

}  // namespace

std::vector<Frame> parse_frames(std::string_view text) {
  std::vector<Frame> frames;
  std::unordered_set<Frame> known;
  for (bool more = true; more;) {
    const auto comma = text.find(',');
    const std::string_view part = text.substr(0, comma);
    more = comma != std::string_view::npos;
    if (more) text.remove_prefix(comma + 1);

    const bool steps = part.find('x') != std::string_view::npos;
    const auto [range, step_text] = cut(part, 'x');
    const bool ranges = range.find('-') != std::string_view::npos;
    const auto [first_text, last_text] = cut(range, '-');
    if (steps && !ranges) refuse(part, "has a step, but is no range");
    const Frame first = parse_frame(first_text, part);
    const Frame last = ranges ? parse_frame(last_text, part) : first;
    const Frame step = steps ? parse_frame(step_text, part) : 1;
    if (last < first) refuse(part, "runs backwards");
    if (step == 0) refuse(part, "has a step of 0");
    for (Frame frame = first; frame <= last; frame += step)
      if (known.insert(frame).second) frames.push_back(frame);
  }
  return frames;
}

std::string frames_text(const std::vector<Frame>& frames) {
  std::vector<Frame> sorted = frames;
  std::ranges::sort(sorted);
  std::string text;
  for (std::size_t i = 0; i < sorted.size();) {
    std::size_t end = i + 1;
    while (end < sorted.size() && sorted[end] == sorted[end - 1] + 1) ++end;
    if (!text.empty()) text += ", ";
    text += std::to_string(sorted[i]);
    if (end - i > 1) text += (end - i > 2 ? "-" : ", ") + std::to_string(sorted[end - 1]);
    i = end;
  }
  return text;
}

}  // namespace cumulet::demo
