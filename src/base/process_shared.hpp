#pragma once

#include <functional>
#include <memory>

namespace cumulet {

/// Returns the object that users of threads in this process share, made by `make` unless one exists. There is one: the
/// list of library_thread.cpp keeps a weak reference to it. A forked child gets its own, because it has none of the
/// threads. Thread-safe.
[[nodiscard]] std::shared_ptr<void> shared_in_process(const std::function<std::shared_ptr<void>()>& make);

}  // namespace cumulet
