#pragma once

#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <utility>

namespace cumulet {

/// Change listeners of an object. All calls are safe from any thread.
class Listeners {
 public:
  /// Calls `changed` in every notify(), on the thread of notify(), until the returned token is destroyed. After that no
  /// call is under way. `changed` must not throw, call listen() or destroy a token.
  [[nodiscard]] std::shared_ptr<void> listen(std::function<void()> changed) {
    const std::scoped_lock lock(all_->mutex);
    const auto call = all_->calls.insert(all_->calls.end(), std::move(changed));
    return {nullptr, [all = all_, call](void*) {
              const std::scoped_lock deleting(all->mutex);
              all->calls.erase(call);
            }};
  }

  void notify() const {
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
