#pragma once

// Private to surface/: a primitive of KHR_draco_mesh_compression.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "surface/gltf_file.hpp"

namespace cumulet::surface::detail {

class DracoMesh {
 public:
  DracoMesh() = default;
  DracoMesh(const DracoMesh&) = delete;
  DracoMesh& operator=(const DracoMesh&) = delete;
  virtual ~DracoMesh() = default;

  [[nodiscard]] virtual std::size_t vertex_count() const = 0;
  [[nodiscard]] virtual std::vector<std::uint32_t> indices() const = 0;
  /// Writes components of the vertices `which` of the attribute with Draco's number `id`. `step` is the distance
  /// between vertices in floats. If `normalized`, integers are divided as glTF's normalized ones. Throws Error(file) if
  /// the attribute has fewer components.
  virtual void read(std::uint32_t id, std::size_t components, bool normalized, const std::vector<std::uint32_t>& which,
                    float* to, std::size_t step, const std::string& what) const = 0;
};

/// Decodes bytes that `owner` keeps alive. Throws Error(file) if they are not a mesh of Draco 2.2, or if the mesh is
/// too large for their number. `budget` must outlive the mesh.
std::unique_ptr<DracoMesh> decode_draco(Bytes bytes, const Owner& owner, const std::string& what, Budget& budget);

}  // namespace cumulet::surface::detail
