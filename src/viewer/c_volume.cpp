// Volumes of the C ABI.

#include <algorithm>
#include <array>
#include <optional>

#include "viewer/c_handles.hpp"
#include "viewer/c_stream.hpp"
#include "viewer/c_support.hpp"
#include "viewer/c_viewer.hpp"
#include "volume/inspection.hpp"
#include "volume/memory.hpp"

using namespace cumulet;
using namespace cumulet::c_abi;

struct cumulet_inspection {
  explicit cumulet_inspection(const char* path) : file(path) {}
  volume::Inspection file;
};

viewer::VolumeAssetPtr c_abi::asset_of(const std::string& name, volume::VolumeFrame frame) {
  try {
    return std::make_shared<const viewer::VolumeAsset>(std::move(frame));
  } catch (const Error& e) {
    throw Error(e.code(), name + ": " + e.what());
  }
}

volume::DenseVoxels c_abi::to_dense(const cumulet_dense_desc* desc, const std::string& name) {
  const cumulet_dense_desc d = read_desc(desc, "cumulet_dense_desc");
  return {.values = array_of(d.values, d.value_count, 1, name + ": values"),
          .size = {d.size[0], d.size[1], d.size[2]},
          .index_to_world = matrix_or_identity(d.index_to_world)};
}

volume::SparseVoxels c_abi::to_sparse(const cumulet_sparse_desc* desc, const std::string& name) {
  const cumulet_sparse_desc d = read_desc(desc, "cumulet_sparse_desc");
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
    voxels.tiles.push_back({{{t.min[0], t.min[1], t.min[2]}, {t.max[0], t.max[1], t.max[2]}, t.value}, t.active == 1});
  }
  return voxels;
}

namespace {

// The file of a descriptor, with a path that is not checked.
viewer::VolumeFile volume_file_of(const cumulet_volume_file_desc& d, const std::string& path) {
  const glm::dmat4 m = matrix_or_identity(d.to_world);
  require_transform(m);
  require(d.suggested_density_scale == 0 || d.suggested_density_scale == 1,
          "suggested_density_scale is neither 0 nor 1");
  const auto name = [](const char* given) { return std::string(given == nullptr ? "" : given); };
  return {path,
          {name(d.grid_name), name(d.temperature_grid), name(d.flame_grid), name(d.color_grid), name(d.anisotropy_grid),
           name(d.velocity_grid)},
          m,
          d.suggested_density_scale == 1};
}

// Reads content in place of a file. otherwise: its name if the descriptor has none.
viewer::VolumeAssetPtr read_content(std::unique_ptr<ByteSource> content, const cumulet_volume_file_desc* desc,
                                    const char* otherwise) {
  cumulet_volume_file_desc d{};
  if (desc != nullptr) d = read_desc(desc, "cumulet_volume_file_desc");
  return volume_file_of(d, name_or(d.path, otherwise)).read_content(std::move(content), log_of(d.log, d.log_user));
}

std::string name_of(const cumulet_volume_file_desc* desc, const char* otherwise) {
  return desc == nullptr ? otherwise : name_or(read_desc(desc, "cumulet_volume_file_desc").path, otherwise);
}

}  // namespace

viewer::VolumeFile c_abi::to_volume_file(const cumulet_volume_file_desc* desc) {
  const cumulet_volume_file_desc d = read_desc(desc, "cumulet_volume_file_desc");
  require(d.path != nullptr && *d.path != '\0', "path is NULL or empty");
  return volume_file_of(d, d.path);
}

cumulet_status cumulet_volume_open(const char* path, const char* grid_name, cumulet_volume** out, char* error,
                                   size_t error_size) {
  cumulet_volume_file_desc desc{};
  desc.struct_size = sizeof desc;
  desc.path = path;
  desc.grid_name = grid_name;
  return cumulet_volume_open_file(&desc, out, error, error_size);
}

cumulet_status cumulet_volume_open_file(const cumulet_volume_file_desc* desc, cumulet_volume** out, char* error,
                                        size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    const viewer::VolumeFile file = to_volume_file(desc);
    const cumulet_volume_file_desc d = read_desc(desc, "cumulet_volume_file_desc");
    return file.read(log_of(d.log, d.log_user), nullptr);
  });
}

cumulet_status cumulet_volume_from_memory(const void* bytes, size_t size, const cumulet_volume_file_desc* desc,
                                          cumulet_volume** out, char* error, size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    const auto content = array_of(static_cast<const std::byte*>(bytes), size, 1, name_of(desc, "memory") + ": bytes");
    return read_content(std::make_unique<MemorySource>(content), desc, "memory");
  });
}

