#pragma once

#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <utility>

namespace cumulet {

/// Who is told of changes of a thing. All calls are safe from any thread.
class Listeners {
 public:
  /// Calls changed with every tell(), on its thread, until the token is gone; then no call is under way any more. It
  /// must not throw, nor listen or end a token.
  [[nodiscard]] std::shared_ptr<void> listen(std::function<void()> changed) {
    const std::scoped_lock lock(all_->mutex);
    const auto place = all_->calls.insert(all_->calls.end(), std::move(changed));
    return {nullptr, [all = all_, place](void*) {
              const std::scoped_lock deleting(all->mutex);
              all->calls.erase(place);
            }};
  }

  void tell() const {
    const std::scoped_lock lock(all_->mutex);
    for (const auto& call : all_->calls) call();
  }

 private:
  struct All {
    std::mutex mutex;
    std::list<std::function<void()>> calls;
  };
  std::shared_ptr<All> all_ = std::make_shared<All>();
};

}  // namespace cumulet
