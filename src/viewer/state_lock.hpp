#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "base/fair_mutex.hpp"
#include "base/log.hpp"

namespace cumulet::viewer {

/// The lock of the state that settings and input change. Functions of GL hold it only while they take or update that
/// state. While a thread holds it, its log lines and notifications are collected; they reach the host after the
/// release, so that no such callback of this viewer runs under the lock. The update callback of another viewer may, if
/// the viewers share a camera. All calls are safe from any thread.
class StateLock {
 public:
  /// update: calls the host's update callback.
  StateLock(Log log, std::function<void()> update) : log_(std::move(log)), update_(std::move(update)) {}
  StateLock(const StateLock&) = delete;
  StateLock& operator=(const StateLock&) = delete;

  /// Holds the lock as long as it exists. A thread must not hold it twice.
  class Held {
   public:
    explicit Held(StateLock& lock) : lock_(lock) { lock_.mutex_.lock(); }
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;
    ~Held();

   private:
    StateLock& lock_;
  };

  /// Returns a log whose lines go through this object, which must outlive its use.
  [[nodiscard]] Log log();
  void notify();

 private:
  struct Line {
    LogLevel level;
    std::string text;
  };
  struct Collected {
    std::vector<Line> lines;
    bool update = false;
  };
  Log log_;
  std::function<void()> update_;
  FairMutex mutex_;
  Collected collected_;  // guarded by mutex_
};

}  // namespace cumulet::viewer
