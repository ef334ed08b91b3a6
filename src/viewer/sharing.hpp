#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "gl/programs.hpp"
#include "render/device_memories.hpp"

namespace cumulet::viewer {

/// What viewers of one share group have in common.
struct Commons {
  gl::ProgramsPtr programs;
  render::DeviceMemoriesPtr memories;
};

/// What viewers that share programs have in common: of each share group that one of them is attached to. Safe from any
/// thread.
class Sharing {
 public:
  explicit Sharing(std::shared_ptr<gl::ProgramFiles> files = nullptr,
                   std::shared_ptr<gl::ShaderFolder> shaders = nullptr)
      : programs_(std::move(files), std::move(shaders)) {}
  /// Of the current context's group. Throws on a GL error.
  Commons of_current(const gl::Functions& gl);

 private:
  struct Group {
    std::weak_ptr<gl::Programs> programs;
    std::weak_ptr<render::DeviceMemories> memories;
  };
  std::mutex mutex_;
  gl::ProgramPool programs_;
  std::vector<Group> groups_;
};

}  // namespace cumulet::viewer
