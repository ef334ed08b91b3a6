#include "frame_pattern.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <program.hpp>
#include <system_error>

namespace cumulet::demo {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_digits = 9;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Where the file's own name begins.
std::size_t name_begin(std::string_view path) {
  const auto slash = path.rfind('/');
  return slash == std::string_view::npos ? 0 : slash + 1;
}

std::size_t run_of_digits(std::string_view text, std::size_t from) {
  std::size_t length = 0;
  while (from + length < text.size() && is_digit(text[from + length])) ++length;
  return length;
}

struct Place {
  std::size_t at;
  std::size_t length;
  std::size_t digits;
};

/// The number at a place of the text; 0 for none, and more than most_digits for what is too much.
std::size_t number_at(std::string_view text, std::size_t at, std::size_t length) {
  std::size_t number = 0;
  const auto digits = text.substr(at, length);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return length > 0 && error != std::errc{} ? most_digits + 1 : number;
}

/// Something with digits between two words: "%" ... "d", "$F" ..., "<frame" ... ">".
std::optional<Place> worded(std::string_view path, std::size_t at, std::string_view before, std::string_view after) {
  if (path.substr(at, before.size()) != before) return std::nullopt;
  const std::size_t digits = run_of_digits(path, at + before.size());
  const std::size_t end = at + before.size() + digits;
  if (path.substr(end, after.size()) != after) return std::nullopt;
  return Place{at, end + after.size() - at, number_at(path, at + before.size(), digits)};
}

std::optional<Place> place_at(std::string_view path, std::size_t at) {
  std::size_t hashes = 0;
  while (at + hashes < path.size() && path[at + hashes] == '#') ++hashes;
  if (hashes > 0) return Place{at, hashes, hashes};
  if (const auto place = worded(path, at, "%", "d")) return place;
  if (const auto place = worded(path, at, "$F", "")) return place;
  return worded(path, at, "<frame", ">");
}

}  // namespace

std::optional<FramePattern> FramePattern::parse(const std::string& path) {
  std::optional<Place> found;
  for (std::size_t at = name_begin(path); at < path.size();) {
    const std::optional<Place> place = place_at(path, at);
    if (place && found) throw UsageError("'" + path + "' has two places for a frame's number");
    if (place) found = place;
    at += place ? place->length : 1;
  }
  if (!found) return std::nullopt;
  if (found->digits > most_digits)
    throw UsageError("'" + path + "' has a number of more than " + std::to_string(most_digits) + " digits");
  return FramePattern(path.substr(0, found->at), path.substr(found->at + found->length),
                      std::max<std::size_t>(found->digits, 1));
}

std::optional<FramePattern> FramePattern::of_file(const std::string& path) {
  const std::size_t begin = name_begin(path);
  const auto dot = path.rfind('.');
  std::size_t end = dot == std::string::npos || dot <= begin ? path.size() : dot;
  while (end > begin && !is_digit(path[end - 1])) --end;
  std::size_t first = end;
  while (first > begin && is_digit(path[first - 1])) --first;
  const std::size_t length = end - first;
  if (length == 0 || length > most_digits) return std::nullopt;
  FramePattern padded(path.substr(0, first), path.substr(end), length);
  if (length == 1 || path[first] == '0') return padded;
  const FramePattern plain(padded.head_, padded.tail_, 1);
  const std::vector<Frame> there = padded.frames_there();
  const bool zeros = std::ranges::any_of(there, [&](Frame frame) { return padded.file(frame) != plain.file(frame); });
  return zeros ? padded : plain;
}

std::string FramePattern::file(Frame frame) const { return file(Moment(frame)); }

std::string FramePattern::file(const Moment& moment, std::size_t decimals) const {
  const std::string number = std::to_string(moment.frame);
  return head_ + std::string(digits_ - std::min(digits_, number.size()), '0') + number + moment.part_text(decimals) +
         tail_;
}

std::optional<Frame> FramePattern::frame_of(std::string_view path) const {
  if (path.size() <= head_.size() + tail_.size() || !path.starts_with(head_) || !path.ends_with(tail_))
    return std::nullopt;
  const std::string_view digits = path.substr(head_.size(), path.size() - head_.size() - tail_.size());
  Frame frame = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), frame);
  if (error != std::errc{} || end != digits.data() + digits.size() || frame > last_frame) return std::nullopt;
  // Zeros more or less, and it is no file of these.
  return file(frame) == path ? std::optional(frame) : std::nullopt;
}

std::vector<Frame> FramePattern::frames_there() const {
  const std::string folder = head_.substr(0, name_begin(head_));
  std::vector<Frame> frames;
  std::error_code error;
  for (fs::directory_iterator entry(folder.empty() ? "." : folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (const auto frame = frame_of(folder + entry->path().filename().string())) frames.push_back(*frame);
  }
  std::ranges::sort(frames);
  return frames;
}

std::string FramePattern::text() const { return head_ + std::string(digits_, '#') + tail_; }

}  // namespace cumulet::demo
