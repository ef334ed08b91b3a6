#include "surface/accessors.hpp"

#include <algorithm>
#include <cstring>

namespace cumulet::surface::detail {

namespace {

template <class T>
T load(const std::uint8_t* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// glTF 2.0, 3.11: c / (2^n - 1), signed max(c / (2^(n-1) - 1), -1).
template <class T>
float component(const std::uint8_t* from, bool normalized) {
  const T value = load<T>(from);
  if constexpr (std::is_same_v<T, float>) {
    return value;
  } else {
    if (!normalized) return static_cast<float>(value);
    return static_cast<float>(
        std::max(static_cast<double>(value) / static_cast<double>(std::numeric_limits<T>::max()), -1.0));
  }
}

using Component = float (*)(const std::uint8_t*, bool);

Component reader(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return component<std::int8_t>;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return component<std::uint8_t>;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return component<std::int16_t>;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return component<std::uint16_t>;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return component<std::uint32_t>;
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return component<float>;
    default:
      return nullptr;
  }
}

std::size_t size_of(int type) {
  return static_cast<std::size_t>(std::max(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(type)), 0));
}

/// Returns 0 for a type that is not an unsigned integer.
std::size_t unsigned_size(int type) {
  const bool good = type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
                    type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  return good ? size_of(type) : 0;
}

std::uint32_t load_unsigned(const std::uint8_t* from, std::size_t size) {
  if (size == 1) return *from;
  return size == 2 ? load<std::uint16_t>(from) : load<std::uint32_t>(from);
}

}  // namespace

const tinygltf::Accessor& Accessors::at(int accessor, const std::string& what) const {
  if (accessor < 0 || static_cast<std::size_t>(accessor) >= file_.model.accessors.size()) {
    malformed(what + ": there is no accessor " + std::to_string(accessor));
  }
  return file_.model.accessors[static_cast<std::size_t>(accessor)];
}

std::size_t Accessors::count(int accessor, const std::string& what) const {
  const tinygltf::Accessor& found = at(accessor, what);
  static_cast<void>(layout(found, what));
  return found.count;
}

std::span<const std::uint8_t> Accessors::view(int index, std::uint64_t offset, std::uint64_t size,
                                              const std::string& what) const {
  const auto bytes = naming(what, [&] { return file_.view(index); });
  if (offset > bytes.size() || size > bytes.size() - offset) {
    malformed(what + " exceeds the " + std::to_string(bytes.size()) + " bytes of buffer view " + std::to_string(index));
  }
  return bytes.subspan(offset, size);
}

Accessors::Layout Accessors::layout(const tinygltf::Accessor& accessor, const std::string& what) const {
  Layout layout;
  const std::size_t component_size = size_of(accessor.componentType);
  if (reader(accessor.componentType) == nullptr || component_size == 0) {
    malformed(what + ": component type " + std::to_string(accessor.componentType) + " is unknown");
  }
  if (accessor.type < 0) malformed(what + " has an unknown element type");
  layout.components =
      static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)));
  layout.size = layout.components * component_size;
  const std::uint64_t count = accessor.count;
  if (count == 0) malformed(what + " has a count of 0");
  if (count > std::numeric_limits<std::uint32_t>::max()) malformed(what + " has more than 2^32 elements");
  if (accessor.bufferView < 0) {
    if (count > budget_.limits().unbacked) {
      malformed(what + ": " + std::to_string(count) + " elements without a buffer view exceed the limit");
    }
  } else {
    const auto index = static_cast<std::size_t>(accessor.bufferView);
    const std::size_t stride = index < file_.model.bufferViews.size() ? file_.model.bufferViews[index].byteStride : 0;
    layout.stride = stride == 0 ? layout.size : stride;
    if (layout.stride < layout.size) malformed(what + ": a stride of " + std::to_string(stride) + " is too small");
    const std::uint64_t size = (count - 1) * layout.stride + layout.size;
    layout.data = view(accessor.bufferView, accessor.byteOffset, size, what).data();
  }
  if (accessor.sparse.isSparse) {
    const auto& sparse = accessor.sparse;
    const std::size_t index_size = unsigned_size(sparse.indices.componentType);
    if (index_size == 0 || sparse.count < 0 || static_cast<std::uint64_t>(sparse.count) > count) {
      malformed(what + " has malformed sparse storage");
    }
    layout.sparse_count = static_cast<std::size_t>(sparse.count);
    layout.sparse_index_type = sparse.indices.componentType;
    layout.sparse_indices = view(sparse.indices.bufferView, static_cast<std::uint64_t>(sparse.indices.byteOffset),
                                 layout.sparse_count * index_size, what)
                                .data();
    layout.sparse_values = view(sparse.values.bufferView, static_cast<std::uint64_t>(sparse.values.byteOffset),
                                layout.sparse_count * layout.size, what)
                               .data();
  }
  return layout;
}

