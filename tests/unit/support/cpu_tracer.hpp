#pragma once

#include <span>
#include <stdexcept>
#include <vector>

#include "grid/cell.hpp"
#include "grid/tet_grid.hpp"
#include "light/alias_table.hpp"
#include "light/analytic_lights.hpp"
#include "render/scene/parameters.hpp"
#include "scene/model_table.hpp"
#include "support/volumes.hpp"
#include "surface/ggx_albedo.hpp"

// Functions of shader variants share their signatures, so each variant leaves some parameters unused.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter"

// The shaders' path tracer as C++: the same source, with data in memory.
namespace cumulet::core {

struct CpuTetData {
  CmParameters cm{};
  const grid::TetGrid* grid = nullptr;
  float cm_surface_z(uvec2 pixel, vec2 within, uint layer) const { return 3.0e38F; }
  uvec4 cm_record(uint cell, uint part) const { return part == 0 ? grid->cells[cell].links : grid->cells[cell].data; }
  uint cm_tree(uint node) const { return grid->tree[node]; }
  uint cm_root_leaf(uint root) const { return grid->roots[root].first_leaf; }
  uint cm_root_node(uint root) const { return grid->roots[root].first_internal; }
};

#define CM_MARCH 0
#define CM_LINEAR 1

struct CpuTet : CpuTetData {
#include "support/traced.inc"
};

struct CpuSurfaceData {
  const scene::ModelSource* shown_source = nullptr;
  std::vector<uvec4> shown_words;  // the words of this source and those that models share
  std::vector<CmModel> cm_models;
  std::vector<CmInstanceNode> cm_model_nodes;
  uint cm_model = 0;
  scene::TextureAtlas shown_atlas;

  // Shows these models, all of one source. Returns the surface tables of the parameters.
  CmSurfaceTables show(std::span<const scene::Model> models) {
    shown_source = models.front().source.get();
    shown_words = shown_source->words;
    shown_atlas = scene::pack_atlas(std::vector<scene::TextureImagesPtr>{shown_source->images});
    const auto textures = static_cast<uint>(shown_words.size());
    for (const surface::Texture& texture : shown_source->scene->textures)
      shown_words.push_back(scene::texture_word(texture, shown_atlas.regions[0][texture.image]));
    const scene::ModelTable table = scene::make_model_table(models, [&](const scene::ModelSource&) {
      return scene::ModelWords{0, textures};
    });
    cm_models = table.records;
    cm_model_nodes = table.nodes;
    CmSurfaceTables tables{};
    tables.low = table.low;
    tables.high = table.high;
    tables.models = static_cast<uint>(cm_models.size());
    const auto add = [&](const std::vector<uvec4>& more) {
      const auto first = static_cast<uint>(shown_words.size());
      shown_words.insert(shown_words.end(), more.begin(), more.end());
      return first;
    };
    tables.ggx_albedo = add(surface::GgxAlbedo::table().cells());
    tables.ggx_albedo_averages = add(surface::GgxAlbedo::table().average_cells());
    return tables;
  }

  uvec4 cm_words(uint word) const { return shown_words.at(word); }
  CmAnalyticLight cm_analytic_light(uint i) const {
    CmAnalyticLight analytic_light = light::analytic_light_record(shown_source->pose.lights.at(i), dvec3(0.0));
    analytic_light.probability = 1.0F / static_cast<float>(shown_source->pose.lights.size());
    analytic_light.stays = light::Alias::certain;
    return analytic_light;
  }
  vec4 cm_atlas_value(ivec3 at) const {
    for (std::size_t i = 0; i < shown_atlas.regions[0].size(); ++i) {
      const scene::TextureAtlas::Region& region = shown_atlas.regions[0][i];
      const uvec2 texel =
          uvec2(ivec2(at)) - region.corner;  // texels to the left or above wrap to values beyond any size
      if (uint(at.z) != region.layer || texel.x >= region.size.x || texel.y >= region.size.y) continue;
      const std::uint8_t* const value =
          &shown_source->images->rgba(i).at(4 * (std::size_t{texel.y} * region.size.x + texel.x));
      return vec4(value[0], value[1], value[2], value[3]) / 255.0F;
    }
    throw std::out_of_range("no image there");
  }
  // Camera rays do not end at the surface pass, which is only used where paths do not intersect triangles.
  static float cm_layer_surface(uvec2 pixel, vec2 within, uint sample_number, float u, vec4& color) { return 3.0e38F; }
};

#undef CM_EQUIANGULAR
#define CM_EQUIANGULAR 1
#undef CM_ANALYTIC_LIGHTS
#define CM_ANALYTIC_LIGHTS 1
struct CpuTetPassing : CpuTetData {
  static CmAnalyticLight cm_analytic_light(uint) { return {}; }
#include "support/traced.inc"
};
#undef CM_EQUIANGULAR
#define CM_EQUIANGULAR 0
#undef CM_ANALYTIC_LIGHTS
#define CM_ANALYTIC_LIGHTS CM_SURFACES

#undef CM_SURFACES
#define CM_SURFACES 1
struct CpuTetSurfaces : CpuTetData, CpuSurfaceData {
#include "support/traced.inc"
};

#undef CM_SURFACES
#define CM_SURFACES 2
struct CpuTetEmitters : CpuTetData, CpuSurfaceData {
#include "support/traced.inc"
};

#undef CM_MARCH
#undef CM_LINEAR
#define CM_MARCH 1
#define CM_LINEAR 0

struct CpuDenseData {
  CmParameters cm{};
  const volume::ScalarVolume* volume = nullptr;
  ivec3 origin{0};
  float cm_surface_z(uvec2 pixel, vec2 within, uint layer) const { return 3.0e38F; }
  float cm_voxel(ivec3 voxel) const { return test::value_at(*volume, voxel + origin) / volume->max_value; }
};

struct CpuDenseEmitters : CpuDenseData, CpuSurfaceData {
#include "support/traced.inc"
};

#undef CM_SURFACES
#define CM_SURFACES 0
struct CpuDense : CpuDenseData {
#include "support/traced.inc"
};

#undef CM_MARCH
#undef CM_LINEAR

}  // namespace cumulet::core

#pragma GCC diagnostic pop
