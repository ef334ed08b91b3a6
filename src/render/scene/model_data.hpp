#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "gl/objects.hpp"
#include "gl/word_heap.hpp"
#include "render/pacing/upload.hpp"
#include "scene/model_table.hpp"

namespace cumulet::render {

/// Surfaces of a scene on the GPU as paths read them, once per source, independent of instance transforms. All calls
/// need a current context and an active StateGuard.
class ModelData {
 public:
  using Sources = std::vector<scene::ModelSourcePtr>;

  /// Plans the upload steps. The data are complete when all steps are done. The steps must not outlive the data or
  /// `last`, which may be null. Sources that `last` has are copied from there, and images are shared if they are the
  /// same. Throws Error(unsupported).
  static std::shared_ptr<ModelData> plan(const gl::FunctionsPtr& gl, const gl::Limits& limits, gl::WordHeap& heap,
                                         Upload& upload, const Sources& sources,
                                         const std::shared_ptr<const ModelData>& last);
  void bind(const gl::Functions& gl) const;
  /// Returns the word offsets of one of the sources.
  [[nodiscard]] scene::ModelWords words_of(const scene::ModelSource& source) const;
  /// Word offsets of the tables of surface::GgxAlbedo.
  [[nodiscard]] std::uint32_t ggx_albedo() const { return first_word() + ggx_albedo_; }
  [[nodiscard]] std::uint32_t ggx_albedo_averages() const { return first_word() + ggx_albedo_averages_; }
  /// Word offset of surface::SheenAlbedo, if any source has extended materials.
  [[nodiscard]] std::uint32_t sheen_albedo() const { return first_word() + sheen_albedo_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  struct Part {
    scene::ModelSourcePtr source;
    std::uint32_t first = 0;     // from the first word of all sources
    std::uint32_t textures = 0;  // from the first word of all sources
  };
  struct Atlas {
    gl::Object texture;
    scene::TextureAtlas layout;
    std::vector<scene::TextureImagesPtr> images;
  };
  [[nodiscard]] std::uint32_t first_word() const {
    return static_cast<std::uint32_t>(words_.offset() / sizeof(glm::uvec4));
  }
  void add_common(std::uint32_t first);

  gl::WordHeap::Span words_;
  std::vector<Part> parts_;
  std::vector<glm::uvec4> common_;  // shared by all sources: textures, then reflection tables
  std::shared_ptr<Atlas> atlas_;
  std::uint32_t ggx_albedo_ = 0;
  std::uint32_t ggx_albedo_averages_ = 0;
  std::uint32_t sheen_albedo_ = 0;
  std::uint64_t bytes_ = 0;
};
using ModelDataPtr = std::shared_ptr<const ModelData>;

/// Instance table of the models: their transforms, and other data that change when a model moves. All calls need a
/// current context and an active StateGuard.
class ModelInstances {
 public:
  /// models: their sources are in the data. last: the previous table, or null. Throws as scene::make_model_table(), and
  /// Error(unsupported) if the table exceeds a limit of the driver.
  static ModelInstances make(const gl::FunctionsPtr& gl, const gl::Limits& limits, std::vector<scene::Model> models,
                             ModelDataPtr data, const ModelInstances* last);
  void bind(const gl::Functions& gl) const;
  [[nodiscard]] const core::CmSurfaceTables& tables() const { return tables_; }
  /// Returns true if some triangles may let rays pass straight on: surface::may_be_clear().
  [[nodiscard]] bool clear_surfaces() const { return clear_surfaces_; }
  [[nodiscard]] const light::SceneLights& lights() const { return table_.lights; }
  [[nodiscard]] const scene::ModelTable& table() const { return table_; }
  [[nodiscard]] const std::vector<scene::Model>& models() const { return models_; }
  /// Identity that stays the same while paths in flight stay valid. Triangle numbers must then mean the same triangles;
  /// poses and transforms may differ. With extended materials, word offsets must mean the same materials.
  [[nodiscard]] std::shared_ptr<const void> numbering() const { return numbering_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  ModelDataPtr data_;
  std::vector<scene::Model> models_;
  scene::ModelTable table_;
  // scene and first triangle of the mesh of each record
  using Numbering = std::vector<std::pair<surface::ScenePtr, std::uint32_t>>;
  std::shared_ptr<const Numbering> numbering_;
  core::CmSurfaceTables tables_{};
  bool clear_surfaces_ = false;
  gl::Object records_;
  gl::Object nodes_;
  std::uint64_t bytes_ = 0;
};

}  // namespace cumulet::render
