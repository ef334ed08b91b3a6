#include "surface/meshes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "surface/draco_mesh.hpp"
#include "surface/materials.hpp"

namespace cumulet::surface::detail {

namespace {

constexpr std::size_t max_influence_sets = 4;

bool finite(const glm::vec2& v) { return std::isfinite(v.x) && std::isfinite(v.y); }
bool finite(const glm::vec4& v) { return detail::finite(glm::vec3(v)) && std::isfinite(v.w); }

/// Replaces non-finite values by zero. Returns true if there was any.
template <class V>
bool replace_not_finite(std::vector<V>& values) {
  bool any = false;
  for (V& value : values) {
    bool good = false;
    if constexpr (std::is_same_v<V, glm::vec3>) {
      good = detail::finite(value);
    } else {
      good = finite(value);
    }
    if (good) continue;
    value = V(0.0F);
    any = true;
  }
  return any;
}

/// Renumbers indices to the referenced vertices; returns those vertices.
std::vector<std::uint32_t> compact(std::vector<std::uint32_t>& indices, std::size_t count) {
  std::vector<std::uint32_t> used;
  if (count / 8 > indices.size()) {
    used = indices;
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    for (std::uint32_t& index : indices) {
      index = static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), index) - used.begin());
    }
    return used;
  }
  constexpr std::uint32_t unused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> new_index(count, unused);
  for (const std::uint32_t index : indices) new_index[index] = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (new_index[i] == unused) continue;
    new_index[i] = static_cast<std::uint32_t>(used.size());
    used.push_back(i);
  }
  for (std::uint32_t& index : indices) index = new_index[index];
  return used;
}

class Primitive {
 public:
  Primitive(const GltfFile& file, const tinygltf::Primitive& primitive, std::string what,
            const std::vector<Material>& materials, std::size_t variants, Budget& budget, MeshRemarks& remarks)
      : file_(file),
        from_(primitive),
        what_(std::move(what)),
        materials_(materials),
        variants_(variants),
        budget_(budget),
        remarks_(remarks),
        accessors_(file, budget) {}

  /// Returns nullopt if the primitive draws no triangles.
  std::optional<MeshPart> import() {
    if (from_.mode < TINYGLTF_MODE_POINTS || from_.mode > TINYGLTF_MODE_TRIANGLE_FAN) {
      malformed(what_ + ": mode " + std::to_string(from_.mode) + " is unknown");
    }
    if (from_.mode < TINYGLTF_MODE_TRIANGLES || !has("POSITION")) {
      ++remarks_.not_triangles;
      return std::nullopt;
    }
    if (any_accessor([this](int accessor) { return file_.without_data(accessor); })) {
      ++remarks_.without_data;
      return std::nullopt;
    }
    // Draco-compressed primitives have their own counts.
    const bool counted = !from_.extensions.contains("KHR_draco_mesh_compression");
    if (counted && any_accessor([this](int accessor) { return file_.without_elements(accessor); })) {
      ++remarks_.without_elements;
      return std::nullopt;
    }
    decompress();
    part_.material = static_cast<std::uint32_t>(materials_.size() - 1);
    if (from_.material >= 0) part_.material = known_material(from_.material);
    read_variants();
    count_ = draco_ ? draco_->vertex_count() : accessors_.count(from_.attributes.at("POSITION"), label("POSITION"));
    check_counts();
    read_triangles();
    read_geometry();
    read_attributes();
    read_skin();
    read_targets();
    // Non-finite values are replaced, except in positions.
    if (not_finite_) ++remarks_.not_finite;
    return std::move(part_);
  }

 private:
  template <class Predicate>
  [[nodiscard]] bool any_accessor(const Predicate& predicate) const {
    const auto any = [&](const auto& attributes) {
      return std::ranges::any_of(attributes, [&](const auto& attribute) { return predicate(attribute.second); });
    };
    return predicate(from_.indices) || any(from_.attributes) || std::ranges::any_of(from_.targets, any);
  }
  [[nodiscard]] bool has(const std::string& attribute) const { return from_.attributes.contains(attribute); }
  [[nodiscard]] std::string label(const std::string& attribute) const { return what_ + ", " + attribute; }

