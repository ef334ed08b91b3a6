#include "render/scene/model_data.hpp"

#include <algorithm>
#include <glm/ext/vector_ulp.hpp>
#include <limits>
#include <string>
#include <utility>

#include "base/error.hpp"
#include "gl/bindings.hpp"
#include "surface/ggx_albedo.hpp"
#include "surface/sheen_albedo.hpp"

namespace cumulet::render {

namespace {

// Returns each image set once.
std::vector<scene::TextureImagesPtr> images_of(const ModelData::Sources& sources) {
  std::vector<scene::TextureImagesPtr> images;
  for (const scene::ModelSourcePtr& source : sources) {
    if (std::ranges::find(images, source->images) == images.end()) images.push_back(source->images);
  }
  return images;
}

}  // namespace

std::shared_ptr<ModelData> ModelData::plan(const gl::FunctionsPtr& gl, const gl::Limits& limits, gl::WordHeap& heap,
                                           Upload& upload, const Sources& sources,
                                           const std::shared_ptr<const ModelData>& last) {
  auto data = std::make_shared<ModelData>();
  ModelData* const to = data.get();
  std::uint64_t words = 0;
  for (const scene::ModelSourcePtr& source : sources) {
    to->parts_.push_back({source, static_cast<std::uint32_t>(words), 0});
    words += source->words.size();
    if (words > std::numeric_limits<std::uint32_t>::max() / 2)
      throw Error(ErrorCode::unsupported, "the surfaces' tables have more than 2^31 words");
  }
  std::vector<scene::TextureImagesPtr> images = images_of(sources);
  const bool same_images = last != nullptr && last->atlas_->images == images;
  if (same_images) {
    to->atlas_ = last->atlas_;
  } else {
    to->atlas_ = std::make_shared<Atlas>();
    to->atlas_->layout = scene::pack_atlas(images);
    to->atlas_->images = std::move(images);
  }
  const scene::TextureAtlas& atlas = to->atlas_->layout;
  if (static_cast<int>(atlas.edge) > limits.texture_size_2d) {
    throw Error(ErrorCode::unsupported, "the surfaces' images need textures " + std::to_string(atlas.edge) +
                                            " wide; this driver's GL_MAX_TEXTURE_SIZE is " +
                                            std::to_string(limits.texture_size_2d));
  }
  to->add_common(static_cast<std::uint32_t>(words));
  const std::size_t bytes = (words + to->common_.size()) * sizeof(glm::uvec4);
  to->bytes_ = bytes + std::uint64_t{atlas.edge} * atlas.edge * std::max(1U, atlas.layers) * 4;
  upload.add([&heap, to, bytes] { to->words_ = heap.take(bytes, "creating the surfaces' tables"); });
  const auto location_at = [to](std::uint32_t word) {
    return [to, word] {
      return Upload::Location{to->words_.buffer(), to->words_.offset() + std::size_t{word} * sizeof(glm::uvec4)};
    };
  };
  for (const Part& part : to->parts_) {
    const std::size_t size = part.source->words.size() * sizeof(glm::uvec4);
    const auto was = last == nullptr ? std::vector<Part>::const_iterator()
                                     : std::ranges::find(last->parts_, part.source, &Part::source);
    if (last == nullptr || was == last->parts_.end()) {
      upload.add_bytes(location_at(part.first), part.source->words.data(), size);
      continue;
    }
    const std::size_t from = std::size_t{was->first} * sizeof(glm::uvec4);
    upload.add_pieces(size, [gl, last, at = location_at(part.first), from](std::size_t first, std::size_t count) {
      const Upload::Location location = at();
      gl->CopyNamedBufferSubData(last->words_.buffer(), location.buffer,
                                 static_cast<GLintptr>(last->words_.offset() + from + first),
                                 static_cast<GLintptr>(location.offset + first), static_cast<GLsizeiptr>(count));
    });
  }
  upload.add_bytes(location_at(static_cast<std::uint32_t>(words)), to->common_.data(),
                   to->common_.size() * sizeof(glm::uvec4));
  if (same_images) return data;
  Atlas* const made = to->atlas_.get();
  upload.add([gl, made] {
    const int edge = static_cast<int>(made->layout.edge);
    made->texture = gl::make_texture_2d_array(
        gl, GL_RGBA8, edge, edge, static_cast<int>(std::max(1U, made->layout.layers)), "creating the surfaces' images");
  });
  for (std::size_t i = 0; i < made->images.size(); ++i) {
    for (std::size_t j = 0; j < made->images[i]->sizes.size(); ++j) {
      const scene::TextureAtlas::Region& region = atlas.regions[i][j];
      upload.add_image([made] { return made->texture.name(); },
                       {region.corner, region.size, 0, static_cast<int>(region.layer)},
                       made->images[i]->rgba(j).data());
    }
  }
  return data;
}

void ModelData::add_common(std::uint32_t first) {
  const auto here = [&] { return first + static_cast<std::uint32_t>(common_.size()); };
  for (std::size_t i = 0; i < atlas_->images.size(); ++i) {
    for (Part& part : parts_) {
      if (part.source->images == atlas_->images[i]) part.textures = here();
    }
    for (const surface::Texture& texture : atlas_->images[i]->scene->textures)
      common_.push_back(scene::texture_word(texture, atlas_->layout.regions[i][texture.image]));
  }
  const surface::GgxAlbedo& albedo = surface::GgxAlbedo::table();
  const std::vector<glm::uvec4> cells = albedo.cells();
  const std::vector<glm::uvec4> averages = albedo.average_cells();
  ggx_albedo_ = here();
  common_.insert(common_.end(), cells.begin(), cells.end());
  ggx_albedo_averages_ = here();
  common_.insert(common_.end(), averages.begin(), averages.end());
  sheen_albedo_ = here();
  const auto is_basic = [](const Part& part) { return part.source->bsdf == surface::BsdfVariant::basic; };
  if (std::ranges::all_of(parts_, is_basic)) return;
  const std::vector<glm::uvec4> sheen = surface::SheenAlbedo::table().words();
  common_.insert(common_.end(), sheen.begin(), sheen.end());
}

scene::ModelWords ModelData::words_of(const scene::ModelSource& source) const {
  const auto is = [&](const Part& part) { return part.source.get() == &source; };
  const Part& part = *std::ranges::find_if(parts_, is);
  return {first_word() + part.first, first_word() + part.textures};
}

void ModelData::bind(const gl::Functions& gl) const {
  words_.bind(gl, core::CM_UNIT_SCENE_WORDS);
  gl.BindTextureUnit(core::CM_UNIT_ATLAS, atlas_->texture.name());
}

ModelInstances ModelInstances::make(const gl::FunctionsPtr& gl, const gl::Limits& limits,
                                    std::vector<scene::Model> models, ModelDataPtr data, const ModelInstances* last) {
  ModelInstances instances;
  instances.table_ =
      scene::make_model_table(models, [&](const scene::ModelSource& source) { return data->words_of(source); });
  const scene::ModelTable& table = instances.table_;
  std::vector<core::CmModel> records = table.records;
  records.insert(records.end(), table.ends.begin(), table.ends.end());
  const std::size_t record_bytes = records.size() * sizeof(core::CmModel);
  const std::size_t node_bytes = table.nodes.size() * sizeof(core::CmInstanceNode);
  if (static_cast<std::int64_t>(std::max(record_bytes, node_bytes)) > limits.storage_block_bytes) {
    throw Error(ErrorCode::unsupported, std::to_string(table.records.size()) +
                                            " models are more than this driver's GL_MAX_SHADER_STORAGE_BLOCK_SIZE, " +
                                            std::to_string(limits.storage_block_bytes) + ", holds");
  }
  instances.records_ = gl::make_buffer(gl, record_bytes, records.data(), 0, "creating the table of models");
  instances.nodes_ = gl::make_buffer(gl, node_bytes, table.nodes.data(), 0, "creating the model BVH");
  instances.tables_.low = glm::prevFloat(glm::vec3(table.low));
  instances.tables_.high = glm::nextFloat(glm::vec3(table.high));
  instances.tables_.models = static_cast<std::uint32_t>(table.records.size());
  instances.tables_.ggx_albedo = data->ggx_albedo();
  instances.tables_.ggx_albedo_averages = data->ggx_albedo_averages();
  instances.tables_.sheen_albedo = data->sheen_albedo();
  for (const scene::Model& model : models) {
    const auto variant = static_cast<std::uint32_t>(model.source->bsdf);
    instances.tables_.extended_bsdf = std::max(instances.tables_.extended_bsdf, variant);
    instances.clear_surfaces_ = instances.clear_surfaces_ || model.source->clear_surfaces;
  }
  instances.bytes_ = record_bytes + node_bytes;
  Numbering numbering;
  for (const scene::ModelPart& part : table.parts)
    numbering.emplace_back(models[part.model].source->scene,
                           models[part.model].source->meshes[part.mesh].first_triangle);
  // Paths inside transmissive objects store the object's material as a word offset in the data.
  const bool lasts =
      last != nullptr && *last->numbering_ == numbering &&
      (last->data_ == data || std::max(instances.tables_.extended_bsdf, last->tables_.extended_bsdf) == 0U);
  instances.numbering_ = lasts ? last->numbering_ : std::make_shared<const Numbering>(std::move(numbering));
  instances.models_ = std::move(models);
  instances.data_ = std::move(data);
  return instances;
}

void ModelInstances::bind(const gl::Functions& gl) const {
  data_->bind(gl);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_MODELS, records_.name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_MODEL_NODES, nodes_.name());
}

}  // namespace cumulet::render
