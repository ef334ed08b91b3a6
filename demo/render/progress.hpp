#pragma once

#include <chrono>
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

  /// A stage whose length is not known.
  void stage(const std::string& what);
  /// One of which a part is done, 0 to 1.
  void stage(const std::string& what, double part);
  /// Rendering, with part of all samples done; total is their number. Rates are of what was done since the first call.
  void render(double part, double total);
  /// Wipes the line, so that something else can be printed.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  void show(const std::string& line);

  bool terminal_;
  bool shown_ = false;
  Clock::time_point start_;
  double start_part_ = 0.0;
  bool rendering_ = false;
};

/// What Progress::render shows: `part` of `total` samples are done, `gained` of it in the last `seconds`. The rates are
/// left out while so little was gained, or in so short a time, that they mean nothing.
[[nodiscard]] std::string rendering_line(double part, double gained, double seconds, double total);

/// "1:05", "2:01:40", "0:00".
[[nodiscard]] std::string format_duration(double seconds);

}  // namespace cumulet::demo
