#include "frame_pattern.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <filesystem>
#include <program.hpp>
#include <system_error>

namespace cumulet::demo {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t max_digits = 9;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Returns the position where the file name begins, after the folder.
std::size_t name_begin(std::string_view path) {
  const auto slash = path.rfind('/');
  return slash == std::string_view::npos ? 0 : slash + 1;
}

std::size_t run_of_digits(std::string_view text, std::size_t from) {
  std::size_t length = 0;
  while (from + length < text.size() && is_digit(text[from + length])) ++length;
  return length;
}

struct Placeholder {
  std::size_t at;
  std::size_t length;
  std::size_t digits;
};

/// Parses the digits at a position; 0 if there are none, more than max_digits on overflow.
std::size_t number_at(std::string_view text, std::size_t at, std::size_t length) {
  std::size_t number = 0;
  const auto digits = text.substr(at, length);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return length > 0 && error != std::errc{} ? max_digits + 1 : number;
}

/// Matches digits between two strings: "%" ... "d", "$F" ..., "<frame" ... ">".
std::optional<Placeholder> worded(std::string_view path, std::size_t at, std::string_view before,
                                  std::string_view after) {
  if (path.substr(at, before.size()) != before) return std::nullopt;
  const std::size_t digits = run_of_digits(path, at + before.size());
  const std::size_t end = at + before.size() + digits;
  if (path.substr(end, after.size()) != after) return std::nullopt;
  return Placeholder{at, end + after.size() - at, number_at(path, at + before.size(), digits)};
}

std::optional<Placeholder> placeholder_at(std::string_view path, std::size_t at) {
  std::size_t hashes = 0;
  while (at + hashes < path.size() && path[at + hashes] == '#') ++hashes;
  if (hashes > 0) return Placeholder{at, hashes, hashes};
  if (const auto placeholder = worded(path, at, "%", "d")) return placeholder;
  if (const auto placeholder = worded(path, at, "$F", "")) return placeholder;
  return worded(path, at, "<frame", ">");
}

}  // namespace

std::optional<FramePattern> FramePattern::parse(const std::string& path) {
  std::optional<Placeholder> found;
  for (std::size_t at = name_begin(path); at < path.size();) {
    const std::optional<Placeholder> placeholder = placeholder_at(path, at);
    if (placeholder && found) throw UsageError("'" + path + "' has two placeholders for the frame number");
    if (placeholder) found = placeholder;
    at += placeholder ? placeholder->length : 1;
  }
  if (!found) return std::nullopt;
  if (found->digits > max_digits)
    throw UsageError("'" + path + "' has a number of more than " + std::to_string(max_digits) + " digits");
  return FramePattern(path.substr(0, found->at), path.substr(found->at + found->length),
                      std::max<std::size_t>(found->digits, 1));
}

std::optional<FramePattern> FramePattern::of_file(const std::string& path) {
  const std::size_t begin = name_begin(path);
  const auto dot = path.rfind('.');
  std::size_t end = dot == std::string::npos || dot <= begin ? path.size() : dot;
  // With several numbers in the name, the frame number is the one in which most files differ: in k_1001_v2.vdb it is
  // 1001, not the version. The last one is used if there is no difference.
  std::optional<FramePattern> found;
  std::size_t most = 0;
  while (end > begin) {
    while (end > begin && !is_digit(path[end - 1])) --end;
    if (end == begin) break;
    if (auto pattern = of_digits(path, end)) {
      const std::size_t files = std::max<std::size_t>(pattern->frames_there().size(), 1);
      if (files > most) found = std::move(pattern);
      most = std::max(most, files);
    }
    while (end > begin && is_digit(path[end - 1])) --end;
  }
  return found;
}

std::optional<FramePattern> FramePattern::of_digits(const std::string& path, std::size_t end) {
  const std::size_t begin = name_begin(path);
  std::size_t first = end;
  while (first > begin && is_digit(path[first - 1])) --first;
  const std::size_t length = end - first;
  if (length > max_digits) return std::nullopt;
  const bool minus = first > begin && path[first - 1] == '-';
  const bool is_sign = minus && (first - 1 == begin || std::isalnum(static_cast<unsigned char>(path[first - 2])) == 0);
  if (is_sign && path.find_first_not_of('0', first) < end) return of_negative(path, first - 1, end);
  FramePattern padded(path.substr(0, first), path.substr(end), length);
  padded.adopt_padding();
  if (length == 1 || path[first] == '0') return padded;
  const FramePattern plain(padded.head_, padded.tail_, 1);
  const std::vector<Frame> there = padded.frames_there();
  const bool zeros = std::ranges::any_of(there, [&](Frame frame) { return padded.file(frame) != plain.file(frame); });
  return zeros ? padded : plain;
}

