#include "info.hpp"

#include <cumulet/cumulet.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <ostream>
#include <program.hpp>
#include <stdexcept>

#include "default_medium.hpp"
#include "library_call.hpp"

namespace cumulet::demo {
namespace {

using Json = nlohmann::ordered_json;

struct Release {
  void operator()(cumulet_inspection* inspection) const { cumulet_inspection_release(inspection); }
  void operator()(cumulet_surfaces* surfaces) const { cumulet_surfaces_release(surfaces); }
};
template <class Handle>
using Owner = std::unique_ptr<Handle, Release>;

/// Opens a file with one of the library's functions. Throws with the library's error text.
template <class Handle>
Owner<Handle> open(cumulet_status (*opener)(const char*, Handle**, char*, std::size_t), const std::string& path) {
  Handle* handle = nullptr;
  check_call(opener(path.c_str(), &handle, nullptr, 0));
  return Owner<Handle>(handle);
}

/// Calls a getter of the library that fills a descriptor. `which`: the object and, if needed, an index in it.
template <class Desc, class Get, class... Which>
Desc read_desc(Get get, Which... which) {
  Desc desc{};
  desc.struct_size = sizeof desc;
  check_call(get(which..., &desc));
  return desc;
}

/// grid -1: metadata of the file itself.
Json metadata_of(const cumulet_inspection* inspection, std::int32_t grid, std::uint32_t count) {
  Json list = Json::array();
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto entry = read_desc<cumulet_metadata>(cumulet_inspection_get_metadata, inspection, grid, i);
    list.push_back({{"name", entry.name}, {"type", entry.type}, {"value", entry.value}});
  }
  return list;
}

Json volume_info(const std::string& path) {
  const auto owner = open<cumulet_inspection>(cumulet_inspect_volume_file, path);
  cumulet_inspection* inspection = owner.get();
  const auto file = read_desc<cumulet_volume_file_info>(cumulet_inspection_get_file, inspection);
  Json json;
  json["file"] = path;
  json["format"] = file.format;
  json["bytes"] = file.bytes;
  json["metadata"] = metadata_of(inspection, -1, file.metadata_count);
  json["grids"] = Json::array();
  for (std::uint32_t i = 0; i < file.grid_count; ++i) {
    const auto grid = read_desc<cumulet_grid_info>(cumulet_inspection_get_grid, inspection, i);
    Json entry;
    entry["name"] = grid.name;
    entry["type"] = grid.type;
    entry["class"] = grid.grid_class;
    entry["shown_by_default"] = file.default_grid == static_cast<std::int32_t>(i);
    if (*grid.channel != '\0') entry["channel"] = grid.channel;
    if (*grid.unsupported_reason != '\0') entry["unsupported_reason"] = grid.unsupported_reason;
    if (grid.values != CUMULET_GRID_VALUES_NONE) {
      entry["values"] = grid.values == CUMULET_GRID_VALUES_SCALARS ? "scalars" : "lengths";
      entry["active_voxels"] = grid.active_voxels;
      entry["voxel_min"] = grid.voxel_min;
      entry["voxel_max"] = grid.voxel_max;
      entry["range"] = {grid.min_value, grid.max_value};
      entry["mean"] = grid.mean_value;
      entry["negative_voxels"] = grid.negative_voxels;
      entry["non_finite_voxels"] = grid.non_finite_voxels;
      entry["index_to_world"] = grid.index_to_world;
      entry["bounds_min"] = grid.bounds_min;
      entry["bounds_max"] = grid.bounds_max;
      entry["memory_bytes"] = grid.memory_bytes;
      entry["histogram"] = grid.histogram;
    }
    entry["metadata"] = metadata_of(inspection, static_cast<std::int32_t>(i), grid.metadata_count);
    json["grids"].push_back(entry);
  }
  constexpr std::array names = {"cloud", "smoke", "fire"};
  json["content"] = names.at(static_cast<std::size_t>(content_of(inspection)));
  return json;
}

Json surfaces_info(const std::string& path) {
  const auto surfaces = open<cumulet_surfaces>(cumulet_surfaces_open, path);
  const auto info = read_desc<cumulet_surfaces_info>(cumulet_surfaces_get_info, surfaces.get());
  Json json;
  json["file"] = path;
  json["meshes"] = info.meshes;
  json["primitives"] = info.primitives;
  json["triangles"] = info.triangles;
  json["materials"] = info.materials;
  json["textures"] = info.textures;
  json["lights"] = info.lights;
  json["cameras"] = info.cameras;
  json["bounds_min"] = info.bounds_min;
  json["bounds_max"] = info.bounds_max;
  json["animations"] = Json::array();
  for (std::uint32_t i = 0; i < info.animations; ++i) {
    const auto animation = read_desc<cumulet_animation_info>(cumulet_surfaces_get_animation, surfaces.get(), i);
    json["animations"].push_back({{"name", animation.name}, {"duration", animation.duration}});
  }
  json["variants"] = Json::array();
  for (std::uint32_t i = 0; i < info.variants; ++i) {
    const auto variant = read_desc<cumulet_variant_info>(cumulet_surfaces_get_variant, surfaces.get(), i);
    json["variants"].push_back({{"name", variant.name}});
  }
  return json;
}

std::string text(const Json& value) {
  return one_line(value.is_string() ? value.get<std::string>()
                                    : value.dump(-1, ' ', false, Json::error_handler_t::replace));
}

/// Writes one line per value, nested values indented. Histograms are written to JSON only.
void write_lines(const Json& json, const std::string& indent, std::ostream& out) {
  for (const auto& [key, value] : json.items()) {
    if (key == "histogram") continue;
    if (!value.is_array() || value.empty() || !value.front().is_object()) {
      if (!value.is_array() || !value.empty()) out << indent << key << ": " << text(value) << '\n';
      continue;
    }
    out << indent << key << ":\n";
    for (const Json& entry : value) {
      if (key == "metadata") {
        out << indent << "  " << text(entry["name"]) << " (" << text(entry["type"]) << "): " << text(entry["value"])
            << '\n';
        continue;
      }
      out << indent << "- " << text(entry["name"]) << '\n';
      Json rest = entry;
      rest.erase("name");
      write_lines(rest, indent + "    ", out);
    }
  }
}

bool is_z_up(const std::string& volume_file) {
  const auto inspection = open<cumulet_inspection>(cumulet_inspect_volume_file, volume_file);
  const auto file = read_desc<cumulet_volume_file_info>(cumulet_inspection_get_file, inspection.get());
  for (const Json& entry : metadata_of(inspection.get(), -1, file.metadata_count)) {
    if (entry["name"] == "creator" && entry["value"].get<std::string>().find("Blender") != std::string::npos)
      return true;
  }
  return is_of_mantaflow(inspection.get());
}

}  // namespace

