#include "viewer/sharing.hpp"

#include <algorithm>

namespace cumulet::viewer {

Commons Sharing::of_current(const gl::Functions& gl) {
  const std::scoped_lock lock(mutex_);
  Commons commons{programs_.of_current(gl), nullptr, nullptr};
  std::erase_if(groups_, [](const Group& group) { return group.programs.expired() || group.memories.expired(); });
  const auto found =
      std::ranges::find_if(groups_, [&](const Group& group) { return group.programs.lock() == commons.programs; });
  if (found != groups_.end()) {
    commons.memories = found->memories.lock();
    commons.marches = found->marches.lock();
  }
  // The last viewer may be releasing them.
  if (!commons.memories || !commons.marches) {
    commons.memories = std::make_shared<render::DeviceMemories>(
        gl::copy_of(gl), commons.programs, static_cast<std::uint64_t>(gl::query_limits(gl).storage_block_bytes));
    commons.marches = std::make_shared<render::SharedMarches>(gl::copy_of(gl), commons.programs);
    groups_.push_back({commons.programs, commons.memories, commons.marches});
  }
  return commons;
}

}  // namespace cumulet::viewer
