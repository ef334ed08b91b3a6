#pragma once

// Private to surface/: imports images, textures, materials and lights of a glTF file.

#include "surface/gltf_file.hpp"
#include "surface/material_motion.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface::detail {

/// Fills images, textures and materials. The last material is the default one (glTF 2.0, 3.9.6), for primitives without
/// a material. An image that cannot be read is logged as a warning and left out with its textures. Returns the
/// materials in their animatable form.
std::vector<MovableMaterial> import_materials(const GltfFile& file, const Log& log, const std::string& name,
                                              Budget& budget, Progress* progress, Scene& scene);

struct DecodedImage {
  Image image;
  std::string damage;  ///< why some pixels are missing; empty: none are
};

/// Decodes a PNG, JPEG or WebP, whose bytes `owner` keeps alive. 16-bit channels are rounded to 8 bits. Throws
/// Error(file).
DecodedImage decode_image(Bytes bytes, const Owner& owner, Budget& budget);

/// Imports a light without position and direction, which its node defines.
MovableLight import_light(const tinygltf::Light& light, const std::string& what);
/// Imports a camera without its transform, which its node defines.
SceneCamera import_camera(const tinygltf::Camera& camera, const std::string& what);

}  // namespace cumulet::surface::detail
