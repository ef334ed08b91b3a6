#include "render/model_data.hpp"

#include <algorithm>
#include <string>

#include "base/error.hpp"
#include "gl/bindings.hpp"

namespace cumulet::render {

std::unique_ptr<ModelData> ModelData::plan(const gl::FunctionsPtr& gl, const gl::Limits& limits, gl::WordHeap& heap,
                                           Upload& upload, const scene::ModelSource& source, const ModelData* last) {
  const scene::TextureAtlas& atlas = *source.atlas;
  if (static_cast<int>(atlas.edge) > limits.texture_size_2d) {
    throw Error(ErrorCode::unsupported, "the surfaces' images need textures " + std::to_string(atlas.edge) +
                                            " wide; this driver's GL_MAX_TEXTURE_SIZE is " +
                                            std::to_string(limits.texture_size_2d));
  }
  auto data = std::make_unique<ModelData>();
  ModelData* const to = data.get();
  to->scene_ = source.scene.get();
  to->tables_ = source.tables;
  to->lights_ = source.lights;
  const std::size_t bytes = source.words.size() * sizeof(glm::uvec4);
  to->bytes_ = bytes + std::uint64_t{atlas.edge} * atlas.edge * std::max(1U, atlas.layers) * 4;
  upload.add([&heap, to, bytes] {
    to->words_ = heap.take(bytes, "creating the surfaces' tables");
    to->tables_.words = static_cast<std::uint32_t>(to->words_.offset() / sizeof(glm::uvec4));
  });
  upload.add_bytes(
      [to] {
        return Upload::Place{to->words_.buffer(), to->words_.offset()};
      },
      source.words.data(), bytes);
  if (last != nullptr && last->scene_ == to->scene_) {
    to->atlas_ = last->atlas_;
    return data;
  }
  to->atlas_ = std::make_shared<gl::Object>();
  upload.add([gl, to, &atlas] {
    const int edge = static_cast<int>(atlas.edge);
    *to->atlas_ = gl::make_texture_2d_array(gl, GL_RGBA8, edge, edge, static_cast<int>(std::max(1U, atlas.layers)),
                                            "creating the surfaces' images");
  });
  for (std::size_t i = 0; i < atlas.places.size(); ++i) {
    const scene::TextureAtlas::Place& place = atlas.places[i];
    const auto& rgba = atlas.smaller[i].empty() ? source.scene->images[i].rgba : atlas.smaller[i];
    upload.add_image([to] { return to->atlas_->name(); }, {place.corner, place.size, 0, static_cast<int>(place.layer)},
                     rgba.data());
  }
  return data;
}

void ModelData::bind(const gl::Functions& gl) const {
  gl.BindTextureUnit(core::CM_UNIT_SCENE_WORDS, words_.texture());
  gl.BindTextureUnit(core::CM_UNIT_ATLAS, atlas_->name());
}

}  // namespace cumulet::render
