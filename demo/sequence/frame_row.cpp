#include "frame_row.hpp"

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace cumulet::demo {
namespace {

constexpr std::uint32_t max_played = 1'000'000;  // limit of the library

}  // namespace

Frame step_of(const std::vector<Frame>& there) {
  Frame step = 0;
  for (const Frame frame : there) step = std::gcd(step, frame - there.front());
  return std::max(step, Frame{1});
}

std::vector<std::string> by_size(const std::vector<std::string>& files) {
  std::vector<std::pair<std::uintmax_t, std::string>> sized;
  for (const std::string& file : files) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    sized.emplace_back(error ? 0 : size, file);
  }
  std::ranges::stable_sort(sized, [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::string> sorted;
  sorted.reserve(sized.size());
  for (auto& [size, file] : sized) sorted.push_back(std::move(file));
  return sorted;
}

FrameRow::FrameRow(FramePattern pattern, const std::vector<Frame>& there)
    : pattern_(std::move(pattern)), first_(there.front()), step_(step_of(there)) {
  count_ = static_cast<std::uint32_t>((there.back() - first_) / step_) + 1;
}

std::optional<FrameRow> FrameRow::of_name(const std::string& name) {
  std::error_code error;
  if (name.empty() || std::filesystem::exists(name, error)) return std::nullopt;
  auto pattern = FramePattern::parse(name);
  if (!pattern) return std::nullopt;
  pattern->adopt_padding();
  const std::vector<Frame> there = pattern->frames_there();
  if (there.empty()) throw std::runtime_error(pattern->text() + ": no matching file exists");
  const FrameRow row(*pattern, there);
  if (row.count() > max_played)
    throw std::runtime_error(pattern->text() + ": the range from the first to the last file has more than " +
                             std::to_string(max_played) + " frames");
  return row;
}

std::optional<FrameRow> FrameRow::around(const std::string& file) {
  auto pattern = FramePattern::of_file(file);
  if (!pattern) return std::nullopt;
  const std::vector<Frame> there = pattern->frames_there();
  if (there.size() < 2) return std::nullopt;
  const FrameRow row(*std::move(pattern), there);
  return row.count() <= max_played ? std::optional(row) : std::nullopt;
}

std::uint32_t FrameRow::index_of(Frame number) const {
  if (number <= first_) return 0;
  return std::min(static_cast<std::uint32_t>((number - first_ + step_ / 2) / step_), count_ - 1);
}

std::vector<std::string> FrameRow::files() const {
  std::vector<std::string> all;
  all.reserve(count_);
  for (std::uint32_t i = 0; i < count_; ++i) all.push_back(file(i));
  return all;
}

double FrameRow::position_of(const Moment& moment) const {
  const double from_first = double(moment.frame) - first_ + moment.thousandths / 1000.0;
  return std::clamp(from_first / step_, 0.0, count_ - 1.0);
}

}  // namespace cumulet::demo
