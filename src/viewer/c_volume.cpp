// Volumes of the C ABI.

#include "viewer/c_handles.hpp"
#include "viewer/c_support.hpp"
#include "volume/memory.hpp"

using namespace cumulet;
using namespace cumulet::c_abi;

namespace {

viewer::VolumePtr asset_of(const std::string& name, volume::ScalarVolume volume) {
  try {
    return std::make_shared<const viewer::VolumeAsset>(std::move(volume));
  } catch (const Error& e) {
    throw Error(e.code(), name + ": " + e.what());
  }
}

}  // namespace

cumulet_status cumulet_volume_open(const char* path, const char* grid_name, cumulet_volume** out, char* error,
                                   size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    require(path != nullptr, "path is NULL");
    return asset_of(path, volume::import_volume(path, grid_name == nullptr ? "" : grid_name, {}));
  });
}

cumulet_status cumulet_volume_from_dense(const cumulet_dense_desc* desc, cumulet_volume** out, char* error,
                                         size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    const cumulet_dense_desc d = read_desc(desc, "cumulet_dense_desc");
    const std::string name = name_or(d.name, "dense");
    const volume::DenseVoxels voxels{.values = array_of(d.values, d.value_count, 1, name + ": values"),
                                     .size = {d.size[0], d.size[1], d.size[2]},
                                     .index_to_world = matrix_or_identity(d.index_to_world)};
    return asset_of(name, volume::import_dense(voxels, name, {}));
  });
}

cumulet_status cumulet_volume_from_sparse(const cumulet_sparse_desc* desc, cumulet_volume** out, char* error,
                                          size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    const cumulet_sparse_desc d = read_desc(desc, "cumulet_sparse_desc");
    const std::string name = name_or(d.name, "sparse");
    volume::SparseVoxels voxels{
        .brick_origins = array_of(d.brick_origins, d.brick_count, 3, name + ": brick_origins"),
        .brick_values = array_of(d.brick_values, d.brick_count, volume::brick_voxels, name + ": brick_values"),
        .brick_active = array_of(d.brick_active, d.brick_active == nullptr ? 0 : d.brick_count, volume::brick_size,
                                 name + ": brick_active"),
        .tiles = {},
        .background = d.background,
        .index_to_world = matrix_or_identity(d.index_to_world)};
    const auto tiles = array_of(d.tiles, d.tile_count, 1, name + ": tiles");
    voxels.tiles.reserve(tiles.size());
    for (const cumulet_tile& t : tiles) {
      if (t.active != 0 && t.active != 1) refuse(name + ": a tile's active is " + std::to_string(t.active));
      voxels.tiles.push_back(
          {{{t.min[0], t.min[1], t.min[2]}, {t.max[0], t.max[1], t.max[2]}, t.value}, t.active == 1});
    }
    return asset_of(name, volume::import_sparse(std::move(voxels), name, {}));
  });
}

cumulet_volume* cumulet_volume_retain(cumulet_volume* volume) { return retain(volume); }

void cumulet_volume_release(cumulet_volume* volume) { release(volume); }

cumulet_status cumulet_volume_get_info(const cumulet_volume* volume, cumulet_volume_info* info) {
  return guarded(nullptr, 0, [&] {
    require(volume != nullptr, "volume is NULL");
    const viewer::VolumeAsset& asset = *volume->asset;
    cumulet_volume_info out{};
    copy_text(asset.volume().name, out.name, sizeof out.name);
    out.active_voxels = asset.volume().active_voxels;
    for (int axis = 0; axis < 3; ++axis) {
      out.bounds_min[axis] = asset.bounds().min[axis];
      out.bounds_max[axis] = asset.bounds().max[axis];
    }
    out.max_value = asset.volume().max_value;
    write_desc(info, out, "cumulet_volume_info");
  });
}

cumulet_status cumulet_list_grids(const char* path, cumulet_grid_fn fn, void* user, char* error, size_t error_size) {
  return guarded(error, error_size, [&] {
    require(path != nullptr, "path is NULL");
    require(fn != nullptr, "fn is NULL");
    for (const volume::GridInfo& grid : volume::list_grids(path)) {
      fn(user, grid.unique_name.c_str(), grid.type.c_str(), grid.refusal.c_str());
    }
  });
}
