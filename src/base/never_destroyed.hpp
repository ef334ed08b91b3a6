#pragma once

#include <cstddef>
#include <new>
#include <utility>

namespace cumulet {

/// A static object whose destructor never runs, so that threads can use it while the process exits. The storage is a
/// member: this class leaks nothing if the library is unloaded.
template <class T>
class NeverDestroyed {
 public:
  template <class... Arguments>
  explicit NeverDestroyed(Arguments&&... arguments)
      : object_(new (storage_) T(std::forward<Arguments>(arguments)...)) {}
  NeverDestroyed(const NeverDestroyed&) = delete;
  NeverDestroyed& operator=(const NeverDestroyed&) = delete;

  [[nodiscard]] T& get() const { return *object_; }

 private:
  alignas(T) std::byte storage_[sizeof(T)];
  T* object_;
};

}  // namespace cumulet
