#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "gl/objects.hpp"
#include "gl/word_heap.hpp"
#include "render/upload.hpp"
#include "scene/model_table.hpp"

namespace cumulet::render {

/// What paths read of the surfaces of a scene on the GPU, each source's once, wherever it stands. All calls need the
/// context current and a StateGuard around.
class ModelData {
 public:
  using Sources = std::vector<scene::ModelSourcePtr>;

  /// Plans how it comes to GL: it is whole when all steps are done, and they may not outlive it, nor the last, which
  /// may be null: what that has is copied from there, and images are shared where the scenes are the same. Throws
  /// Error(unsupported).
  static std::shared_ptr<ModelData> plan(const gl::FunctionsPtr& gl, const gl::Limits& limits, gl::WordHeap& heap,
                                         Upload& upload, const Sources& sources,
                                         const std::shared_ptr<const ModelData>& last);
  void bind(const gl::Functions& gl) const;
  /// Of one that it is of.
  [[nodiscard]] scene::ModelWords words_of(const scene::ModelSource& source) const;
  /// Words of what surface::GgxAlbedo has.
  [[nodiscard]] std::uint32_t ggx_albedo() const { return first_word() + ggx_albedo_; }
  [[nodiscard]] std::uint32_t ggx_albedo_averages() const { return first_word() + ggx_albedo_averages_; }
  /// Likewise of surface::SheenAlbedo, of sources among which one is rich.
  [[nodiscard]] std::uint32_t sheen_albedo() const { return first_word() + sheen_albedo_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  struct Part {
    scene::ModelSourcePtr source;
    std::uint32_t first = 0;     // from the first word of all
    std::uint32_t textures = 0;  // likewise
  };
  struct Atlas {
    gl::Object texture;
    scene::TextureAtlas places;
    std::vector<scene::TextureImagesPtr> images;
  };
  [[nodiscard]] std::uint32_t first_word() const {
    return static_cast<std::uint32_t>(words_.offset() / sizeof(glm::uvec4));
  }
  void add_common(std::uint32_t first);

  gl::WordHeap::Span words_;
  std::vector<Part> parts_;
  std::vector<glm::uvec4> common_;  // of all: textures, then what reflections need
  std::shared_ptr<Atlas> atlas_;
  std::uint32_t ggx_albedo_ = 0;
  std::uint32_t ggx_albedo_averages_ = 0;
  std::uint32_t sheen_albedo_ = 0;
  std::uint64_t bytes_ = 0;
};
using ModelDataPtr = std::shared_ptr<const ModelData>;

/// Where they stand: what changes when one is moved. All calls need the context current and a StateGuard around.
class PlacedModels {
 public:
  /// Of sources that the data has; last: what was there before, or null. Throws as scene::make_model_table does, and
  /// Error(unsupported) for more than the driver binds.
  static PlacedModels make(const gl::FunctionsPtr& gl, const gl::Limits& limits, std::vector<scene::Model> models,
                           ModelDataPtr data, const PlacedModels* last);
  void bind(const gl::Functions& gl) const;
  [[nodiscard]] const core::CmSurfaceTables& tables() const { return tables_; }
  [[nodiscard]] const light::SceneLights& lights() const { return table_.lights; }
  [[nodiscard]] const scene::ModelTable& table() const { return table_; }
  [[nodiscard]] const std::vector<scene::Model>& models() const { return models_; }
  /// The same where what paths keep means the same: a number of a triangle the same one, however it is posed and
  /// wherever it stands, and of rich ones a word the same material.
  [[nodiscard]] std::shared_ptr<const void> numbering() const { return numbering_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  ModelDataPtr data_;
  std::vector<scene::Model> models_;
  scene::ModelTable table_;
  using Numbering = std::vector<std::pair<surface::ScenePtr, std::uint32_t>>;  // of each record, which mesh of which
  std::shared_ptr<const Numbering> numbering_;
  core::CmSurfaceTables tables_{};
  gl::Object records_;
  gl::Object nodes_;
  std::uint64_t bytes_ = 0;
};

}  // namespace cumulet::render
