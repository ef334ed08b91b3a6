// Surfaces of the C ABI.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/file_path.hpp"
#include "base/log.hpp"
#include "surface/gltf_import.hpp"
#include "surface/triangles.hpp"
#include "viewer/c_handles.hpp"
#include "viewer/c_support.hpp"

using namespace cumulet;
using namespace cumulet::c_abi;

namespace {

viewer::SurfaceAssetPtr asset_of(surface::ScenePtr scene, const std::string& name) {
  return std::make_shared<const viewer::SurfaceAsset>(std::move(scene), name);
}

/// Imports surfaces and keeps the warnings. import: receives a log and returns the scene.
template <class Import>
viewer::SurfaceAssetPtr imported_asset(const std::string& name, Import import) {
  std::string warnings;
  const Log log([&warnings](LogLevel level, const char* message) {
    if (level < LogLevel::warning) return;
    if (!warnings.empty()) warnings += '\n';
    warnings += message;
  });
  surface::ScenePtr scene = import(log);
  return std::make_shared<const viewer::SurfaceAsset>(std::move(scene), name, std::move(warnings));
}

surface::Material material_of(const cumulet_mesh_desc& d, const std::string& what) {
  const auto check = [&what](bool good, const char* cause) {
    if (!good) refuse(what + ": " + cause);
  };
  const auto part = [](float value) { return in_range(value, 0.0, 1.0); };
  check(std::ranges::all_of(d.base_color, part), "base_color is not from 0 to 1");
  check(part(d.metallic), "metallic is not from 0 to 1");
  check(part(d.smoothness), "smoothness is not from 0 to 1");
  check(std::ranges::all_of(d.emission, [](float e) { return in_range(e, 0.0, 1e30); }),
        "emission is negative or not finite");
  check(d.double_sided == 0 || d.double_sided == 1, "double_sided is not 0 or 1");
  surface::Material material;
  material.name = what;
  const auto& c = d.base_color;
  if (c[0] != 0.0F || c[1] != 0.0F || c[2] != 0.0F || c[3] != 0.0F) material.base_color = {c[0], c[1], c[2], c[3]};
  material.metallic = d.metallic;
  material.roughness = 1.0F - d.smoothness;
  material.emission = to_vec3(d.emission);
  material.double_sided = d.double_sided == 1;
  return material;
}

surface::TriangleMesh mesh_of(const cumulet_mesh_desc& d, const std::string& what) {
  surface::TriangleMesh mesh{
      .positions = array_of(d.positions, d.vertex_count, 3, what + ": positions"),
      .normals = array_of(d.normals, d.normals == nullptr ? 0 : d.vertex_count, 3, what + ": normals"),
      .colors = array_of(d.colors, d.colors == nullptr ? 0 : d.vertex_count, 4, what + ": colors"),
      .indices = array_of(d.indices, d.index_count, 1, what + ": indices"),
      .velocities = array_of(d.velocities, d.velocities == nullptr ? 0 : d.vertex_count, 3, what + ": velocities"),
      .to_world = matrix_or_identity(d.to_world),
      .material = material_of(d, what)};
  bool clear = mesh.material.base_color.a < 1.0F;
  for (std::size_t i = 3; i < mesh.colors.size(); i += 4) clear |= mesh.colors[i] < 1.0F;
  if (clear) mesh.material.alpha_mode = surface::AlphaMode::blend;
  return mesh;
}

std::vector<surface::TriangleMesh> meshes_of(const cumulet_triangles_desc& d, const std::string& name) {
  std::vector<surface::TriangleMesh> meshes;
  if (d.mesh_count != 0 && d.meshes == nullptr) refuse(name + ": meshes are NULL");
  for_each_desc(d.meshes, d.mesh_count, "cumulet_mesh_desc", name + ": mesh",
                [&](const cumulet_mesh_desc& mesh, const std::string& what) {
                  meshes.push_back(mesh_of(read_desc(&mesh, "cumulet_mesh_desc"), what));
                });
  return meshes;
}

}  // namespace

