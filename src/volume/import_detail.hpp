#pragma once

// Private to volume/: what file readers and memory hand to the shared half of the importer, and that half.

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

#include "base/error.hpp"
#include "base/log.hpp"
#include "base/one_line.hpp"
#include "base/progress_part.hpp"
#include "volume/bricks.hpp"
#include "volume/memory.hpp"

namespace cumulet::volume::detail {

/// Word x holds the 64 voxels of the slab x; bit y * 8 + z (both libraries' leaf masks).
using ActiveMask = std::array<std::uint64_t, brick_size>;
/// Those of a brick's voxels that are not zero.
ActiveMask not_zero(std::span<const float, brick_voxels> values);

// Longer than any asset, short enough that every voxel count and index difference fits its integer.
inline constexpr int max_extent = 1 << 20;
inline constexpr int max_coordinate = 1 << 30;

/// Whether a grid's values are numbers, halves too, and not vectors.
template <typename Value>
inline constexpr bool is_number = std::is_convertible_v<Value, float>;

/// What is taken of a grid's values: numbers as they are, and of vectors the lengths.
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

/// Of vectors.
struct Component {
  int axis;

  template <typename Value>
  float operator()(const Value& value) const {
    return static_cast<float>(value[axis]);
  }
};

/// A span of a load's fraction.
struct Portion {
  double from = 0.0;
  double to = 1.0;

  [[nodiscard]] double at(double part) const { return from + part * (to - from); }
  [[nodiscard]] Portion part(double a, double b) const { return {at(a), at(b)}; }
};

/// The leaves of one grid: where they are and what is active of them in memory, their values perhaps still in a file.
class LeafSource {
 public:
  /// Of a leaf, all 512 values, active or not, z fastest; it may change them. False: no more are wanted.
  using Visit = std::function<bool(std::size_t leaf, std::span<float, brick_voxels> values)>;
  /// Which of them are looked at; empty: all.
  using Choice = std::function<bool(std::size_t leaf)>;

  LeafSource() = default;
  LeafSource(const LeafSource&) = delete;
  LeafSource& operator=(const LeafSource&) = delete;
  virtual ~LeafSource() = default;

