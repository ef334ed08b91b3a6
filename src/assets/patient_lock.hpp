#pragma once

#include <chrono>
#include <mutex>
#include <thread>

#include "base/progress.hpp"

namespace cumulet::viewer {

/// Locks a mutex that may be held for seconds; the wait can be cancelled. Throws Error(cancelled).
inline std::unique_lock<std::mutex> patient_lock(std::mutex& mutex, const Progress& progress) {
  std::unique_lock lock(mutex, std::try_to_lock);
  while (!lock.owns_lock()) {
    progress.check();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    (void)lock.try_lock();
  }
  return lock;
}

}  // namespace cumulet::viewer
