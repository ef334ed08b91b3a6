#include "jobs/reported_failures.hpp"

namespace cumulet::viewer {

std::optional<Error> ReportedFailures::report(const ContentFailures& failures, Cancelled cancelled) {
  const std::scoped_lock lock(mutex_);
  for (std::size_t kind = 0; kind < content_kinds; ++kind) {
    const std::optional<Error>& failure = failures.by_kind.at(kind);
    std::optional<Reported>& reported = reported_.at(kind);
    if (!failure) {
      reported.reset();
      continue;
    }
    if (cancelled == Cancelled::left_out && failure->code() == ErrorCode::cancelled) continue;
    const bool known = reported && reported->failure.is_copy_of(*failure);
    if (known && reported->retired) continue;
    if (!known) reported.emplace(Reported{*failure});
    return failure;
  }
  return std::nullopt;
}

void ReportedFailures::retire() {
  const std::scoped_lock lock(mutex_);
  for (std::optional<Reported>& reported : reported_) {
    if (reported) reported->retired = true;
  }
}

}  // namespace cumulet::viewer
