#pragma once

// Writes small glTF files for tests: accessors over one buffer, and any JSON members that a test adds.

#include <array>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/base64.hpp"

namespace cumulet::test {

using nlohmann::json;
using Bytes = std::vector<std::uint8_t>;

template <class T>
Bytes bytes_of(const std::vector<T>& values) {
  Bytes bytes(values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

class GltfModel {
 public:
  json root = {{"asset", {{"version", "2.0"}}}};

  /// Adds a buffer view of these bytes and returns its index.
  int view(const Bytes& bytes, const json& more = json::object()) {
    while (data_.size() % 4 != 0) data_.push_back(0);
    json made = {{"buffer", 0}, {"byteOffset", data_.size()}, {"byteLength", bytes.size()}};
    made.update(more);
    data_.insert(data_.end(), bytes.begin(), bytes.end());
    return add("bufferViews", made);
  }

  /// Adds an accessor and returns its index. `components` is the count of numbers per element.
  template <class T>
  int accessor(const char* type, std::size_t components, const std::vector<T>& values,
               const json& more = json::object()) {
    json made = {{"bufferView", view(bytes_of(values))},
                 {"componentType", component_type<T>()},
                 {"count", values.size() / components},
                 {"type", type}};
    made.update(more);
    return add("accessors", made);
  }
  int vec3(const std::vector<float>& values) { return accessor("VEC3", 3, values); }
  int vec2(const std::vector<float>& values) { return accessor("VEC2", 2, values); }
  int scalars(const std::vector<float>& values) { return accessor("SCALAR", 1, values); }

  int add(const char* list, const json& element) {
    root[list].push_back(element);
    return static_cast<int>(root[list].size()) - 1;
  }

  /// Adds a mesh of one primitive under a new node and returns the node's index.
  int show(const json& primitive, const json& node = json::object()) {
    json made = node;
    made["mesh"] = add("meshes", {{"primitives", json::array({primitive})}});
    return add("nodes", made);
  }

  /// Three vertices at the origin, at x = 1 and at y = 1. Returns the accessor of their positions.
  int triangle() { return vec3({0, 0, 0, 1, 0, 0, 0, 1, 0}); }

  [[nodiscard]] const Bytes& data() const { return data_; }

  /// The file as .gltf with the buffer as a data URI. Buffers that the test adds come after it.
  [[nodiscard]] Bytes gltf() const {
    json whole = root;
    if (!data_.empty()) {
      whole["buffers"] =
          buffers({{"byteLength", data_.size()}, {"uri", "data:application/octet-stream;base64," + base64(data_)}});
    }
    const std::string text = whole.dump();
    return {text.begin(), text.end()};
  }

  [[nodiscard]] Bytes glb() const {
    json whole = root;
    if (!data_.empty()) whole["buffers"] = buffers({{"byteLength", data_.size()}});
    return pack(whole.dump(), data_);
  }

  /// A .glb of these chunks.
  static Bytes pack(std::string text, Bytes data) {
    while (text.size() % 4 != 0) text += ' ';
    while (data.size() % 4 != 0) data.push_back(0);
    Bytes bytes;
    const auto word = [&bytes](std::size_t value) {
      for (unsigned k = 0; k < 4; ++k) bytes.push_back(static_cast<std::uint8_t>(value >> (8U * k)));
    };
    word(0x46546C67);
    word(2);
    word(12 + 8 + text.size() + (data.empty() ? 0 : 8 + data.size()));
    word(text.size());
    word(0x4E4F534A);
    bytes.insert(bytes.end(), text.begin(), text.end());
    if (!data.empty()) {
      word(data.size());
      word(0x004E4942);
      bytes.insert(bytes.end(), data.begin(), data.end());
    }
    return bytes;
  }

 private:
  [[nodiscard]] json buffers(const json& first) const {
    json list = json::array({first});
    if (root.contains("buffers")) list.insert(list.end(), root["buffers"].begin(), root["buffers"].end());
    return list;
  }

  template <class T>
  static int component_type() {
    if constexpr (std::is_same_v<T, std::int8_t>) return 5120;
    if constexpr (std::is_same_v<T, std::uint8_t>) return 5121;
    if constexpr (std::is_same_v<T, std::int16_t>) return 5122;
    if constexpr (std::is_same_v<T, std::uint16_t>) return 5123;
    if constexpr (std::is_same_v<T, std::uint32_t>) return 5125;
    return 5126;
  }

  Bytes data_;
};

}  // namespace cumulet::test
