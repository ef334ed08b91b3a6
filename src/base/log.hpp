#pragma once

#include <string>

#include "base/callback_scope.hpp"

namespace cumulet {

enum class LogLevel { debug = 0, info = 1, warning = 2, error = 3 };

/// The host's log callback. The library never prints; without a callback the
/// message is dropped. May be called from any thread.
class Log {
 public:
  using Function = void (*)(void* user, LogLevel level, const char* message);

  Log() = default;
  Log(Function function, void* user) : function_(function), user_(user) {}

  void write(LogLevel level, const std::string& message) const {
    if (function_ == nullptr) return;
    const CallbackScope inside;
    function_(user_, level, message.c_str());
  }
  void info(const std::string& message) const { write(LogLevel::info, message); }
  void warning(const std::string& message) const { write(LogLevel::warning, message); }

 private:
  Function function_ = nullptr;
  void* user_ = nullptr;
};

}  // namespace cumulet
