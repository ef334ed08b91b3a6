#pragma once

#include <chrono>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <type_traits>
#include <utility>
#include <variant>

#include "base/error.hpp"
#include "base/progress.hpp"

namespace cumulet {

/// Runs `work` on a background thread, or inline if too many such threads are active, none can be created, or the
/// process is exiting. `work` must own everything it touches, call no callback of the host and not throw. Unloading the
/// library and process exit wait for it, however long it takes.
void run_detached(const std::function<void()>& work);

/// Runs `work` by run_detached(). The future has its result, or the Error of its failure. what: names the work in it.
template <class Made, class Work>
std::future<Made> make_detached(const char* what, Work work) {
  const auto task = std::make_shared<std::packaged_task<Made()>>([what, work = std::move(work)] {
    try {
      return work();
    } catch (...) {
      throw caught(what);
    }
  });
  std::future<Made> made = task->get_future();
  run_detached([task] { (*task)(); });
  return made;
}

/// Runs `call`, which cannot be interrupted (a library's decoder, a sort), and returns its result. On cancellation it
/// throws Error(cancelled) within a few milliseconds, and `call` continues in the background. `call` must therefore own
/// everything it touches and call no callback of the host. Without a Progress it is called directly.
template <class Call>
std::invoke_result_t<Call&> run_cancellable(const Progress* progress, Call call) {
  if (progress == nullptr) return call();
  progress->check();
  // An exception is moved to the caller like a result, so that only the caller owns it.
  using Outcome = std::variant<std::invoke_result_t<Call&>, std::exception_ptr>;
  const auto task = std::make_shared<std::packaged_task<Outcome()>>([call = std::move(call)]() mutable {
    try {
      return Outcome(std::in_place_index<0>, call());
    } catch (...) {
      return Outcome(std::in_place_index<1>, std::current_exception());
    }
  });
  std::future<Outcome> result = task->get_future();
  run_detached([task] { (*task)(); });
  while (result.wait_for(std::chrono::milliseconds(5)) != std::future_status::ready) progress->check();
  Outcome outcome = result.get();
  if (outcome.index() == 1) std::rethrow_exception(std::get<1>(std::move(outcome)));
  return std::get<0>(std::move(outcome));
}

/// Creates a shared object that takes long to free (a tree of many nodes, gigabytes). It is deleted on a background
/// thread, so the last owner does not wait.
template <class T, class... Arguments>
std::shared_ptr<T> make_deferred_delete(Arguments&&... arguments) {
  auto whole = std::make_unique<T>(std::forward<Arguments>(arguments)...);
  return {whole.release(), [](T* last) { run_detached([last] { delete last; }); }};
}

}  // namespace cumulet
