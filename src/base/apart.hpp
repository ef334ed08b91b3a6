#pragma once

#include <chrono>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <type_traits>
#include <utility>
#include <variant>

#include "base/progress.hpp"

namespace cumulet {

/// Does it on a thread of its own, for nobody to wait for; here and now if too many such are under way, or the process
/// ends. It must own all that it touches, call nobody back and not throw. Unloading the library and the process' exit
/// wait for it, however long it takes.
void leave(const std::function<void()>& work);

/// What the call gives, for what cannot be interrupted: a library's decoder, a sort. Who is cancelled throws
/// Error(cancelled) within a few milliseconds, and the call is left to end by itself; so it must own all that it
/// touches, and call nobody back. Without a Progress it is just called.
template <class Call>
std::invoke_result_t<Call&> apart(const Progress* progress, Call call) {
  if (progress == nullptr) return call();
  progress->check();
  // What it throws is handed over like what it returns: none but the caller owns it then.
  using Outcome = std::variant<std::invoke_result_t<Call&>, std::exception_ptr>;
  const auto task = std::make_shared<std::packaged_task<Outcome()>>([call = std::move(call)]() mutable {
    try {
      return Outcome(std::in_place_index<0>, call());
    } catch (...) {
      return Outcome(std::in_place_index<1>, std::current_exception());
    }
  });
  std::future<Outcome> result = task->get_future();
  leave([task] { (*task)(); });
  while (result.wait_for(std::chrono::milliseconds(5)) != std::future_status::ready) progress->check();
  Outcome outcome = result.get();
  if (outcome.index() == 1) std::rethrow_exception(std::get<1>(std::move(outcome)));
  return std::get<0>(std::move(outcome));
}

/// Owns what takes long to free, a tree of many nodes or gigabytes: its last owner does not wait for that.
template <class T, class... Arguments>
std::shared_ptr<T> make_left(Arguments&&... arguments) {
  auto whole = std::make_unique<T>(std::forward<Arguments>(arguments)...);
  return {whole.release(), [](T* last) { leave([last] { delete last; }); }};
}

}  // namespace cumulet
