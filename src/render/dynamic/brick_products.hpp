#pragma once

#include <cstdint>
#include <deque>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "render/dynamic/brick_kernels.hpp"
#include "render/dynamic/brick_moves.hpp"
#include "render/dynamic/device_memories.hpp"
#include "render/pacing/upload.hpp"
#include "scene/state_in_gl.hpp"

namespace cumulet::render {

/// Computes a product of a GPU-resident state's bricks (emission, scattering, anisotropy, momentum) in GL, in steps.
/// All calls need a current context and an active StateGuard.
class BrickProducts {
 public:
  /// Allocates nothing yet. body: must outlive this object. changed: origins of the bricks that differ from the
  /// previous state, including emptied ones; nullopt: there is no previous state. memories: holds the state's bricks.
  BrickProducts(gl::FunctionsPtr gl, gl::ProgramsPtr programs, DeviceMemoriesPtr memories, const light::BlackBody& body,
                const scene::StateInGl& state, scene::Product product,
                const std::optional<std::vector<glm::ivec3>>& changed);
  BrickProducts(const BrickProducts&) = delete;
  BrickProducts& operator=(const BrickProducts&) = delete;
  /// Works until the deadline, as Upload::advance(). Never waits for the device. Returns whether all is done.
  bool advance(Deadline deadline);
  [[nodiscard]] const scene::Product& product() const { return product_; }
  /// Returns the product; call it once after advance() returned true. before: the product of the previous state; null:
  /// there is none.
  [[nodiscard]] scene::ProductInGl take(const scene::ProductInGl* before);

 private:
  // A batch of bricks that fits a storage block; the vectors have one entry per component.
  struct Part {
    std::size_t first = 0;
    std::size_t count = 0;
    gl::Object packed_bricks;
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
  std::vector<volume::DeviceBricksPtr> fields_;  // null: the state has no such field, or the product does not need it
  volume::ValuesWantedPtr values_wanted_;
  std::vector<glm::ivec3> origins_;  // bricks that the product has values for
  std::vector<glm::ivec3> changed_;  // all changed bricks, including those that became empty
  glm::ivec3 bricks_{0};
  glm::mat3 to_relative_{1.0F};  // transforms velocities
  float most_ = 0.0F;
  gl::Object emissive_, tree_;
  BrickMoves moves_;
  std::deque<Part> parts_;
  gl::Fence fence_;
  Upload upload_;  // its steps use the members above
};

}  // namespace cumulet::render
