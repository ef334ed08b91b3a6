#pragma once

// Private to surface/: a glTF file as tinygltf sees it, with its bytes, before anything is made of them.

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

#include "base/apart.hpp"
#include "base/error.hpp"
#include "base/log.hpp"
#include "base/one_line.hpp"
#include "base/progress_part.hpp"
#include "surface/gltf_import.hpp"

namespace cumulet::surface::detail {

/// Ends an import; import_gltf() puts the file's name in front. One line.
[[noreturn]] void malformed(const std::string& cause);
/// A text of the file's or a library's as a part of one line, not too long.
inline std::string one_line(std::string_view text) { return cumulet::one_line(text, 200); }
/// What `body` gives; an Error of its gets "what: " in front.
template <class Body>
auto naming(const std::string& what, const Body& body) {
  try {
    return body();
  } catch (const Error& error) {
    throw Error(error.code(), what + ": " + error.what());
  }
}
/// "node 3" and the like.
inline std::string numbered(std::string_view what, std::size_t number) {
  return std::string(what) + " " + std::to_string(number);
}

/// What an import may still allocate. Counts in a file are checked against it before memory is asked for.
class Budget {
 public:
  Budget(const GltfLimits& limits, const Progress* progress)
      : limits_(limits), left_(limits.memory), progress_(progress) {}

  /// Throws if count * size bytes are too many, and Error(cancelled): what takes memory takes time.
  void take(std::uint64_t count, std::uint64_t size, std::string_view what);
  [[nodiscard]] std::uint64_t left() const { return left_; }
  [[nodiscard]] const GltfLimits& limits() const { return limits_; }
  /// For long loops: throws Error(cancelled) now and then.
  void check(std::size_t turn) const {
    if (turn % 16384 == 0) cumulet::check(progress_);
  }
  /// For a call of apart() that works on so many bytes: few are not worth a thread.
  [[nodiscard]] const Progress* progress_for(std::uint64_t bytes) const {
    constexpr std::uint64_t few = 65536;
    return bytes < few ? nullptr : progress_;
  }

 private:
  GltfLimits limits_;
  std::uint64_t left_;
  const Progress* progress_;
};

/// Where an image's bytes are: in a buffer view, in a data URI or in a file beside the glTF file.
struct ImageSource {
  std::string name;
  std::string uri;
  std::int64_t view = -1;
};

using Bytes = std::span<const std::uint8_t>;
/// Keeps bytes for whoever is left to work on them.
using Owner = std::shared_ptr<const void>;
/// Of a buffer that names no data, which is legal (glTF 2.0, 3.6.1): it is for others to fill.
struct NoData {};
/// Why data that a file names cannot be had.
struct Missing {
  std::string cause;
};
/// A buffer, or a buffer view, decompressed. What is not there matters to who reads it.
using Data = std::variant<Bytes, NoData, Missing>;

/// A channel of KHR_animation_pointer.
struct PointerChannel {
  std::size_t animation = 0;
  int sampler = -1;
  std::string pointer;  ///< JSON's
};

struct GltfFile {
  /// All but buffers and images, which stay empty. An index in it is -1 or at least 0, but not checked further.
  tinygltf::Model model;
  std::vector<Data> views;  ///< a buffer view each
  std::vector<ImageSource> images;
  std::vector<PointerChannel> pointers;         ///< channels that the model lacks
  std::optional<std::filesystem::path> folder;  ///< where files that it refers to are; none: nowhere

  using Storage = std::deque<std::vector<std::uint8_t>>;
  std::shared_ptr<Storage> storage = make_left<Storage>();  ///< what views point into

  /// The bytes of a buffer view. Throws Error(file) if there is no such one, or if its buffer has no data.
  [[nodiscard]] Bytes view(std::int64_t index) const;
  /// Whether an accessor, if there is such a one, lies in a buffer that names no data.
  [[nodiscard]] bool without_data(int accessor) const;
  /// Whether there is such an accessor, and its count is 0.
  [[nodiscard]] bool without_elements(int accessor) const;
};

/// Reads a whole regular file. Throws Error(file) that names the cause only.
std::vector<std::uint8_t> read_file(const std::filesystem::path& path, Budget& budget);

/// Parses a .gltf or .glb, told apart by content, checks types of all JSON members that are read, loads buffers and
/// checks views.
GltfFile parse_gltf(std::vector<std::uint8_t> bytes, const std::optional<std::filesystem::path>& folder, const Log& log,
                    const std::string& name, Budget& budget, Progress* progress);

/// EXT_meshopt_compression, of one buffer view: its bytes in `from`, which `owner` keeps. Throws Error(file).
std::vector<std::uint8_t> decode_meshopt(const tinygltf::Value& extension, std::span<const std::uint8_t> from,
                                         const Owner& owner, const std::string& what, Budget& budget);

}  // namespace cumulet::surface::detail
