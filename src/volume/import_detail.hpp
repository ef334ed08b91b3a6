#pragma once

// Private to volume/: the interface between file and memory readers and the shared part of the importer, and that part.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <ios>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/byte_source.hpp"
#include "base/error.hpp"
#include "base/log.hpp"
#include "base/one_line.hpp"
#include "base/progress_part.hpp"
#include "volume/bricks.hpp"

namespace cumulet::volume {
struct MemoryField;
}

namespace cumulet::volume::detail {

/// Word x holds the 64 voxels of slab x; bit y * 8 + z (the layout of leaf masks in OpenVDB and NanoVDB).
using ActiveMask = std::array<std::uint64_t, brick_size>;
/// Returns the mask of a brick's voxels that are not zero.
ActiveMask not_zero(std::span<const float, brick_voxels> values);

// Larger than any asset, and small enough that every voxel count and index difference fits its integer type.
inline constexpr int max_extent = 1 << 20;
inline constexpr int max_coordinate = 1 << 30;

/// Whether a grid's values are scalars (including halves), not vectors.
template <typename Value>
inline constexpr bool is_number = std::is_convertible_v<Value, float>;

/// Converts a grid's values: scalars unchanged, vectors to their lengths.
struct Lengths {
  template <typename Value>
  float operator()(const Value& value) const {
    if constexpr (is_number<Value>) {
      return static_cast<float>(value);
    } else {
      const double x = value[0];
      const double y = value[1];
      const double z = value[2];
      return static_cast<float>(std::sqrt(x * x + y * y + z * z));
    }
  }
};

/// Extracts a component of vectors.
struct Component {
  int axis;

  template <typename Value>
  float operator()(const Value& value) const {
    return static_cast<float>(value[axis]);
  }
};

/// A range of a load's progress fraction.
struct Portion {
  double from = 0.0;
  double to = 1.0;

  [[nodiscard]] double at(double part) const { return from + part * (to - from); }
  [[nodiscard]] Portion part(double a, double b) const { return {at(a), at(b)}; }
};

/// The leaves of one grid: origins and active masks are in memory, but values may still be in a file.
class LeafSource {
 public:
  /// Receives all 512 values of a leaf, active or not, z fastest; it may modify them. Returns false to stop the sweep.
  using Visit = std::function<bool(std::size_t leaf, std::span<float, brick_voxels> values)>;
  /// Selects leaves; empty: all.
  using Choice = std::function<bool(std::size_t leaf)>;

  LeafSource() = default;
  LeafSource(const LeafSource&) = delete;
  LeafSource& operator=(const LeafSource&) = delete;
  virtual ~LeafSource() = default;

  // The following three are safe to call from several threads.
  [[nodiscard]] virtual std::size_t count() const = 0;
  [[nodiscard]] virtual glm::ivec3 origin(std::size_t leaf) const = 0;
  [[nodiscard]] virtual ActiveMask active(std::size_t leaf) const = 0;
  /// Visits every leaf once, in any order and on several threads. Only one sweep may run at a time. Returns false if a
  /// visit stopped it.
  bool sweep(const Visit& visit, Progress* progress, Portion portion) const {
    return sweep_chosen({}, visit, progress, portion);
  }
  /// Like sweep(), but skips leaves that are not chosen. `chosen` may be called on any thread.
  virtual bool sweep_chosen(const Choice& chosen, const Visit& visit, Progress* progress, Portion portion) const = 0;
};

/// Leaves whose values are all in memory, possibly inside their library's tree.
class HeldLeaves : public LeafSource {
 public:
  /// Safe to call from several threads.
  virtual void values(std::size_t leaf, float* out) const = 0;
  bool sweep_chosen(const Choice& chosen, const Visit& visit, Progress* progress, Portion portion) const override;
};

/// One grid as provided by a file or a host.
struct SourceGrid {
  glm::dmat4 index_to_world{1.0};
  float background = 0.0F;
  /// All active tiles, and all inactive ones that differ from the background.
  std::vector<SourceTile> tiles;
  std::unique_ptr<LeafSource> leaves;
};

/// An open file. Methods throw the exceptions of their library; the caller converts them to Error.
class Reader {
 public:
  Reader() = default;
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  virtual ~Reader() = default;

