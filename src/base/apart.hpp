#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <type_traits>
#include <utility>

#include "base/progress.hpp"

namespace cumulet {

/// Does it on a thread of its own, for nobody to wait for; here and now if too many such are under way, or the process
/// ends. It must own all that it touches, call nobody back and not throw. Unloading the library and the process' exit
/// wait for it.
void leave(const std::function<void()>& work);

/// What the call gives, for what cannot be interrupted: a library's decoder, a sort. Who is cancelled throws
/// Error(cancelled) within a few milliseconds, and the call is left to end by itself; so it must own all that it
/// touches, and call nobody back. Without a Progress it is just called.
template <class Call>
std::invoke_result_t<Call&> apart(const Progress* progress, Call call) {
  if (progress == nullptr) return call();
  progress->check();
  using Result = std::invoke_result_t<Call&>;
  const auto task = std::make_shared<std::packaged_task<Result()>>(std::move(call));
  std::future<Result> result = task->get_future();
  leave([task] { (*task)(); });
  while (result.wait_for(std::chrono::milliseconds(5)) != std::future_status::ready) progress->check();
  return result.get();
}

/// Owns what takes long to free, a tree of many nodes or gigabytes: its last owner does not wait for that.
template <class T, class... Arguments>
std::shared_ptr<T> make_left(Arguments&&... arguments) {
  auto whole = std::make_unique<T>(std::forward<Arguments>(arguments)...);
  return {whole.release(), [](T* last) { leave([last] { delete last; }); }};
}

}  // namespace cumulet
