#pragma once

#include <chrono>
#include <string>
#include <utility>

#include "base/library_thread.hpp"

namespace cumulet {

/// The host's trace callback. It is called at the end of every piece of work: frames, their passes, jobs. Any thread.
/// Without a callback no clock is read.
class Trace {
 public:
  /// begin, end: seconds of the steady clock.
  using Function = void (*)(void* user, const char* name, double begin, double end);

  Trace() = default;
  Trace(Function function, void* user) : function_(function), user_(user) {}

  /// Measures a piece of work, from construction to destruction.
  class Span {
   public:
    Span(const Trace& trace, std::string name) : trace_(trace) {
      if (trace_.function_ == nullptr) return;
      name_ = std::move(name);
      begin_ = now();
    }
    Span(const Span&) = delete;
    Span& operator=(const Span&) = delete;
    ~Span() {
      if (trace_.function_ == nullptr || process_is_ending()) return;
      const double end = now();
      const CallbackScope inside;
      trace_.function_(trace_.user_, name_.c_str(), begin_, end);
    }

   private:
    static double now() {
      return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    }
    const Trace& trace_;
    std::string name_;
    double begin_ = 0.0;
  };

 private:
  Function function_ = nullptr;
  void* user_ = nullptr;
};

}  // namespace cumulet
