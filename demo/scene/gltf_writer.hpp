#pragma once

#include <tiny_gltf.h>

#include <glm/glm.hpp>
#include <string>
#include <utility>
#include <vector>

#include "mesh.hpp"

namespace cumulet::scene {

/// Puts a glTF scene together. Each adds something and gives its number in the file.
class GltfWriter {
 public:
  GltfWriter();

  /// RGB, `size` pixels an edge, repeated.
  int texture(const std::string& name, int size, const std::vector<std::uint8_t>& rgb);
  int material(const std::string& name, const glm::vec3& color, double metallic, double roughness);
  /// Radiance, by KHR_materials_emissive_strength where it is above 1.
  int glowing(const std::string& name, const glm::vec3& color, const glm::vec3& radiance);
  /// One primitive a material.
  int mesh(const std::string& name, const std::vector<std::pair<const Mesh*, int>>& parts);

  /// parent, mesh: -1 for none.
  int node(const std::string& name, int parent, int mesh, const glm::vec3& at = glm::vec3(0.0F));
  /// The node looks from its place at `target`.
  void attach_camera(int node, const glm::vec3& target, double vertical_fov, double aspect);
  /// Turns the node about +Y once in `seconds`, for ever: animations loop.
  void spin(const std::string& name, int node, double seconds);

  tinygltf::Material& at(int material) { return model_.materials[static_cast<std::size_t>(material)]; }

  /// The .glb. Throws std::runtime_error.
  [[nodiscard]] std::string glb();

 private:
  template <class T>
  int accessor(const std::vector<T>& values, int type, int component_type, int target);
  void use(const std::string& extension);

  tinygltf::Model model_;
};

}  // namespace cumulet::scene
