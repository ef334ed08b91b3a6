#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "gl/programs.hpp"
#include "render/dynamic/device_memories.hpp"
#include "render/scene/shared_marches.hpp"

namespace cumulet::viewer {

/// Resources shared by viewers of one share group.
struct Commons {
  gl::ProgramsPtr programs;
  render::DeviceMemoriesPtr memories;
  render::SharedMarchesPtr marches;
};

/// Resources of viewers that share shader programs, per share group to which one of them is attached. Thread-safe.
class Sharing {
 public:
  explicit Sharing(std::shared_ptr<gl::ProgramFiles> files = nullptr,
                   std::shared_ptr<gl::ShaderFolder> shaders = nullptr)
      : programs_(std::move(files), std::move(shaders)) {}
  /// Returns the resources for the current context's share group. Throws on a GL error.
  Commons of_current(const gl::Functions& gl);

 private:
  struct Group {
    std::weak_ptr<gl::Programs> programs;
    std::weak_ptr<render::DeviceMemories> memories;
    std::weak_ptr<render::SharedMarches> marches;
  };
  std::mutex mutex_;
  gl::ProgramPool programs_;
  std::vector<Group> groups_;
};

}  // namespace cumulet::viewer