FramePattern FramePattern::of_negative(const std::string& path, std::size_t sign, std::size_t end) {
  const std::string head = path.substr(0, sign);
  const std::string tail = path.substr(end);
  const std::size_t length = end - sign - 1;
  std::vector<FramePattern> possible;
  if (path[sign + 1] != '0') possible.push_back(FramePattern(head, tail, 1));
  possible.push_back(FramePattern(head, tail, length + 1));
  possible.push_back(FramePattern(head, tail, length, Padding::digits_only));
  return *std::ranges::max_element(possible, {}, [](const FramePattern& one) { return one.frames_there().size(); });
}

void FramePattern::adopt_padding() {
  const auto negative = [this](Padding padding) {
    return std::ranges::count_if(FramePattern(head_, tail_, digits_, padding).frames_there(),
                                 [](Frame frame) { return frame < 0; });
  };
  padding_ =
      negative(Padding::digits_only) > negative(Padding::sign_counts) ? Padding::digits_only : Padding::sign_counts;
}

std::string FramePattern::file(Frame frame) const { return file(Moment(frame)); }

std::string FramePattern::file(const Moment& moment, std::size_t decimals) const {
  const std::string sign = moment.is_negative() ? "-" : "";
  const std::string digits = moment.whole_text();
  const std::size_t taken = digits.size() + (padding_ == Padding::sign_counts ? sign.size() : 0);
  return head_ + sign + std::string(digits_ - std::min(digits_, taken), '0') + digits + moment.part_text(decimals) +
         tail_;
}

std::optional<std::string_view> FramePattern::number_in(std::string_view path) const {
  if (path.size() <= head_.size() + tail_.size() || !path.starts_with(head_) || !path.ends_with(tail_))
    return std::nullopt;
  const std::string_view number = path.substr(head_.size(), path.size() - head_.size() - tail_.size());
  const std::string_view digits = number.substr(number.starts_with('-') ? 1 : 0);
  return !digits.empty() && std::ranges::all_of(digits, is_digit) ? std::optional(number) : std::nullopt;
}

std::optional<Frame> FramePattern::frame_of(std::string_view path) const {
  const auto number = number_in(path);
  if (!number) return std::nullopt;
  Frame frame = 0;
  const auto [end, error] = std::from_chars(number->data(), number->data() + number->size(), frame);
  if (error != std::errc{} || frame > last_frame || frame < first_frame) return std::nullopt;
  // A file with another number of zeros does not belong to the sequence.
  return file(frame) == path ? std::optional(frame) : std::nullopt;
}

std::vector<std::string> FramePattern::files_alike() const {
  const std::string folder = head_.substr(0, name_begin(head_));
  std::vector<std::string> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder.empty() ? "." : folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::string path = folder + entry->path().filename().string();
    if (path.starts_with(head_) && path.ends_with(tail_)) files.push_back(std::move(path));
  }
  return files;
}

std::vector<Frame> FramePattern::frames_there() const {
  std::vector<Frame> frames;
  for (const std::string& path : files_alike())
    if (const auto frame = frame_of(path)) frames.push_back(*frame);
  std::ranges::sort(frames);
  return frames;
}

std::string FramePattern::passed_over() const {
  constexpr std::size_t max_named = 5;
  std::vector<std::string> names;
  for (const std::string& path : files_alike())
    if (number_in(path) && !frame_of(path)) names.push_back(path.substr(name_begin(path)));
  if (names.empty()) return "";
  std::ranges::sort(names);
  std::string line = text() + ": files ignored because their frame numbers have another padding: ";
  for (std::size_t i = 0; i < std::min(names.size(), max_named); ++i) line += (i > 0 ? ", " : "") + names[i];
  if (names.size() > max_named) line += " and " + std::to_string(names.size() - max_named) + " more";
  return line;
}

std::string FramePattern::text() const { return head_ + std::string(digits_, '#') + tail_; }

}  // namespace cumulet::demo