  void decompress() {
    const auto found = from_.extensions.find("KHR_draco_mesh_compression");
    if (found == from_.extensions.end()) return;
    const tinygltf::Value& extension = found->second;
    if (!extension.Has("bufferView") || !extension.Has("attributes")) {
      malformed(what_ + ": KHR_draco_mesh_compression is malformed");
    }
    const auto compressed = naming(what_, [&] { return file_.view(extension.Get("bufferView").GetNumberAsInt()); });
    draco_ = decode_draco(compressed, file_.storage, what_, budget_);
    for (const auto& [name, id] : extension.Get("attributes").Get<tinygltf::Value::Object>()) {
      draco_ids_[name] = static_cast<std::uint32_t>(id.GetNumberAsInt());
    }
  }

  void check_counts() {
    for (const auto& [name, accessor] : from_.attributes) {
      if (name.starts_with('_')) continue;
      std::size_t count = 0;
      if (draco_ids_.contains(name)) {
        // The accessor only describes how to read the numbers.
        if (static_cast<std::size_t>(accessor) >= file_.model.accessors.size()) {
          malformed(label(one_line(name)) + ": there is no accessor " + std::to_string(accessor));
        }
        continue;
      }
      count = accessors_.count(accessor, label(one_line(name)));
      if (count != count_) {
        malformed(label(one_line(name)) + " has " + std::to_string(count) + " elements for " + std::to_string(count_) +
                  " vertices");
      }
    }
  }

  void read_triangles() {
    std::vector<std::uint32_t> indices;
    if (draco_) {
      indices = draco_->indices();
      budget_.take(indices.size(), sizeof(std::uint32_t), what_);
    } else if (from_.indices >= 0) {
      indices = accessors_.integers(from_.indices, 1, label("indices"));
    } else {
      budget_.take(count_, sizeof(std::uint32_t), what_);
      indices.resize(count_);
      for (std::uint32_t i = 0; i < count_; ++i) indices[i] = i;
    }
    for (const std::uint32_t index : indices) {
      if (index >= count_) {
        malformed(what_ + ": index " + std::to_string(index) + " is out of range, of " + std::to_string(count_) +
                  " vertices");
      }
    }
    const int mode = draco_ ? TINYGLTF_MODE_TRIANGLES : from_.mode;
    if (mode == TINYGLTF_MODE_TRIANGLES ? indices.size() % 3 != 0 : indices.size() < 3) ++remarks_.incomplete;
    budget_.take(indices.size(), 3 * sizeof(std::uint32_t), what_);
    part_.indices = triangles(indices, mode);
    part_.flat = !has("NORMAL");
    budget_.take(count_, sizeof(std::uint32_t), what_);
    which_ = own_vertices(part_, count_);
  }

  template <int N>
  std::vector<glm::vec<N, float>> vectors(const std::string& name, float w = 1.0F) {
    const int accessor = from_.attributes.at(name);
    const auto id = draco_ids_.find(name);
    if (id == draco_ids_.end()) return accessors_.vectors<N>(accessor, label(name), &which_, w);
    budget_.take(which_.size(), sizeof(glm::vec<N, float>), what_);
    std::vector<glm::vec<N, float>> result(which_.size());
    const int type = accessors_.type(accessor, label(name));
    int components = N;
    if (N == 4 && type == TINYGLTF_TYPE_VEC3) {
      components = 3;
      for (auto& element : result) element[N - 1] = w;
    } else if (type != N) {
      malformed(label(name) + " has the wrong type of element");
    }
    if (!result.empty()) {
      draco_->read(id->second, static_cast<std::size_t>(components),
                   file_.model.accessors[static_cast<std::size_t>(accessor)].normalized, which_,
                   glm::value_ptr(result[0]), N, label(name));
    }
    return result;
  }

