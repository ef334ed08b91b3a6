#include "frames.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <program.hpp>
#include <unordered_set>

namespace cumulet::demo {
namespace {

[[noreturn]] void refuse(std::string_view text, const std::string& why) {
  throw UsageError("'" + std::string(text) + "' " + why);
}

constexpr std::int64_t whole = 1000;  // thousandths
constexpr std::int64_t max_moments = std::int64_t{last_frame} + 1;

[[noreturn]] void refuse_number(std::string_view part, bool negative) {
  refuse(part, (negative ? "has a frame below " : "has a frame above ") +
                   std::to_string(negative ? first_frame : last_frame));
}

std::int64_t parse_digits(std::string_view digits, std::string_view part, bool negative) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool is_number = !digits.empty() && end == digits.data() + digits.size();
  if (!is_number || error == std::errc::invalid_argument)
    refuse(part, "is not a frame or a range, such as 5, 1-100x2 or 1-10x0.5");
  if (error != std::errc{} || number > std::uint64_t{last_frame}) refuse_number(part, negative);
  return static_cast<std::int64_t>(number);
}

/// Parses a frame number with up to three decimals; returns thousandths.
std::int64_t parse_moment(std::string_view text, std::string_view part) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  const auto point = text.find('.');
  std::int64_t moment = whole * parse_digits(text.substr(0, point), part, negative);
  if (point != std::string_view::npos) {
    const std::string_view decimals = text.substr(point + 1);
    if (decimals.size() > 3) refuse(part, "has more than three decimals");
    std::int64_t thousandths = parse_digits(decimals, part, negative);
    for (std::size_t i = decimals.size(); i < 3; ++i) thousandths *= 10;
    moment += thousandths;
    if (moment > whole * last_frame) refuse_number(part, negative);
  }
  return negative ? -moment : moment;
}

/// Splits the text at the first occurrence of a character at or after `from`. If there is none, the second part is
/// empty.
std::pair<std::string_view, std::string_view> cut(std::string_view text, char at, std::size_t from = 0) {
  const auto found = text.find(at, from);
  if (found == std::string_view::npos) return {text, {}};
  return {text.substr(0, found), text.substr(found + 1)};
}

}  // namespace

std::string Moment::part_text(std::size_t decimals) const {
  const std::size_t shown = std::max(decimals, this->decimals());
  if (shown == 0) return "";
  // -1.5 is stored as frame -2 and 500 thousandths.
  const std::int64_t part = is_negative() && is_between() ? whole - thousandths : thousandths;
  std::string digits = std::to_string(whole + part);
  digits.front() = '.';
  digits.resize(1 + shown, '0');
  return digits;
}

std::size_t Moment::decimals() const {
  std::size_t count = 3;
  for (std::int64_t rest = whole + thousandths; count > 0 && rest % 10 == 0; rest /= 10) --count;
  return count;
}

Moment Moment::of_thousandths(std::int64_t thousandths) {
  const std::int64_t rest = ((thousandths % whole) + whole) % whole;
  return {static_cast<Frame>((thousandths - rest) / whole), static_cast<std::uint32_t>(rest)};
}

std::string Moment::whole_text() const { return std::to_string(std::abs(in_thousandths()) / whole); }

std::string Moment::text() const {
  std::string text(is_negative() ? "-" : "");
  return text.append(whole_text()).append(part_text());
}

std::vector<Moment> parse_frames(std::string_view text) {
  std::vector<Moment> moments;
  std::unordered_set<std::int64_t> known;
  for (bool more = true; more;) {
    const auto comma = text.find(',');
    const std::string_view part = text.substr(0, comma);
    more = comma != std::string_view::npos;
    if (more) text.remove_prefix(comma + 1);

    const bool steps = part.find('x') != std::string_view::npos;
    const auto [range, step_text] = cut(part, 'x');
    // A leading minus is the sign of the first number; the next minus is the range operator.
    const std::size_t sign = range.starts_with('-') ? 1 : 0;
    const bool ranges = range.find('-', sign) != std::string_view::npos;
    const auto [first_text, last_text] = cut(range, '-', sign);
    if (steps && !ranges) refuse(part, "has a step, but is not a range");
    const std::int64_t first = parse_moment(first_text, part);
    const std::int64_t last = ranges ? parse_moment(last_text, part) : first;
    const std::int64_t step = steps ? parse_moment(step_text, part) : whole;
    if (last < first) refuse(part, "is a descending range");
    if (step == 0) refuse(part, "has a step of 0");
    if (step < 0) refuse(part, "has a negative step");
    if ((last - first) / step + static_cast<std::int64_t>(moments.size()) >= max_moments)
      refuse(part, "gives more than " + std::to_string(max_moments) + " frames");
    for (std::int64_t moment = first; moment <= last; moment += step)
      if (known.insert(moment).second) moments.push_back(Moment::of_thousandths(moment));
  }
  return moments;
}

std::string frames_text(const std::vector<Moment>& moments) {
  std::vector<Moment> sorted = moments;
  std::sort(sorted.begin(), sorted.end());
  std::string text;
  const auto follows = [&](std::size_t i) {
    return !sorted[i].is_between() && !sorted[i - 1].is_between() && sorted[i].frame == sorted[i - 1].frame + 1;
  };
  for (std::size_t i = 0; i < sorted.size();) {
    std::size_t end = i + 1;
    while (end < sorted.size() && follows(end)) ++end;
    if (!text.empty()) text += ", ";
    text += sorted[i].text();
    if (end - i > 1) text += (end - i > 2 ? "-" : ", ") + sorted[end - 1].text();
    i = end;
  }
  return text;
}

}  // namespace cumulet::demo
