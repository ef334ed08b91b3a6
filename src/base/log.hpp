#pragma once

#include <functional>
#include <string>
#include <utility>

#include "base/library_thread.hpp"

namespace cumulet {

enum class LogLevel { debug = 0, info = 1, warning = 2, error = 3 };

/// The host's log callback. The library never prints; without a callback messages are dropped. The callback may be
/// called from any thread.
class Log {
 public:
  using Function = std::function<void(LogLevel level, const char* message)>;

  Log() = default;
  explicit Log(Function function) : function_(std::move(function)) {}

  void write(LogLevel level, const std::string& message) const {
    if (!function_ || process_is_ending()) return;
    const CallbackScope inside;
    function_(level, message.c_str());
  }
  void info(const std::string& message) const { write(LogLevel::info, message); }
  void warning(const std::string& message) const { write(LogLevel::warning, message); }

 private:
  Function function_;
};

}  // namespace cumulet
