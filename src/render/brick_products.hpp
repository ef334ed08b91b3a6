#pragma once

#include <cstdint>
#include <deque>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "render/brick_kernels.hpp"
#include "render/brick_moves.hpp"
#include "render/device_memories.hpp"
#include "render/upload.hpp"
#include "scene/state_in_gl.hpp"

namespace cumulet::render {

/// Makes of a state's bricks what volumes have beside them, where they are: in GL, piece by piece. All calls need the
/// context current and a StateGuard around.
class BrickProducts {
 public:
  /// body: outlives it. changed: bricks that are other than in the state before, however they were changed; none: there
  /// was none. The memories have the state's. Allocates nothing yet.
  BrickProducts(gl::FunctionsPtr gl, gl::ProgramsPtr programs, DeviceMemoriesPtr memories, const light::BlackBody& body,
                const scene::StateInGl& state, scene::Product product,
                const std::optional<std::vector<glm::ivec3>>& changed);
  BrickProducts(const BrickProducts&) = delete;
  BrickProducts& operator=(const BrickProducts&) = delete;
  /// As Upload has it. Never waits.
  bool advance(Deadline deadline);
  [[nodiscard]] const scene::Product& product() const { return product_; }
  /// Once that returned true. before: that of the state before; null where there was none.
  [[nodiscard]] scene::ProductInGl take(const scene::ProductInGl* before);

 private:
  // As many bricks as a storage block has room for; by component.
  struct Part {
    std::size_t first = 0;
    std::size_t count = 0;
    gl::Object places;
    std::vector<std::shared_ptr<volume::DeviceMemory>> kept;
    std::vector<gl::Object> summaries;
    std::vector<gl::ReadBack> back;
  };
  [[nodiscard]] std::size_t components() const;
  void find_origins(const std::optional<std::vector<glm::ivec3>>& changed);
  void prepare(const light::BlackBody& body, const glm::dmat4& index_to_world);
  void plan(Part& part);
  void make(Part& part);
  void multiply(const Part& part, std::size_t to, const gl::Program& program, std::uint32_t first,
                std::uint32_t end) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  DeviceMemoriesPtr memories_;
  scene::Product product_;
  std::vector<volume::DeviceBricksPtr> fields_;  // null: none, or none that counts
  volume::ValuesWantedPtr values_wanted_;
  std::vector<glm::ivec3> origins_;  // of what it is made of
  std::vector<glm::ivec3> changed_;  // and where it is nothing any more
  glm::ivec3 bricks_{0};
  glm::mat3 to_relative_{1.0F};  // of velocities
  float most_ = 0.0F;
  gl::Object glow_, tree_;
  BrickMoves moves_;
  std::deque<Part> parts_;
  gl::Fence fence_;
  Upload upload_;  // its steps use the above
};

}  // namespace cumulet::render
