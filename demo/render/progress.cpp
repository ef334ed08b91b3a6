#include "progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace cumulet::demo {
namespace {

constexpr int bar_width = 24;
constexpr double min_seconds = 0.3;

/// Formats a count as "12.3 M": three digits, for display only.
std::string format_count(double count) {
  const char* unit = "";
  for (const char* next : {"k", "M", "G", "T"}) {
    if (count < 1000.0) break;
    count /= 1000.0;
    unit = next;
  }
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g %s", std::min(count, 999.0), unit);
  return text.data();
}

std::string bar(double part) {
  part = std::clamp(part, 0.0, 1.0);
  const auto filled = static_cast<std::size_t>(part * bar_width);
  std::string line = "[";
  line.append(filled, '#').append(bar_width - filled, '.').append("] ");
  return line.append(std::to_string(static_cast<int>(part * 100.0))).append(" %");
}

}  // namespace

std::string format_duration(double seconds) {
  if (!(seconds < 1e6)) return "-:--";
  const auto all = static_cast<long>(std::lround(std::max(seconds, 0.0)));
  std::array<char, 64> text{};
  if (all >= 3600)
    std::snprintf(text.data(), text.size(), "%ld:%02ld:%02ld", all / 3600, all / 60 % 60, all % 60);
  else
    std::snprintf(text.data(), text.size(), "%ld:%02ld", all / 60, all % 60);
  return text.data();
}

Progress::Progress() : terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() { clear(); }

void Progress::of(const std::string& what) { before_ = what.empty() ? "" : what + ": "; }

void Progress::stage(const std::string& what) {
  rendering_ = false;
  show(what + " ...");
}

void Progress::stage(const std::string& what, double part) {
  rendering_ = false;
  show(what + " " + bar(part));
}

void Progress::render(double part, double samples) {
  if (!rendering_) {
    start_ = Clock::now();
    start_part_ = part;
    start_samples_ = samples;
  }
  rendering_ = true;
  show(rendering_line(part, part - start_part_, samples - start_samples_,
                      std::chrono::duration<double>(Clock::now() - start_).count()));
}

double part_done(double part, double seconds, std::optional<double> limit) {
  return limit ? std::clamp(std::max(part, seconds / *limit), 0.0, 1.0) : part;
}

std::string ending_line(Ending ending, std::optional<double> noise, double samples, double target_percent,
                        std::optional<double> limit, double seconds) {
  const auto number = [](const char* format, double value) {
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), format, value);
    return std::string(text.data());
  };
  std::string line = "noise " + (noise ? number("%.3g", 100.0 * *noise) + " %" : std::string("unknown"));
  if (target_percent > 0.0) line += " (target " + number("%g", target_percent) + " %)";
  line += " after " + number("%.4g", samples) + (samples == 1.0 ? " sample per pixel" : " samples per pixel");
  line += " in " + format_duration(seconds);
  if (ending == Ending::samples && (target_percent > 0.0 || limit)) line += ", the maximum";
  if (ending == Ending::time && limit) line += ", stopped at the time limit of " + number("%g", *limit) + " s";
  return line;
}

std::string rendering_line(double part, double gained, double samples, double seconds) {
  part = std::clamp(part, 0.0, 1.0);
  std::string line = "rendering " + bar(part);
  if (gained > 0.0 && seconds >= min_seconds) {
    line += "  " + format_count(samples / seconds) + "samples/s";
    line += "  ETA " + format_duration(seconds * (1.0 - part) / gained);
  }
  return line;
}

void Progress::clear() {
  if (shown_) std::fputs("\r\033[K", stderr);
  shown_ = false;
}

void Progress::show(const std::string& line) {
  if (!terminal_) return;
  std::fprintf(stderr, "\r%s%s\033[K", before_.c_str(), line.c_str());
  std::fflush(stderr);
  shown_ = true;
}

}  // namespace cumulet::demo
