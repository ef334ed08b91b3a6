#include "render/scene/environment_data.hpp"

#include <utility>

#include "gl/bindings.hpp"

namespace cumulet::render {

void EnvironmentData::bind(const gl::Functions& gl) const { words_.bind(gl, core::CM_UNIT_ENVIRONMENT); }

EnvironmentUpload::EnvironmentUpload(gl::FunctionsPtr gl, gl::WordHeap& heap, light::EnvironmentPtr environment)
    : environment_(std::move(environment)), upload_(std::move(gl), "uploading the environment") {
  const light::Environment& e = *environment_;
  const std::size_t bytes = e.texels() * sizeof(glm::uvec4);
  data_.parameters_.size = {e.width, e.height};
  data_.parameters_.density = e.density;
  upload_.add([this, &heap, bytes] {
    data_.words_ = heap.take(bytes, "creating the environment");
    data_.parameters_.words = static_cast<std::uint32_t>(data_.words_.offset() / sizeof(glm::uvec4));
  });
  upload_.add_bytes(
      [this] {
        return Upload::Location{data_.words_.buffer(), data_.words_.offset()};
      },
      e.words.data(), bytes);
}

}  // namespace cumulet::render
