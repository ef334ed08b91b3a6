#pragma once

// Private to surface/: a glTF file as parsed by tinygltf, with its bytes, before conversion to a scene.

#include <tiny_gltf.h>

#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/detached_work.hpp"
#include "base/log.hpp"
#include "base/progress_part.hpp"
#include "surface/budget.hpp"

namespace cumulet::surface::detail {

/// Location of an image's bytes: a buffer view, a data URI or a file beside the glTF file.
struct ImageSource {
  std::string name;
  std::string uri;
  std::int64_t view = -1;
};

using Bytes = std::span<const std::uint8_t>;
/// Keeps bytes alive for detached threads that still use them.
using Owner = std::shared_ptr<const void>;
/// Marks a buffer that names no data. This is legal (glTF 2.0, 3.6.1): extensions fill such buffers.
struct NoData {};
/// Reason why data that a file refers to cannot be read.
struct Missing {
  std::string cause;
};
/// A buffer, or a decompressed buffer view. Missing data is an error only for a reader that needs it.
using Data = std::variant<Bytes, NoData, Missing>;

/// A channel of KHR_animation_pointer.
struct PointerChannel {
  std::size_t animation = 0;
  int sampler = -1;
  std::string pointer;  ///< JSON pointer
};

struct GltfFile {
  /// The file except for buffers and images, which stay empty. Indices are at least -1 and not checked further.
  tinygltf::Model model;
  std::vector<Data> views;  ///< one per buffer view
  std::vector<ImageSource> images;
  std::vector<PointerChannel> pointers;         ///< channels that `model` lacks
  std::optional<std::filesystem::path> folder;  ///< folder of referenced files; none: they are refused

  using Storage = std::deque<std::vector<std::uint8_t>>;
  std::shared_ptr<Storage> storage = make_deferred_delete<Storage>();  ///< memory that `views` points into

  /// Returns the bytes of a buffer view. Throws Error(file) if it does not exist, or if its buffer has no data.
  [[nodiscard]] Bytes view(std::int64_t index) const;
  /// Returns true if the accessor exists and its buffer names no data.
  [[nodiscard]] bool without_data(int accessor) const;
  /// Returns true if the accessor exists and its count is 0.
  [[nodiscard]] bool without_elements(int accessor) const;
};

/// Parses a .gltf or .glb, distinguished by content. Checks the types of all JSON members that are read, loads buffers
/// and checks views.
GltfFile parse_gltf(std::vector<std::uint8_t> bytes, const std::optional<std::filesystem::path>& folder, const Log& log,
                    const std::string& name, Budget& budget, Progress* progress);

}  // namespace cumulet::surface::detail