  [[nodiscard]] virtual const std::vector<GridInfo>& grids() const = 0;
  /// Metadata of the whole file.
  [[nodiscard]] virtual const std::vector<Metadata>& metadata() const = 0;
  /// "OpenVDB 224", "NanoVDB 32.3".
  [[nodiscard]] virtual const std::string& format() const = 0;
  /// Warnings about the whole file, such as an unknown newer version.
  [[nodiscard]] virtual std::vector<std::string> remarks() const { return {}; }
  /// Fraction of the load's progress that opening took.
  [[nodiscard]] virtual double opened() const { return 0.0; }
  /// Fraction of a grid's import that read() takes.
  [[nodiscard]] virtual double reading() const = 0;
  /// Whether the values of grids from read() stay in the file until they are swept, so that a sweep can skip some of
  /// them.
  [[nodiscard]] virtual bool streams() const { return false; }
  /// Reads the tree of grids()[grid], whose `values` must not be `none`. Leaf values may be read from the file during a
  /// sweep, so the reader must outlive it. log_prefix: prefix of every warning.
  virtual SourceGrid read(std::size_t grid, Portion portion, const Log& log, const std::string& log_prefix) = 0;
  /// Reads the components of a vector grid (Values::lengths).
  virtual std::array<SourceGrid, 3> read_vector(std::size_t grid, Portion portion, const Log& log,
                                                const std::string& log_prefix) = 0;
};

/// Opens a file; its format is recognized by content, not by name.
std::unique_ptr<Reader> open(const std::filesystem::path& file, Progress* progress);
std::unique_ptr<Reader> open(std::unique_ptr<ByteSource> content, Progress* progress);
/// Returns the size of a file, or of a folder's slices. Throws std::filesystem::filesystem_error.
std::uint64_t bytes_of(const std::filesystem::path& file);
/// Returns the grid that import_volume reads for this name, or without a name. Throws as import_volume does.
std::size_t choose_grid(const std::vector<GridInfo>& grids, const std::string& name);
/// Returns the usable grid with this name, or else this unique name. Throws if there is none, or several.
std::size_t choose_named(const std::vector<GridInfo>& grids, const std::string& name,
                         const std::function<std::string(const GridInfo&)>& refusal);
/// Returns all grids with this name, or else this unique name.
std::vector<std::size_t> named(const std::vector<GridInfo>& grids, const std::string& name);
/// Returns suitable grids of this name, in the file's order: first those with exactly this name, then those that differ
/// only in case.
std::vector<std::size_t> called_so(const std::vector<GridInfo>& grids, std::string_view name,
                                   const std::function<bool(const GridInfo&)>& suits);
/// Returns the scalar fog grid that matches the earliest of these names; if several match, the first from called_so().
/// taken: grids to exclude.
std::optional<std::size_t> first_fog(const std::vector<GridInfo>& grids, std::span<const std::string_view> names,
                                     std::span<const std::size_t> taken = {});
/// Returns the grid that is used if there is no density: a flame or a temperature by name, else the first of the file
/// that is not a velocity.
std::optional<std::size_t> any_fog(const std::vector<GridInfo>& grids, std::span<const std::size_t> taken = {});
inline constexpr std::array<std::string_view, 3> density_names = {"density", "smoke", "soot"};
/// Returns grids that hold velocities: vector grids named velocity, vel or v in any case; staggered grids; and triples
/// of scalar grids with these names followed by x, y and z, or by "_" or "." and these letters.
std::vector<std::size_t> velocities(const std::vector<GridInfo>& grids);
inline constexpr std::array<std::string_view, 3> velocity_names = {"velocity", "vel", "v"};
/// Returns three scalar grids with this name followed by x, y and z, or by "_" or "." and these letters; empty if one
/// is missing.
std::vector<std::size_t> along_axes(const std::vector<GridInfo>& grids, std::string_view name);
/// Returns the warning about a grid that was chosen without a name; empty if no warning is needed. shown: all grids in
/// use, for any field.
std::string remark_on_choice(const std::vector<GridInfo>& grids, std::size_t chosen,
                             std::span<const std::size_t> shown);
/// Returns warnings for grids that were chosen by default names, if other grids have the same name except for case.
/// shown: all grids that are read, for any field.
std::vector<std::string> remarks_on_case(const std::vector<GridInfo>& grids, const std::string& field,
                                         std::span<const std::size_t> chosen, std::span<const std::size_t> shown);
/// Throws; the message is `what`, followed by a list of all grids.
[[noreturn]] void fail_without(const std::vector<GridInfo>& grids, const std::string& what);
std::string describe(const std::vector<GridInfo>& grids, std::span<const std::size_t> which);
std::string lower_case(std::string text);

std::unique_ptr<Reader> open_vdb(std::unique_ptr<ByteSource> content, Progress* progress);
std::unique_ptr<Reader> open_nanovdb(std::unique_ptr<ByteSource> content, Progress* progress);

/// The shared part of the importer: converts a source's tree to a valid ScalarVolume.
ScalarVolume assemble(SourceGrid source, const Log& log, const std::string& log_prefix, Progress* progress,
                      Portion portion);
/// Reads and assembles one scalar grid of an open file.
ScalarVolume import_grid(Reader& reader, std::size_t grid, const std::string& file, const Log& log, Progress* progress,
                         Portion portion);
/// Reads and assembles the components of a vector grid.
std::array<ScalarVolume, 3> import_vector_grid(Reader& reader, std::size_t grid, const std::string& file,
                                               const Log& log, Progress* progress, Portion portion);

/// Whether all values are finite. O(values).
bool all_finite(std::span<const float> values);
/// Returns the tree of a host's voxels, without copying them. Throws std::runtime_error for misplaced bricks and tiles.
SourceGrid source_of(const MemoryField& field, Progress* progress, Portion portion);
/// Throws unless the transform is finite and invertible.
void check_transform(const glm::dmat4& m);
/// Splits a source into its positive and its negative part.
std::array<ScalarVolume, 2> assemble_signed(SourceGrid whole, const std::string& name, const Log& log,
                                            const std::string& log_prefix, Progress* progress, Portion portion);

/// Reads one scalar grid, split into its positive and its negative part.
std::array<ScalarVolume, 2> import_signed_grid(Reader& reader, std::size_t grid, const std::string& file,
                                               const Log& log, Progress* progress, Portion portion);
/// Reads the components of a vector grid, each split into its positive and its negative part.
std::array<std::array<ScalarVolume, 2>, 3> import_signed_vector_grid(Reader& reader, std::size_t grid,
                                                                     const std::string& file, const Log& log,
                                                                     Progress* progress, Portion portion);

std::string to_string(glm::ivec3 v);

/// A box of voxels, both ends inclusive.
struct Box {
  glm::ivec3 min{std::numeric_limits<int>::max()};
  glm::ivec3 max{std::numeric_limits<int>::min()};

