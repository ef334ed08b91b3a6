#pragma once

// Private to volume/: what the two file readers hand to the shared half of the importer.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "base/log.hpp"
#include "volume/volume.hpp"

namespace cumulet::volume::detail {

/// Word x holds the 64 voxels of the slab x; bit y * 8 + z (both libraries' leaf masks).
using ActiveMask = std::array<std::uint64_t, brick_size>;

/// The leaves of one grid, still in their library's own memory. Safe to read from many threads.
class LeafSource {
 public:
  LeafSource() = default;
  LeafSource(const LeafSource&) = delete;
  LeafSource& operator=(const LeafSource&) = delete;
  virtual ~LeafSource() = default;

  [[nodiscard]] virtual std::size_t count() const = 0;
  [[nodiscard]] virtual glm::ivec3 origin(std::size_t leaf) const = 0;
  [[nodiscard]] virtual ActiveMask active(std::size_t leaf) const = 0;
  /// All 512 values, active or not, z fastest.
  virtual void values(std::size_t leaf, float* out) const = 0;
};

/// A tile as the tree has it: not clipped, perhaps of the background value, perhaps inactive.
struct SourceTile {
  Tile box;
  bool active;
};

/// One grid as a file has it.
struct SourceGrid {
  glm::dmat4 index_to_world{1.0};
  float background = 0.0F;
  /// Every active tile, and every inactive one that differs from the background.
  std::vector<SourceTile> tiles;
  std::unique_ptr<LeafSource> leaves;
};

/// One grid of a listing, and whether it can be rendered.
struct GridEntry {
  GridInfo info;
  std::string unique_name;  ///< "name[n]" where a file repeats a name
  std::string refusal;      ///< why it is no scalar fog volume; empty: it is one
};

/// One open file. Methods throw whatever their library throws; the caller words it.
class Reader {
 public:
  Reader() = default;
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  virtual ~Reader() = default;

  [[nodiscard]] virtual const std::vector<GridEntry>& grids() const = 0;
  /// Reads the tree of the grid at this place of grids(). log_prefix begins every warning.
  virtual SourceGrid read(std::size_t grid, const Log& log, const std::string& log_prefix) = 0;
};

std::unique_ptr<Reader> open_vdb(const std::filesystem::path& file);
std::unique_ptr<Reader> open_nanovdb(const std::filesystem::path& file);

/// An error found by a reader itself; the caller puts the file's name in front.
[[noreturn]] inline void fail(const std::string& cause) { throw std::runtime_error(cause); }

/// Why a grid of this type and class is refused; empty if it is not.
std::string scalar_fog_refusal(std::string_view type, std::string_view grid_class, bool scalar);

}  // namespace cumulet::volume::detail