  void read_geometry() {
    part_.positions = vectors<3>("POSITION");
    for (const glm::vec3& position : part_.positions) {
      if (!detail::finite(position)) malformed(label("POSITION") + " is not finite");
    }
    if (!part_.flat) read_normals();
    const TextureUse* const map = tangent_map();
    if (map == nullptr) return;
    if (!part_.flat && has("TANGENT")) {
      part_.tangents = vectors<4>("TANGENT");
      not_finite_ |= replace_not_finite(part_.tangents);
      for (std::size_t i = 0; i < part_.tangents.size(); ++i) {
        glm::vec4& tangent = part_.tangents[i];
        const float length = glm::length(glm::vec3(tangent));
        const glm::vec3 direction =
            length > 0.0F && std::isfinite(length) ? glm::vec3(tangent) / length : any_perpendicular(part_.normals[i]);
        tangent = glm::vec4(direction, tangent.w < 0.0F ? -1.0F : 1.0F);
      }
      return;
    }
    const std::string set = "TEXCOORD_" + std::to_string(map->uv_set);
    std::vector<glm::vec2> uvs(part_.positions.size());
    if (has(set)) uvs = vectors<2>(set);
    replace_not_finite(uvs);
    for (glm::vec2& uv : uvs) uv = map->transform * glm::vec3(uv, 1.0F);
    std::vector<std::uint32_t> origins;
    budget_.take(part_.indices.size(), 96, what_);  // of the tables of make_tangents()
    part_.tangents = make_tangents(part_.indices, part_.positions, part_.flat ? flat_normals() : part_.normals, uvs,
                                   origins, [this](std::size_t turn) { budget_.check(turn); });
    for (const std::uint32_t origin : origins) {
      which_.push_back(which_[origin]);
      part_.positions.push_back(part_.positions[origin]);
      if (!part_.flat) part_.normals.push_back(part_.normals[origin]);
    }
  }

  void read_normals() {
    part_.normals = vectors<3>("NORMAL");
    not_finite_ |= replace_not_finite(part_.normals);
    make_unit(part_);
  }

  [[nodiscard]] std::vector<glm::vec3> flat_normals() const {
    std::vector<glm::vec3> normals(part_.positions.size(), glm::vec3(0.0F, 1.0F, 0.0F));
    for (std::size_t i = 0; i + 3 <= normals.size(); i += 3) {
      const glm::vec3 area =
          glm::cross(part_.positions[i + 1] - part_.positions[i], part_.positions[i + 2] - part_.positions[i]);
      const float length = glm::length(area);
      if (!(length > 0.0F) || !std::isfinite(length)) continue;
      for (std::size_t k = 0; k < 3; ++k) normals[i + k] = area / length;
    }
    return normals;
  }

  void read_attributes() {
    budget_.take(which_.size(), sizeof(VertexAttributes), what_);
    part_.attributes.resize(which_.size());
    for (std::size_t set = 0; set < 2; ++set) {
      const std::string name = "TEXCOORD_" + std::to_string(set);
      if (!has(name)) continue;
      std::vector<glm::vec2> uvs = vectors<2>(name);
      not_finite_ |= replace_not_finite(uvs);
      for (std::size_t i = 0; i < uvs.size(); ++i) part_.attributes[i].uv[set] = uvs[i];
    }
    if (!has("COLOR_0")) return;
    std::vector<glm::vec4> colors = vectors<4>("COLOR_0");
    not_finite_ |= replace_not_finite(colors);
    for (std::size_t i = 0; i < colors.size(); ++i) {
      part_.attributes[i].color = glm::clamp(colors[i], glm::vec4(0.0F), glm::vec4(glm::vec3(1e6F), 1.0F));
    }
  }

  /// Reads integers without conversion: joints.
  std::vector<std::uint32_t> integers(const std::string& name) {
    const int accessor = from_.attributes.at(name);
    const auto id = draco_ids_.find(name);
    if (id == draco_ids_.end()) return accessors_.integers(accessor, 4, label(name), &which_);
    const std::vector<glm::vec4> values = vectors<4>(name);
    std::vector<std::uint32_t> result;
    result.reserve(values.size() * 4);
    for (const glm::vec4& value : values) {
      for (int c = 0; c < 4; ++c) {
        if (!(value[c] >= 0.0F && value[c] <= 65535.0F)) malformed(label(name) + " does not contain unsigned integers");
        result.push_back(static_cast<std::uint32_t>(value[c]));
      }
    }
    return result;
  }

