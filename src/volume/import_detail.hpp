#pragma once

// Private to volume/: what file readers and memory hand to the shared half of the importer, and that half.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <ios>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "base/log.hpp"
#include "base/one_line.hpp"
#include "base/progress.hpp"
#include "volume/memory.hpp"

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

/// One grid as a file or a host has it.
struct SourceGrid {
  glm::dmat4 index_to_world{1.0};
  float background = 0.0F;
  /// Every active tile, and every inactive one that differs from the background.
  std::vector<SourceTile> tiles;
  std::unique_ptr<LeafSource> leaves;
};

/// One open file. Methods throw whatever their library throws; the caller words it.
class Reader {
 public:
  Reader() = default;
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  virtual ~Reader() = default;

  [[nodiscard]] virtual const std::vector<GridInfo>& grids() const = 0;
  /// Reads the tree of the grid at this place of grids(). log_prefix begins every warning.
  virtual SourceGrid read(std::size_t grid, const Log& log, const std::string& log_prefix) = 0;
};

/// Reading is this part of loading; the shared half does the rest.
inline constexpr double read_part = 0.7;

std::unique_ptr<Reader> open_vdb(const std::filesystem::path& file, Progress* progress);
std::unique_ptr<Reader> open_nanovdb(const std::filesystem::path& file, Progress* progress);

/// The shared half: from the tree as its source has it to the volume's contract. from: where the fraction stands.
ScalarVolume assemble(SourceGrid source, const Log& log, const std::string& log_prefix, Progress* progress,
                      double from);

std::string to_string(glm::ivec3 v);

/// An error found by a reader itself; the caller puts the file's name in front.
[[noreturn]] inline void fail(const std::string& cause) { throw std::runtime_error(cause); }
inline constexpr const char* end_of_file = "the file is truncated or damaged: unexpected end of file";

/// Runs f; whatever it throws leaves as one line that begins with the name of a file or of a host's voxels, but for an
/// Error, which is worded already.
template <typename Function>
auto naming(const std::string& name, Function&& f) {
  try {
    return f();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::out_of_memory, one_line(name + ": not enough memory to read it"));
  } catch (const std::ios_base::failure&) {
    throw Error(ErrorCode::file, one_line(name + ": " + end_of_file));
  } catch (const std::exception& e) {
    throw Error(ErrorCode::file, one_line(name + ": " + e.what()));
  } catch (...) {
    throw Error(ErrorCode::file, one_line(name + ": unknown error while reading"));
  }
}

/// Why a grid of this type and class is refused; empty if it is not.
std::string scalar_fog_refusal(std::string_view type, std::string_view grid_class, bool scalar);

}  // namespace cumulet::volume::detail
