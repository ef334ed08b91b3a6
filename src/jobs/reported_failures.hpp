#pragma once

#include <array>
#include <cstddef>
#include <mutex>
#include <optional>

#include "base/error.hpp"

namespace cumulet::viewer {

/// Kinds of content that a viewer loads and builds, in the order in which failures are reported.
enum class ContentKind { volume, instances, surfaces, models, environment };
inline constexpr std::size_t content_kinds = 5;

/// Failure of the last work of each kind, if any.
struct ContentFailures {
  std::array<std::optional<Error>, content_kinds> by_kind;

  std::optional<Error>& operator[](ContentKind kind) { return by_kind.at(static_cast<std::size_t>(kind)); }
  const std::optional<Error>& operator[](ContentKind kind) const { return by_kind.at(static_cast<std::size_t>(kind)); }
};

/// Tracks which failures have been reported. A reported failure is reported again until other work begins, and not
/// after that. All calls are thread-safe.
class ReportedFailures {
 public:
  enum class Cancelled { reported, left_out };
  /// Returns the first failure to report and marks it as reported.
  std::optional<Error> report(const ContentFailures& failures, Cancelled cancelled);
  /// Must be called when other work begins.
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
