#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace cumulet::demo {

/// A progress line on standard error; prints nothing unless that is a terminal.
class Progress {
 public:
  Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// Clears the line.
  ~Progress();

  /// Sets a prefix of all lines that follow; "": no prefix.
  void of(const std::string& what);
  /// Shows a stage of unknown length.
  void stage(const std::string& what);
  /// Shows a stage with the completed fraction, 0 to 1.
  void stage(const std::string& what, double part);
  /// Shows the rendering stage. part: completed fraction; samples: total number so far. Rates count from the first
  /// call.
  void render(double part, double samples);
  /// Clears the line, so that something else can be printed.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  void show(const std::string& line);

  bool terminal_;
  std::string before_;
  bool shown_ = false;
  Clock::time_point start_;
  double start_part_ = 0.0;
  double start_samples_ = 0.0;
  bool rendering_ = false;
};

/// Returns the text of Progress::render. part: completed fraction; gained and samples: progress during the last
/// `seconds`. The rates are omitted if the gain or the time is too small for a meaningful value.
[[nodiscard]] std::string rendering_line(double part, double gained, double samples, double seconds);

/// Returns the completed fraction of an image that ends at the time limit or when `part` reaches 1, whichever is first.
/// part: completed fraction of the samples or of the noise target; seconds: elapsed time.
[[nodiscard]] double part_done(double part, double seconds, std::optional<double> limit);

/// Reason why rendering ended.
enum class Ending { samples, noise, time };

/// Returns a summary: "noise 1.87 % (target 2 %) after 91 samples per pixel in 0:42". noise: relative, nullopt if
/// unknown. target_percent, limit: as requested, 0 or nullopt if not. samples: per pixel. seconds: of rendering.
[[nodiscard]] std::string ending_line(Ending ending, std::optional<double> noise, double samples, double target_percent,
                                      std::optional<double> limit, double seconds);

/// Formats a time as "1:05", "2:01:40" or "0:00".
[[nodiscard]] std::string format_duration(double seconds);

}  // namespace cumulet::demo