cumulet_status cumulet_volume_from_stream(const cumulet_stream_desc* stream, const cumulet_volume_file_desc* desc,
                                          cumulet_volume** out, char* error, size_t error_size) {
  return make_handle(out, error, error_size,
                     [&] { return read_content(std::make_unique<HostStream>(stream), desc, "stream"); });
}

cumulet_status cumulet_volume_from_dense(const cumulet_dense_desc* desc, cumulet_volume** out, char* error,
                                         size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    const std::string name = name_or(read_desc(desc, "cumulet_dense_desc").name, "dense");
    return asset_of(name, {.density = volume::import_dense(to_dense(desc, name), name, {})});
  });
}

cumulet_status cumulet_volume_from_sparse(const cumulet_sparse_desc* desc, cumulet_volume** out, char* error,
                                          size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    const std::string name = name_or(read_desc(desc, "cumulet_sparse_desc").name, "sparse");
    return asset_of(name, {.density = volume::import_sparse(to_sparse(desc, name), name, {})});
  });
}

cumulet_volume* cumulet_volume_retain(cumulet_volume* volume) { return retain(volume); }

void cumulet_volume_release(cumulet_volume* volume) { release(volume); }

cumulet_status cumulet_volume_get_info(const cumulet_volume* volume, cumulet_volume_info* info) {
  return guarded(nullptr, 0, [&] {
    require(volume != nullptr, "volume is NULL");
    const viewer::VolumeAsset& asset = *volume->asset;
    const volume::ScalarVolume& field = asset.main_field();
    cumulet_volume_info out{};
    copy_text(field.name, out.name, sizeof out.name);
    out.active_voxels = field.active_voxels;
    for (int axis = 0; axis < 3; ++axis) {
      out.bounds_min[axis] = asset.bounds().min[axis];
      out.bounds_max[axis] = asset.bounds().max[axis];
    }
    out.max_value = field.max_value;
    out.negative_voxels = field.negative_voxels;
    out.non_finite_voxels = field.non_finite_voxels;
    out.huge_voxels = field.huge_voxels;
    if (asset.frame().temperature) out.temperature_scale = asset.temperature_scale();
    write_desc(info, out, "cumulet_volume_info");
  });
}

cumulet_status cumulet_volume_suggest_density_scale(const cumulet_volume* volume, double* scale) {
  return guarded(nullptr, 0, [&] {
    require(volume != nullptr, "volume is NULL");
    require(scale != nullptr, "scale is NULL");
    const std::optional<double> suggested = volume->asset->coarse().suggest_density_scale();
    require(suggested.has_value(), "the volume has no density");
    *scale = *suggested;
  });
}

cumulet_status cumulet_volume_get_histogram(const cumulet_volume* volume, cumulet_ramp ramp,
                                            cumulet_histogram_info* info) {
  return guarded(nullptr, 0, [&] {
    require(volume != nullptr, "volume is NULL");
    require(number(ramp) <= CUMULET_RAMP_FLAME, "ramp is unknown");
    const volume::VolumeFrame& frame = volume->asset->frame();
    const auto pointer = [](const std::optional<volume::ScalarVolume>& field) { return field ? &*field : nullptr; };
    const std::array fields = {&frame.density, pointer(frame.temperature), pointer(frame.flame)};
    cumulet_histogram_info out{};
    if (const volume::ScalarVolume* field = fields.at(number(ramp))) {
      out.max_value = field->max_value;
      std::ranges::copy(volume::histogram(*field), out.histogram);
    }
    write_desc(info, out, "cumulet_histogram_info");
  });
}

cumulet_status cumulet_list_grids(const char* path, cumulet_grid_fn fn, void* user, char* error, size_t error_size) {
  return guarded(error, error_size, [&] {
    require(path != nullptr && *path != '\0', "path is NULL or empty");
    require(fn != nullptr, "fn is NULL");
    for (const volume::GridInfo& grid : volume::list_grids(path)) {
      const CallbackScope inside;
      fn(user, grid.unique_name.c_str(), grid.type.c_str(), grid.refusal.c_str());
    }
  });
}

// ---- inspection ----

cumulet_status cumulet_inspect_volume_file(const char* path, cumulet_inspection** out, char* error, size_t error_size) {
  if (out != nullptr) *out = nullptr;
  return guarded(error, error_size, [&] {
    require(out != nullptr, "out is NULL");
    require(path != nullptr && *path != '\0', "path is NULL or empty");
    *out = new cumulet_inspection(path);
  });
}