template <class Visit>
void Accessors::each(const tinygltf::Accessor& accessor, const std::vector<std::uint32_t>* which,
                     const std::string& what, const Visit& visit) const {
  const Layout from = layout(accessor, what);
  std::vector<std::uint32_t> replaced(from.sparse_count);
  const std::size_t index_size = unsigned_size(from.sparse_index_type);
  for (std::size_t i = 0; i < replaced.size(); ++i) {
    replaced[i] = load_unsigned(from.sparse_indices + i * index_size, index_size);
    if (replaced[i] >= accessor.count || (i > 0 && replaced[i] <= replaced[i - 1])) {
      malformed(what + ": sparse indices are not increasing or exceed the count");
    }
  }
  const std::size_t count = which != nullptr ? which->size() : accessor.count;
  for (std::size_t n = 0; n < count; ++n) {
    budget_.check(n);
    const std::size_t i = which != nullptr ? (*which)[n] : n;
    const std::uint8_t* bytes = from.data == nullptr ? nullptr : from.data + i * from.stride;
    if (!replaced.empty()) {
      const auto found = std::lower_bound(replaced.begin(), replaced.end(), i);
      if (found != replaced.end() && *found == i) {
        bytes = from.sparse_values + static_cast<std::size_t>(found - replaced.begin()) * from.size;
      }
    }
    visit(n, bytes);
  }
}

void Accessors::read(int accessor, int expected_type, float* to, std::size_t step,
                     const std::vector<std::uint32_t>* which, const std::string& what) const {
  const tinygltf::Accessor& from = at(accessor, what);
  if (from.type != expected_type) malformed(what + " has the wrong type of element");
  const Component convert = reader(from.componentType);
  const std::size_t size = size_of(from.componentType);
  const auto components =
      static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(from.type)));
  each(from, which, what, [&](std::size_t n, const std::uint8_t* bytes) {
    for (std::size_t c = 0; c < components; ++c) {
      to[n * step + c] = bytes == nullptr ? 0.0F : convert(bytes + c * size, from.normalized);
    }
  });
}

std::vector<float> Accessors::scalars(int accessor, const std::string& what) const {
  std::vector<float> result;
  const std::size_t n = count(accessor, what);
  budget_.take(n, sizeof(float), what);
  result.resize(n);
  read(accessor, TINYGLTF_TYPE_SCALAR, result.data(), 1, nullptr, what);
  return result;
}

std::vector<glm::mat4> Accessors::matrices(int accessor, const std::string& what) const {
  const std::size_t n = count(accessor, what);
  // Smaller component types have padded columns.
  if (at(accessor, what).componentType != TINYGLTF_COMPONENT_TYPE_FLOAT) malformed(what + " does not contain floats");
  budget_.take(n, sizeof(glm::mat4), what);
  std::vector<glm::mat4> result(n);
  read(accessor, TINYGLTF_TYPE_MAT4, glm::value_ptr(result[0]), 16, nullptr, what);
  return result;
}

std::vector<std::uint32_t> Accessors::integers(int accessor, std::size_t components, const std::string& what,
                                               const std::vector<std::uint32_t>* which) const {
  const std::size_t n = which != nullptr ? which->size() : count(accessor, what);
  const tinygltf::Accessor& from = at(accessor, what);
  const std::size_t size = unsigned_size(from.componentType);
  const int expected = components == 1 ? TINYGLTF_TYPE_SCALAR : static_cast<int>(components);
  if (from.type != expected || size == 0 || from.normalized) malformed(what + " does not contain unsigned integers");
  budget_.take(n, components * sizeof(std::uint32_t), what);
  std::vector<std::uint32_t> result(n * components);
  each(from, which, what, [&](std::size_t i, const std::uint8_t* bytes) {
    for (std::size_t c = 0; c < components; ++c) {
      result[i * components + c] = bytes == nullptr ? 0 : load_unsigned(bytes + c * size, size);
    }
  });
  return result;
}

}  // namespace cumulet::surface::detail