cumulet_status cumulet_surfaces_open(const char* path, cumulet_surfaces** out, char* error, size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    require(path != nullptr && *path != '\0', "path is NULL or empty");
    return imported_asset(path, [&](const Log& log) { return surface::import_gltf(path, log); });
  });
}

cumulet_status cumulet_surfaces_from_memory(const void* bytes, size_t size, const char* base_directory,
                                            const char* name, cumulet_surfaces** out, char* error, size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    const std::string what = name_or(name, "memory");
    const auto file = array_of(static_cast<const std::uint8_t*>(bytes), size, 1, what + ": bytes");
    std::optional<std::filesystem::path> folder;
    if (base_directory != nullptr) folder = FilePath(base_directory).absolute();
    return imported_asset(what, [&](const Log& log) {
      return surface::import_gltf({file.begin(), file.end()}, what, folder, log);
    });
  });
}

cumulet_status cumulet_surfaces_from_triangles(const cumulet_triangles_desc* desc, cumulet_surfaces** out, char* error,
                                               size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    const cumulet_triangles_desc d = read_desc(desc, "cumulet_triangles_desc");
    const std::string name = name_or(d.name, "triangles");
    return asset_of(surface::import_triangles(meshes_of(d, name), name), name);
  });
}

cumulet_surfaces* cumulet_surfaces_retain(cumulet_surfaces* surfaces) { return retain(surfaces); }

void cumulet_surfaces_release(cumulet_surfaces* surfaces) { release(surfaces); }

cumulet_status cumulet_surfaces_get_info(const cumulet_surfaces* surfaces, cumulet_surfaces_info* info) {
  return guarded(nullptr, 0, [&] {
    require(surfaces != nullptr, "surfaces is NULL");
    read_desc(info, "cumulet_surfaces_info");
    const viewer::SurfaceAsset& asset = *surfaces->asset;
    const viewer::SurfaceAsset::Rest rest = asset.rest();
    cumulet_surfaces_info out{};
    copy_text(asset.name(), out.name, sizeof out.name);
    out.triangles = asset.scene().shown_triangles();
    const surface::Scene::Counts& counts = asset.scene().counts;
    out.materials = counts.materials;
    out.lights = static_cast<uint32_t>(rest.lights);
    out.cameras = static_cast<uint32_t>(rest.cameras);
    out.animations = static_cast<uint32_t>(asset.scene().animations.size());
    for (int axis = 0; axis < 3; ++axis) {
      out.bounds_min[axis] = rest.bounds.min[axis];
      out.bounds_max[axis] = rest.bounds.max[axis];
    }
    out.meshes = counts.meshes;
    out.primitives = counts.primitives;
    out.textures = counts.textures;
    out.variants = static_cast<uint32_t>(asset.scene().variants.size());
    copy_text(asset.warnings(), out.warnings, sizeof out.warnings);
    write_desc(info, out, "cumulet_surfaces_info");
  });
}

cumulet_status cumulet_surfaces_get_animation(const cumulet_surfaces* surfaces, uint32_t index,
                                              cumulet_animation_info* info) {
  return guarded(nullptr, 0, [&] {
    require(surfaces != nullptr, "surfaces is NULL");
    const auto& animations = surfaces->asset->scene().animations;
    require(index < animations.size(), "there is no such animation");
    cumulet_animation_info out{};
    copy_text(animations[index].name, out.name, sizeof out.name);
    out.duration = animations[index].duration;
    write_desc(info, out, "cumulet_animation_info");
  });
}

cumulet_status cumulet_surfaces_get_variant(const cumulet_surfaces* surfaces, uint32_t index,
                                            cumulet_variant_info* info) {
  return guarded(nullptr, 0, [&] {
    require(surfaces != nullptr, "surfaces is NULL");
    const auto& variants = surfaces->asset->scene().variants;
    require(index < variants.size(), "there is no such variant");
    cumulet_variant_info out{};
    copy_text(variants[index].name, out.name, sizeof out.name);
    write_desc(info, out, "cumulet_variant_info");
  });
}
