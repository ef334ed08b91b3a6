#pragma once

// Private to surface/: reads numbers from accessors (glTF 2.0, 3.6.2) of any component type, normalized or sparse.

#include <glm/glm.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "surface/gltf_file.hpp"

namespace cumulet::surface::detail {

class Accessors {
 public:
  Accessors(const GltfFile& file, Budget& budget) : file_(file), budget_(budget) {}

  /// Number of elements. Throws if the accessor does not exist or exceeds its buffer view.
  [[nodiscard]] std::size_t count(int accessor, const std::string& what) const;
  /// A type constant of tinygltf, such as TINYGLTF_TYPE_VEC3.
  [[nodiscard]] int type(int accessor, const std::string& what) const { return at(accessor, what).type; }

  /// Returns the elements `which` (null: all) as floats; integers are normalized if the accessor says so. Throws for a
  /// type other than VEC<N>, except that VEC3 is accepted for VEC4: w is then `w`.
  template <int N>
  std::vector<glm::vec<N, float>> vectors(int accessor, const std::string& what,
                                          const std::vector<std::uint32_t>* which = nullptr, float w = 1.0F) const {
    const std::size_t n = which != nullptr ? which->size() : count(accessor, what);
    budget_.take(n, sizeof(glm::vec<N, float>), what);
    std::vector<glm::vec<N, float>> result(n);
    if constexpr (N == 4) {
      if (type(accessor, what) == TINYGLTF_TYPE_VEC3) {
        for (auto& element : result) element.w = w;
        if (n > 0) read(accessor, TINYGLTF_TYPE_VEC3, glm::value_ptr(result[0]), 4, which, what);
        return result;
      }
    }
    if (n > 0) read(accessor, N, glm::value_ptr(result[0]), N, which, what);
    return result;
  }
  std::vector<float> scalars(int accessor, const std::string& what) const;
  std::vector<glm::mat4> matrices(int accessor, const std::string& what) const;
  /// Returns unsigned integers of an accessor with `components` components that is not normalized.
  std::vector<std::uint32_t> integers(int accessor, std::size_t components, const std::string& what,
                                      const std::vector<std::uint32_t>* which = nullptr) const;

 private:
  struct Layout {
    const std::uint8_t* data = nullptr;  ///< null: zeros
    std::size_t stride = 0;
    std::size_t size = 0;  ///< bytes per element
    std::size_t components = 0;
    const std::uint8_t* sparse_indices = nullptr;
    int sparse_index_type = 0;
    const std::uint8_t* sparse_values = nullptr;
    std::size_t sparse_count = 0;
  };

  [[nodiscard]] const tinygltf::Accessor& at(int accessor, const std::string& what) const;
  [[nodiscard]] Layout layout(const tinygltf::Accessor& accessor, const std::string& what) const;
  [[nodiscard]] std::span<const std::uint8_t> view(int index, std::uint64_t offset, std::uint64_t size,
                                                   const std::string& what) const;
  /// Writes the components of the elements; `step` is the distance between elements in floats.
  void read(int accessor, int expected_type, float* to, std::size_t step, const std::vector<std::uint32_t>* which,
            const std::string& what) const;
  /// Calls visit(n, bytes) for the n-th requested element; bytes is null for zeros.
  template <class Visit>
  void each(const tinygltf::Accessor& accessor, const std::vector<std::uint32_t>* which, const std::string& what,
            const Visit& visit) const;

  const GltfFile& file_;
  Budget& budget_;
};

}  // namespace cumulet::surface::detail
