#pragma once

#include <atomic>
#include <functional>
#include <thread>

namespace cumulet::demo {

/// Receives the signals by which a desktop or a terminal ends a program: SIGTERM, SIGINT and SIGHUP. The program can
/// then store the state for the next start. One object at a time.
class EndSignals {
 public:
  /// wake: called in another thread after the first signal. A second one ends the program as usual. Throws
  /// std::system_error.
  explicit EndSignals(std::function<void()> wake);
  EndSignals(const EndSignals&) = delete;
  EndSignals& operator=(const EndSignals&) = delete;
  /// The signals end the program again.
  ~EndSignals();

  [[nodiscard]] bool received() const { return received_; }

 private:
  void wait();

  std::function<void()> wake_;
  std::atomic<bool> received_ = false;
  int read_ = -1;  // end of the pipe that the handler writes to
  std::thread thread_;
};

}  // namespace cumulet::demo