void cumulet_inspection_release(cumulet_inspection* inspection) { delete inspection; }

cumulet_status cumulet_inspection_get_file(const cumulet_inspection* inspection, cumulet_volume_file_info* info) {
  return guarded(nullptr, 0, [&] {
    require(inspection != nullptr, "inspection is NULL");
    const volume::Inspection& file = inspection->file;
    cumulet_volume_file_info out{};
    out.format = file.format().c_str();
    out.bytes = file.bytes();
    out.grid_count = static_cast<uint32_t>(file.grids().size());
    out.metadata_count = static_cast<uint32_t>(file.metadata().size());
    out.default_grid = file.chosen() ? static_cast<int32_t>(*file.chosen()) : -1;
    write_desc(info, out, "cumulet_volume_file_info");
  });
}

cumulet_status cumulet_inspection_get_grid(cumulet_inspection* inspection, uint32_t grid, cumulet_grid_info* info) {
  return guarded(nullptr, 0, [&] {
    require(inspection != nullptr, "inspection is NULL");
    volume::Inspection& file = inspection->file;
    require(grid < file.grids().size(), "there is no such grid");
    read_desc(info, "cumulet_grid_info");
    const volume::GridInfo& entry = file.grids()[grid];
    const volume::GridStatistics& statistics = file.statistics(grid);
    cumulet_grid_info out{};
    out.name = entry.unique_name.c_str();
    out.type = entry.type.c_str();
    out.grid_class = entry.grid_class.c_str();
    out.unsupported_reason = statistics.refusal.c_str();
    out.metadata_count = static_cast<uint32_t>(entry.metadata.size());
    out.channel = file.channels()[grid].c_str();
    if (statistics.values) {
      const volume::GridValues& values = *statistics.values;
      out.values =
          entry.values == volume::Values::scalars ? CUMULET_GRID_VALUES_SCALARS : CUMULET_GRID_VALUES_MAGNITUDES;
      for (int i = 0; i < 16; ++i) out.index_to_world[i] = values.index_to_world[i / 4][i % 4];
      out.active_voxels = values.active_voxels;
      const viewer::Bounds box = values.active_voxels > 0
                                     ? viewer::world_bounds(values.bounds_min, values.bounds_max, values.index_to_world)
                                     : viewer::Bounds{};
      for (int axis = 0; axis < 3; ++axis) {
        out.voxel_min[axis] = values.bounds_min[axis];
        out.voxel_max[axis] = values.bounds_max[axis];
        out.bounds_min[axis] = box.min[axis];
        out.bounds_max[axis] = box.max[axis];
      }
      out.min_value = values.min;
      out.max_value = values.max;
      out.mean_value = values.mean;
      out.negative_voxels = values.negative_voxels;
      out.non_finite_voxels = values.non_finite_voxels;
      out.memory_bytes = values.memory_bytes;
      static_assert(volume::histogram_bins == CUMULET_HISTOGRAM_BINS);
      std::copy(values.histogram.begin(), values.histogram.end(), out.histogram);
    }
    write_desc(info, out, "cumulet_grid_info");
  });
}

cumulet_status cumulet_inspection_get_metadata(const cumulet_inspection* inspection, int32_t grid, uint32_t index,
                                               cumulet_metadata* out) {
  return guarded(nullptr, 0, [&] {
    require(inspection != nullptr, "inspection is NULL");
    const volume::Inspection& file = inspection->file;
    require(grid >= -1 && grid < static_cast<int64_t>(file.grids().size()), "there is no such grid");
    const auto& entries = grid < 0 ? file.metadata() : file.grids()[static_cast<size_t>(grid)].metadata;
    require(index < entries.size(), "there is no such entry");
    const volume::Metadata& entry = entries[index];
    cumulet_metadata found{};
    found.name = entry.name.c_str();
    found.type = entry.type.c_str();
    found.value = entry.value.c_str();
    write_desc(out, found, "cumulet_metadata");
  });
}

cumulet_status cumulet_get_interpolation(cumulet_viewer* viewer, cumulet_interpolation* interpolation) {
  return with_state(viewer, [&](cumulet::viewer::Viewer& v) {
    require(interpolation != nullptr, "interpolation is NULL");
    const std::optional<grid::Interpolation> used = v.interpolation();
    *interpolation = CUMULET_INTERPOLATION_AUTO;
    if (used == grid::Interpolation::nearest) *interpolation = CUMULET_INTERPOLATION_NEAREST;
    if (used == grid::Interpolation::linear) *interpolation = CUMULET_INTERPOLATION_LINEAR;
  });
}
