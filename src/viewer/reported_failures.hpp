#pragma once

#include <array>
#include <cstddef>
#include <mutex>
#include <optional>

#include "base/error.hpp"

namespace cumulet::viewer {

/// What a viewer reads and builds, in the order in which failures are reported.
enum class ContentKind { volume, instances, surfaces, models, environment };
inline constexpr std::size_t content_kinds = 5;

/// How the last work of each kind ended, if not well.
struct ContentFailures {
  std::array<std::optional<Error>, content_kinds> by_kind;

  std::optional<Error>& operator[](ContentKind kind) { return by_kind.at(static_cast<std::size_t>(kind)); }
  const std::optional<Error>& operator[](ContentKind kind) const { return by_kind.at(static_cast<std::size_t>(kind)); }
};

/// Which failures have been reported, so that none sticks: a failure that was reported once is reported on until other
/// work begins, and not after that. All calls are safe from any thread.
class ReportedFailures {
 public:
  enum class Cancelled { reported, left_out };
  /// The first failure that is to be reported, which then has been.
  std::optional<Error> report(const ContentFailures& failures, Cancelled cancelled);
  /// Other work begins.
  void retire();

 private:
  struct Reported {
    Error failure;
    bool retired = false;
  };
  std::mutex mutex_;
  std::array<std::optional<Reported>, content_kinds> reported_;
};

}  // namespace cumulet::viewer
