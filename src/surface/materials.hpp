#pragma once

// Private to surface/: images, textures, materials and lights of a glTF file.

#include "surface/gltf_file.hpp"
#include "surface/material_motion.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface::detail {

/// Fills images, textures and materials; the last material is the default one (glTF 2.0, 3.9.6), for primitives that
/// name none. An image that cannot be had costs a warning, and is left out with its textures. Returns the materials as
/// animations move them.
std::vector<MovableMaterial> import_materials(const GltfFile& file, const Log& log, const std::string& name,
                                              Budget& budget, Progress* progress, Scene& scene);

struct DecodedImage {
  Image image;
  std::string damage;  ///< why some of its pixels are missing; empty if they are not
};

/// Decodes a PNG, JPEG or WebP, whose bytes `owner` keeps; 16-bit channels are rounded to 8. Throws Error(file).
DecodedImage decode_image(Bytes bytes, const Owner& owner, Budget& budget);

/// A number of the file as a float: what is too large for one becomes the largest.
float narrow(double value);

/// Where the light is and shines is left to the node.
MovableLight import_light(const tinygltf::Light& light, const std::string& what);
/// Where the camera is is left to the node.
SceneCamera import_camera(const tinygltf::Camera& camera, const std::string& what);

}  // namespace cumulet::surface::detail
