#include "viewer/instance.hpp"

#include <utility>

namespace cumulet::viewer {

void Instance::edit(const std::function<void(InstanceSettings&)>& change) {
  {
    const std::scoped_lock lock(mutex_);
    change(settings_);
    ++revision_;
  }
  listeners_.tell();
}

InstanceSettings Instance::get() const {
  const std::scoped_lock lock(mutex_);
  return settings_;
}

std::uint64_t Instance::revision() const {
  const std::scoped_lock lock(mutex_);
  return revision_;
}

}  // namespace cumulet::viewer