  [[nodiscard]] bool empty() const { return glm::any(glm::greaterThan(min, max)); }
  void expand(const Box& b) {
    min = glm::min(min, b.min);
    max = glm::max(max, b.max);
  }
  [[nodiscard]] Box clipped(const Box& b) const { return {glm::max(min, b.min), glm::min(max, b.max)}; }
  [[nodiscard]] bool contains(const Box& b) const {
    return glm::all(glm::lessThanEqual(min, b.min)) && glm::all(glm::greaterThanEqual(max, b.max));
  }
  [[nodiscard]] std::uint64_t voxels() const { return static_cast<std::uint64_t>(voxels_between(min, max)); }
};

struct ActiveRegion {
  Box box;
  std::uint64_t voxels = 0;
};

/// Returns the active region of the leaves, without tiles.
ActiveRegion active_leaf_region(const LeafSource& leaves, ProgressPart& part);

/// Throws an error that a reader detected; the caller adds the file's name.
[[noreturn]] inline void fail(const std::string& cause) { throw std::runtime_error(cause); }
inline constexpr const char* end_of_file = "the file is truncated or damaged: unexpected end of file";

/// Runs f. Exceptions are converted to an Error whose one-line message begins with the name of the file or of the
/// host's voxels. An Error is passed on unchanged.
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

/// Returns why a grid of this type and class is not usable; empty if it is usable.
std::string scalar_fog_refusal(std::string_view type, std::string_view grid_class, bool scalar);

}  // namespace cumulet::volume::detail