void write_info(const SceneOptions& scene, bool as_json, std::ostream& out) {
  Json json;
  if (!scene.volume.empty()) json["volume"] = volume_info(scene.volume);
  for (const SceneVolume& other : scene.others) {
    Json info = {{"name", other.label()}};
    info.update(volume_info(other.volume));
    json["other_volumes"].push_back(info);
  }
  if (!scene.surfaces.empty()) json["surfaces"] = surfaces_info(scene.surfaces);
  for (const SceneModel& model : scene.models) {
    Json info = {{"name", model.label()}};
    info.update(surfaces_info(model.file));
    json["other_models"].push_back(info);
  }
  for (const NamedCamera& camera : scene.cameras) json["scene"]["cameras"].push_back({{"name", camera.name}});
  if (as_json) {
    // Names may have any encoding: invalid UTF-8 is replaced. Non-finite numbers become null.
    out << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    return;
  }
  for (const auto& [what, properties] : json.items()) {
    for (const Json& file : properties.is_array() ? properties : Json::array({properties})) write_lines(file, "", out);
  }
}

UpAxis known_up_axis(const std::string& volume_file) { return known_up_axis(std::span(&volume_file, 1)); }

UpAxis known_up_axis(std::span<const std::string> volume_files) {
  for (const std::string& file : volume_files) {
    try {
      return is_z_up(file) ? UpAxis::z : UpAxis::y;
    } catch (const std::exception&) {  // loading reports the cause
      continue;
    }
  }
  return UpAxis::y;
}

std::vector<std::string> up_hints(const SceneOptions& scene) {
  std::vector<std::string> hints;
  const auto add = [&hints](const SceneVolume& volume) {
    if (volume.is_shown() && volume.up == UpAxis::y && known_up_axis(volume.volume) == UpAxis::z)
      hints.push_back(volume.volume + ": written by Blender or Mantaflow, whose up axis is Z: try --up z");
  };
  add(scene);
  std::ranges::for_each(scene.others, add);
  return hints;
}

}  // namespace cumulet::demo