  void read_skin() {
    std::size_t sets = 0;
    while (sets < max_influence_sets && has("JOINTS_" + std::to_string(sets)) &&
           has("WEIGHTS_" + std::to_string(sets))) {
      ++sets;
    }
    if (sets == 0) return;
    const std::size_t n = which_.size();
    part_.influences = 4 * sets;
    budget_.take(n * part_.influences, sizeof(std::uint32_t) + sizeof(float), what_);
    part_.joints.resize(n * part_.influences);
    part_.weights.resize(n * part_.influences);
    for (std::size_t set = 0; set < sets; ++set) {
      const std::vector<std::uint32_t> joints = integers("JOINTS_" + std::to_string(set));
      std::vector<glm::vec4> weights = vectors<4>("WEIGHTS_" + std::to_string(set), 0.0F);
      not_finite_ |= replace_not_finite(weights);
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t c = 0; c < 4; ++c) {
          const float weight = narrow(std::max(weights[i][static_cast<int>(c)], 0.0F));
          const std::size_t to = i * part_.influences + 4 * set + c;
          part_.weights[to] = weight;
          part_.joints[to] = weight > 0.0F ? joints[4 * i + c] : 0;
          if (weight > 0.0F) part_.joint_count = std::max(part_.joint_count, joints[4 * i + c] + 1);
        }
      }
    }
    part_.joint_count = std::max(part_.joint_count, 1U);
    for (std::size_t i = 0; i < n; ++i) {
      float* weights = &part_.weights[i * part_.influences];
      float sum = 0.0F;
      for (std::size_t c = 0; c < part_.influences; ++c) sum += weights[c];
      // A vertex without weights is bound to the first joint, which keeps it near the others.
      if (!(sum > 0.0F)) weights[0] = sum = 1.0F;
      for (std::size_t c = 0; c < part_.influences; ++c) weights[c] /= sum;
    }
  }

  [[nodiscard]] std::uint32_t known_material(int number) const {
    // The last material is the default one, which has no number.
    if (number < 0 || static_cast<std::size_t>(number) + 1 >= materials_.size()) {
      malformed(what_ + ": there is no material " + std::to_string(number));
    }
    return static_cast<std::uint32_t>(number);
  }

  /// KHR_materials_variants: variants without a mapping keep the part's material.
  void read_variants() {
    budget_.take(variants_, sizeof(std::uint32_t), what_);
    part_.variants.assign(variants_, part_.material);
    const auto extension = from_.extensions.find("KHR_materials_variants");
    if (extension == from_.extensions.end() || !extension->second.Has("mappings")) return;
    const tinygltf::Value& mappings = extension->second.Get("mappings");
    for (std::size_t m = 0; m < mappings.ArrayLen(); ++m) {
      const tinygltf::Value& mapping = mappings.Get(static_cast<int>(m));
      if (!mapping.Has("material") || !mapping.Has("variants")) {
        malformed(what_ + ": a mapping of KHR_materials_variants names no material, or no variants");
      }
      const std::uint32_t material = known_material(mapping.Get("material").GetNumberAsInt());
      const tinygltf::Value& variants = mapping.Get("variants");
      for (std::size_t v = 0; v < variants.ArrayLen(); ++v) {
        const auto variant = static_cast<std::size_t>(variants.Get(static_cast<int>(v)).GetNumberAsInt());
        if (variant >= variants_) malformed(what_ + ": there is no variant " + std::to_string(variant));
        part_.variants[variant] = material;
      }
    }
  }

  /// Returns the map that defines the tangents: that of the material, else of the first variant that has one. A part
  /// has only one set of tangents. Null: it needs none.
  [[nodiscard]] const TextureUse* tangent_map() const {
    const TextureUse* map = tangent_map(materials_[part_.material]);
    for (std::size_t v = 0; map == nullptr && v < part_.variants.size(); ++v) {
      map = tangent_map(materials_[part_.variants[v]]);
    }
    return map;
  }

  /// glTF defines tangents by the normal map. Anisotropy without one uses its own texture's coordinates, or the
  /// untransformed first set.
  static const TextureUse* tangent_map(const Material& material) {
    if (material.normal_texture.texture >= 0) return &material.normal_texture;
    return material.anisotropy > 0.0F ? &material.anisotropy_texture : nullptr;
  }

  void read_targets() {
    for (std::size_t t = 0; t < from_.targets.size(); ++t) {
      const auto& target = from_.targets[t];
      MorphTarget& to = part_.targets.emplace_back();
      const auto read = [&](const char* name, std::vector<glm::vec3>& values) {
        const auto found = target.find(name);
        if (found == target.end()) return;
        const std::string what = what_ + ", target " + std::to_string(t) + ", " + name;
        if (accessors_.count(found->second, what) != count_) malformed(what + " does not have one element per vertex");
        values = accessors_.vectors<3>(found->second, what, &which_);
        if (std::string_view(name) == "POSITION") {
          for (const glm::vec3& value : values) {
            if (!detail::finite(value)) malformed(what + " is not finite");
          }
        } else {
          not_finite_ |= replace_not_finite(values);
        }
      };
      read("POSITION", to.positions);
      if (!part_.flat) read("NORMAL", to.normals);
      if (!part_.flat && !part_.tangents.empty() && has("TANGENT")) read("TANGENT", to.tangents);
    }
  }

  const GltfFile& file_;
  const tinygltf::Primitive& from_;
  std::string what_;
  const std::vector<Material>& materials_;
  std::size_t variants_;
  Budget& budget_;
  MeshRemarks& remarks_;
  Accessors accessors_;
  MeshPart part_;
  std::unique_ptr<DracoMesh> draco_;
  std::map<std::string, std::uint32_t> draco_ids_;
  std::size_t count_ = 0;             ///< vertices in the file
  std::vector<std::uint32_t> which_;  ///< for each of the part's vertices: its index in the file
  bool not_finite_ = false;
};

}  // namespace

