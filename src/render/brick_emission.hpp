#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "render/brick_kernels.hpp"
#include "render/device_memories.hpp"
#include "render/upload.hpp"
#include "scene/state_in_gl.hpp"

namespace cumulet::render {

/// Finds what bricks of temperature and flame give off, where they are: in GL, piece by piece. All calls need the
/// context current and a StateGuard around.
class BrickEmission {
 public:
  /// body: outlives it. changed: bricks that are other than in the state before, however they were changed; none: there
  /// was none. The memories have the state's. Allocates nothing yet.
  BrickEmission(gl::FunctionsPtr gl, gl::ProgramsPtr programs, DeviceMemoriesPtr memories, const light::BlackBody& body,
                const scene::StateInGl& state, scene::Emission settings,
                const std::optional<std::vector<glm::ivec3>>& changed);
  BrickEmission(const BrickEmission&) = delete;
  BrickEmission& operator=(const BrickEmission&) = delete;
  /// As Upload has it. Never waits.
  bool advance(Deadline deadline);
  [[nodiscard]] const scene::Emission& settings() const { return settings_; }
  /// Once that returned true. before: that of the state before; null where there was none.
  [[nodiscard]] scene::EmissionInGl take(const scene::EmissionInGl* before);

 private:
  // Bricks of one memory of each field, which one kernel is for.
  struct Burning {
    std::optional<std::uint32_t> temperature, flame;  // memories
    std::vector<glm::uvec3> bricks;                   // where to; in temperature's memory; in flame's
    gl::Object list;
  };
  // As many bricks as a storage block has room for.
  struct Part {
    std::size_t first = 0;
    std::size_t count = 0;
    std::vector<Burning> burning;
    gl::Object places;
    std::array<std::shared_ptr<volume::DeviceMemory>, 3> kept;
    std::array<gl::Object, 3> summaries;
    std::array<gl::ReadBack, 3> back;
  };
  void plan(Part& part);
  void make(Part& part);
  void emit(const Part& part, const Burning& burning, const gl::Program& program, std::uint32_t first,
            std::uint32_t end) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  DeviceMemoriesPtr memories_;
  const light::BlackBody& body_;
  scene::Emission settings_;
  glm::dmat4 index_to_world_;
  volume::DeviceBricksPtr temperature_, flame_;  // null: none that glows
  volume::ValuesWantedPtr values_wanted_;
  std::vector<glm::ivec3> origins_;  // of what glows
  std::vector<glm::ivec3> changed_;  // and of what does not any more
  glm::ivec3 bricks_{0};
  gl::Object glow_, tree_;
  std::deque<Part> parts_;
  gl::Fence fence_;
  Upload upload_;  // its steps use the above
};

}  // namespace cumulet::render
