#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace cumulet::demo {

/// One line on standard error that says how far we are; silent unless that is a terminal.
class Progress {
 public:
  Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// Wipes the line.
  ~Progress();

  /// What comes is of this: it stands before every line. Empty: nothing does.
  void of(const std::string& what);
  /// A stage whose length is not known.
  void stage(const std::string& what);
  /// One of which a part is done, 0 to 1.
  void stage(const std::string& what, double part);
  /// Rendering, with part of what was asked for done, and so many samples. Rates are of what was done since the first
  /// call.
  void render(double part, double samples);
  /// Wipes the line, so that something else can be printed.
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

/// What Progress::render shows: `part` is done, `gained` of it, and `samples`, in the last `seconds`. The rates are
/// left out while so little was gained, or in so short a time, that they mean nothing.
[[nodiscard]] std::string rendering_line(double part, double gained, double samples, double seconds);

/// What is to be shown of a picture that ends at the first of two: part of its samples, or of the noise that is asked
/// for, is done, and seconds of the limit are over, if there is one.
[[nodiscard]] double part_done(double part, double seconds, std::optional<double> limit);

/// Why a picture ended.
enum class Ending { samples, noise, time };

/// How it went, for people: "noise 1.87 % (target 2 %) after 91 samples a pixel". noise is relative, and nothing where
/// it is unknown; target_percent and limit as they were asked for, if they were. samples: a pixel.
[[nodiscard]] std::string ending_line(Ending ending, std::optional<double> noise, double samples, double target_percent,
                                      std::optional<double> limit);

/// "1:05", "2:01:40", "0:00".
[[nodiscard]] std::string format_duration(double seconds);

}  // namespace cumulet::demo
