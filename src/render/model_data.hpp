#pragma once

#include <memory>

#include "gl/objects.hpp"
#include "gl/word_heap.hpp"
#include "light/scene_lights.hpp"
#include "render/upload.hpp"
#include "scene/model_source.hpp"

namespace cumulet::render {

/// What paths read of a scene::ModelSource on the GPU. All calls need the context current and a StateGuard around.
class ModelData {
 public:
  /// Plans how it comes to GL: it is whole when all steps are done, and they may not outlive it. Images are shared with
  /// `last` (may be null) where the scene is the same. Throws Error(unsupported).
  static std::unique_ptr<ModelData> plan(const gl::FunctionsPtr& gl, const gl::Limits& limits, gl::WordHeap& heap,
                                         Upload& upload, const scene::ModelSource& source, const ModelData* last);
  void bind(const gl::Functions& gl) const;
  [[nodiscard]] const core::CmSurfaceTables& tables() const { return tables_; }
  [[nodiscard]] const light::SceneLights& lights() const { return lights_; }
  /// What it is of, to tell one from another.
  [[nodiscard]] const surface::Scene* scene() const { return scene_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  gl::WordHeap::Span words_;
  std::shared_ptr<gl::Object> atlas_;
  const surface::Scene* scene_ = nullptr;
  core::CmSurfaceTables tables_{};
  light::SceneLights lights_;
  std::uint64_t bytes_ = 0;
};

}  // namespace cumulet::render