std::vector<std::uint32_t> triangles(const std::vector<std::uint32_t>& indices, int mode) {
  std::vector<std::uint32_t> result;
  const auto add = [&result](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (a != b && b != c && c != a) result.insert(result.end(), {a, b, c});
  };
  const std::size_t n = indices.size();
  if (mode == TINYGLTF_MODE_TRIANGLES) {
    result.reserve(n);
    for (std::size_t i = 0; i + 3 <= n; i += 3) add(indices[i], indices[i + 1], indices[i + 2]);
  } else {
    if (n > 2) result.reserve((n - 2) * 3);
    for (std::size_t i = 0; i + 3 <= n; ++i) {
      if (mode == TINYGLTF_MODE_TRIANGLE_FAN) {
        add(indices[i + 1], indices[i + 2], indices[0]);
      } else {
        add(indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]);
      }
    }
  }
  return result;
}

std::vector<std::uint32_t> own_vertices(MeshPart& part, std::size_t count) {
  if (!part.flat) return compact(part.indices, count);
  std::vector<std::uint32_t> which = part.indices;
  for (std::uint32_t i = 0; i < part.indices.size(); ++i) part.indices[i] = i;
  return which;
}

void make_unit(MeshPart& part) {
  bool some_missing = false;
  for (glm::vec3& normal : part.normals) {
    const float length = glm::length(normal);
    const bool good = length > 0.0F && std::isfinite(length);
    normal = good ? normal / length : glm::vec3(0.0F);
    some_missing |= !good;
  }
  if (!some_missing) return;
  // Zero-length normals become the average of the triangles around.
  std::vector<glm::vec3> sums(part.normals.size(), glm::vec3(0.0F));
  for (std::size_t i = 0; i < part.indices.size(); i += 3) {
    const std::uint32_t* v = &part.indices[i];
    const glm::vec3 area =
        glm::cross(part.positions[v[1]] - part.positions[v[0]], part.positions[v[2]] - part.positions[v[0]]);
    for (int k = 0; k < 3; ++k) sums[v[k]] += area;
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (part.normals[i] != glm::vec3(0.0F)) continue;
    const float length = glm::length(sums[i]);
    part.normals[i] = length > 0.0F && std::isfinite(length) ? sums[i] / length : glm::vec3(0.0F, 1.0F, 0.0F);
  }
}

std::vector<MeshPart> import_mesh(const GltfFile& file, std::size_t mesh, const std::vector<Material>& materials,
                                  std::size_t variants, Budget& budget, MeshRemarks& remarks) {
  std::vector<MeshPart> parts;
  const tinygltf::Mesh& from = file.model.meshes[mesh];
  for (std::size_t p = 0; p < from.primitives.size(); ++p) {
    auto part = Primitive(file, from.primitives[p], numbered("mesh", mesh) + ", " + numbered("primitive", p), materials,
                          variants, budget, remarks)
                    .import();
    if (part && !part->indices.empty()) parts.push_back(std::move(*part));
  }
  return parts;
}

}  // namespace cumulet::surface::detail