  // Safe to call from many threads.
  [[nodiscard]] virtual std::size_t count() const = 0;
  [[nodiscard]] virtual glm::ivec3 origin(std::size_t leaf) const = 0;
  [[nodiscard]] virtual ActiveMask active(std::size_t leaf) const = 0;
  /// Visits every leaf once, in any order and on many threads at a time; one sweep at a time. Returns whether all were
  /// wanted.
  bool sweep(const Visit& visit, Progress* progress, Portion portion) const {
    return sweep_chosen({}, visit, progress, portion);
  }
  /// The same of those that are chosen, as any thread may ask; the others are passed over.
  virtual bool sweep_chosen(const Choice& chosen, const Visit& visit, Progress* progress, Portion portion) const = 0;
};

/// Those whose values are all in memory, if only their library's own.
class HeldLeaves : public LeafSource {
 public:
  /// Safe to call from many threads.
  virtual void values(std::size_t leaf, float* out) const = 0;
  bool sweep_chosen(const Choice& chosen, const Visit& visit, Progress* progress, Portion portion) const override;
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
  /// Of the file as a whole.
  [[nodiscard]] virtual const std::vector<Metadata>& metadata() const = 0;
  /// "OpenVDB 224", "NanoVDB 32.3".
  [[nodiscard]] virtual const std::string& format() const = 0;
  /// What a warning says of the file as a whole, such as a version that is newer than the known ones.
  [[nodiscard]] virtual std::vector<std::string> remarks() const { return {}; }
  /// What opening took of the load's fraction.
  [[nodiscard]] virtual double opened() const { return 0.0; }
  /// What read() takes of a grid's import.
  [[nodiscard]] virtual double reading() const = 0;
  /// Whether the values of what read() gives stay in the file until they are swept, which can pass over some of them.
  [[nodiscard]] virtual bool streams() const { return false; }
  /// Reads the tree of the grid at this place of grids(), whose values are not none; they may be read from the file as
  /// they are swept, which the reader has to outlive. log_prefix begins every warning.
  virtual SourceGrid read(std::size_t grid, Portion portion, const Log& log, const std::string& log_prefix) = 0;
  /// The components of one whose values are lengths.
  virtual std::array<SourceGrid, 3> read_vector(std::size_t grid, Portion portion, const Log& log,
                                                const std::string& log_prefix) = 0;
};

/// By content, not by name.
std::unique_ptr<Reader> open(const std::filesystem::path& file, Progress* progress);
/// Where import_volume looks for this name, or without one. Throws as import_volume does.
std::size_t choose_grid(const std::vector<GridInfo>& grids, const std::string& name);
/// The one of this name, or else unique name, that is not refused. Throws where there is none or are several.
std::size_t choose_named(const std::vector<GridInfo>& grids, const std::string& name,
                         const std::function<std::string(const GridInfo&)>& refusal);
/// All of this name, or else unique name.
std::vector<std::size_t> named(const std::vector<GridInfo>& grids, const std::string& name);
/// Grids of this name that suit, in the file's order: first those whose name is the same, then those whose name differs
/// in case.
std::vector<std::size_t> called_so(const std::vector<GridInfo>& grids, std::string_view name,
                                   const std::function<bool(const GridInfo&)>& suits);
/// The scalar fog grid whose name comes first among these; of several the first that called_so() finds. taken: grids
/// that it is not.
std::optional<std::size_t> first_fog(const std::vector<GridInfo>& grids, std::span<const std::string_view> names,
                                     std::span<const std::size_t> taken = {});
/// What is shown for want of a density: a flame or a temperature by its name, else the file's first that holds no
/// velocities.
std::optional<std::size_t> any_fog(const std::vector<GridInfo>& grids, std::span<const std::size_t> taken = {});
inline constexpr std::array<std::string_view, 3> density_names = {"density", "smoke", "soot"};
/// Grids that hold velocities: of vectors and called velocity, vel or v, in whatever case; staggered ones; and three of
/// numbers that have these names with x, y and z behind them, or behind "_" or ".".
std::vector<std::size_t> velocities(const std::vector<GridInfo>& grids);
inline constexpr std::array<std::string_view, 3> velocity_names = {"velocity", "vel", "v"};
/// Three grids of numbers with this name and x, y and z behind it, or behind "_" or "."; none where one is missing.
std::vector<std::size_t> along_axes(const std::vector<GridInfo>& grids, std::string_view name);
/// What a message says of a grid that is shown though nobody named it; empty where it needs no word. shown: all that
/// are, of whatever field.
std::string remark_on_choice(const std::vector<GridInfo>& grids, std::size_t chosen,
                             std::span<const std::size_t> shown);
/// What warnings say of grids that were found for a field by their names, where others differ in case or not at all.
/// shown: all grids that are read, of any field.
std::vector<std::string> remarks_on_case(const std::vector<GridInfo>& grids, const std::string& field,
                                         std::span<const std::size_t> chosen, std::span<const std::size_t> shown);
/// what, followed by all grids.
[[noreturn]] void fail_without(const std::vector<GridInfo>& grids, const std::string& what);
std::string describe(const std::vector<GridInfo>& grids, std::span<const std::size_t> which);
std::string lower_case(std::string text);

std::unique_ptr<Reader> open_vdb(const std::filesystem::path& file, Progress* progress);
std::unique_ptr<Reader> open_nanovdb(const std::filesystem::path& file, Progress* progress);

/// The shared half: from the tree as its source has it to the volume's contract.
ScalarVolume assemble(SourceGrid source, const Log& log, const std::string& log_prefix, Progress* progress,
                      Portion portion);
/// One scalar grid of an open file, read and assembled.
ScalarVolume import_grid(Reader& reader, std::size_t grid, const std::string& file, const Log& log, Progress* progress,
                         Portion portion);
/// The components of a grid of vectors.
std::array<ScalarVolume, 3> import_vector_grid(Reader& reader, std::size_t grid, const std::string& file,
                                               const Log& log, Progress* progress, Portion portion);

/// Whether all are numbers. O(values).
bool all_finite(std::span<const float> values);
/// The tree of a host's voxels, which it reads from. Throws runtime_error for bricks and tiles out of place.
SourceGrid source_of(const MemoryField& field, Progress* progress, Portion portion);
/// Throws for one that is not affine, finite and invertible.
void check_transform(const glm::dmat4& m);
/// A source in two: by how much its values are above 0, and by how much below.
std::array<ScalarVolume, 2> assemble_signed(SourceGrid whole, const std::string& name, const Log& log,
                                            const std::string& log_prefix, Progress* progress, Portion portion);

/// One scalar grid in two: by how much its values are above 0, and by how much below.
std::array<ScalarVolume, 2> import_signed_grid(Reader& reader, std::size_t grid, const std::string& file,
                                               const Log& log, Progress* progress, Portion portion);
/// The components of a grid of vectors, each likewise.
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

/// Of the leaves alone.
ActiveRegion active_leaf_region(const LeafSource& leaves, ProgressPart& part);

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
