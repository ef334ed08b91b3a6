#pragma once

#include <tiny_gltf.h>

#include <glm/glm.hpp>
#include <string>
#include <utility>
#include <vector>

#include "mesh.hpp"

namespace cumulet::scene {

/// Builds a glTF scene. Each function adds an element and returns its index in the file.
class GltfWriter {
 public:
  GltfWriter();

  /// RGB, `size` x `size` pixels, repeated.
  int texture(const std::string& name, int size, const std::vector<std::uint8_t>& rgb);
  int material(const std::string& name, const glm::vec3& color, double metallic, double roughness);
  /// A material with emitted radiance; uses KHR_materials_emissive_strength for values above 1.
  int glowing(const std::string& name, const glm::vec3& color, const glm::vec3& radiance);
  /// Adds a mesh with one primitive per material.
  int mesh(const std::string& name, const std::vector<std::pair<const Mesh*, int>>& parts);

  /// parent, mesh: -1 means none.
  int node(const std::string& name, int parent, int mesh, const glm::vec3& at = glm::vec3(0.0F));
  /// Attaches a camera that looks from the node at `target`.
  void attach_camera(int node, const glm::vec3& target, double vertical_fov, double aspect);
  /// Rotates the node about +Y once per `seconds`, endlessly, because animations loop.
  void spin(const std::string& name, int node, double seconds);

  tinygltf::Material& at(int material) { return model_.materials[static_cast<std::size_t>(material)]; }

  /// Returns the content of a .glb file. Throws std::runtime_error.
  [[nodiscard]] std::string glb();

 private:
  template <class T>
  int accessor(const std::vector<T>& values, int type, int component_type, int target);
  void use(const std::string& extension);

  tinygltf::Model model_;
};

}  // namespace cumulet::scene
