#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>

#include "base/progress_part.hpp"
#include "volume/import_detail.hpp"
#include "volume/memory.hpp"

namespace cumulet::volume {

using namespace detail;

namespace {

[[noreturn]] void refuse(const std::string& name, const std::string& cause) {
  throw Error(ErrorCode::invalid_argument, one_line(name + ": " + cause));
}

void check_affine(const glm::dmat4& m) {
  if (m[0].w != 0.0 || m[1].w != 0.0 || m[2].w != 0.0 || m[3].w != 1.0) fail("its transform is not affine");
}

class DenseLeaves final : public HeldLeaves {
 public:
  DenseLeaves(const DenseVoxels& voxels, std::vector<glm::ivec3> origins)
      : voxels_(voxels), origins_(std::move(origins)) {}

  [[nodiscard]] std::size_t count() const override { return origins_.size(); }
  [[nodiscard]] glm::ivec3 origin(std::size_t leaf) const override { return origins_[leaf]; }
  [[nodiscard]] ActiveMask active(std::size_t leaf) const override {
    std::array<float, brick_voxels> brick;
    values(leaf, brick.data());
    return not_zero(brick);
  }
  void values(std::size_t leaf, float* out) const override {
    const glm::ivec3 origin = origins_[leaf];
    const glm::ivec3 size = glm::min(voxels_.size - origin, brick_size);
    if (size != glm::ivec3(brick_size)) std::fill_n(out, brick_voxels, 0.0F);
    for (int z = 0; z < size.z; ++z) {
      for (int y = 0; y < size.y; ++y) {
        const float* row = &voxels_.values[row_index(voxels_.size, origin + glm::ivec3(0, y, z))];
        for (int x = 0; x < size.x; ++x) out[(x * brick_size + y) * brick_size + z] = row[x];
      }
    }
  }

  static std::size_t row_index(const glm::ivec3& size, const glm::ivec3& p) {
    const glm::u64vec3 u(p);
    return (u.z * static_cast<std::uint64_t>(size.y) + u.y) * static_cast<std::uint64_t>(size.x) + u.x;
  }

 private:
  DenseVoxels voxels_;
  std::vector<glm::ivec3> origins_;
};

/// Returns the origins of the bricks that have a voxel other than zero.
std::vector<glm::ivec3> dense_bricks(const DenseVoxels& voxels, Progress* progress, double from, double to) {
  const glm::ivec3 bricks = (voxels.size - 1) / brick_size + 1;
  const auto rows = static_cast<std::size_t>(bricks.y) * static_cast<std::size_t>(bricks.z);
  const auto columns = static_cast<std::size_t>(bricks.x);
  std::vector<std::vector<glm::ivec3>> found(rows);
  ProgressPart part(progress, from, to, rows);
  tbb::parallel_for(std::size_t{0}, rows, [&](std::size_t row) {
    const glm::ivec3 low(0, brick_size * static_cast<int>(row % static_cast<std::size_t>(bricks.y)),
                         brick_size * static_cast<int>(row / static_cast<std::size_t>(bricks.y)));
    const glm::ivec3 high = glm::min(low + brick_size, voxels.size);
    std::vector<char> any(columns);
    for (int z = low.z; z < high.z; ++z) {
      for (int y = low.y; y < high.y; ++y) {
        part.check();
        const float* values = &voxels.values[DenseLeaves::row_index(voxels.size, {0, y, z})];
        for (std::size_t x = 0; x < static_cast<std::size_t>(voxels.size.x); ++x) {
          if (values[x] != 0.0F) any[x / brick_size] = 1;
        }
      }
    }
    for (std::size_t x = 0; x < columns; ++x) {
      if (any[x] != 0) found[row].emplace_back(brick_size * static_cast<int>(x), low.y, low.z);
    }
    part.add(1);
  });
  std::vector<glm::ivec3> origins;
  for (const auto& row : found) origins.insert(origins.end(), row.begin(), row.end());
  return origins;
}

glm::ivec3 origin_of(std::span<const std::int32_t> origins, std::size_t brick) {
  return {origins[3 * brick], origins[3 * brick + 1], origins[3 * brick + 2]};
}

class SparseLeaves final : public HeldLeaves {
 public:
  explicit SparseLeaves(const SparseVoxels& voxels)
      : origins_(voxels.brick_origins), values_(voxels.brick_values), active_(voxels.brick_active) {}

  [[nodiscard]] std::size_t count() const override { return origins_.size() / 3; }
  [[nodiscard]] glm::ivec3 origin(std::size_t leaf) const override { return origin_of(origins_, leaf); }
  [[nodiscard]] ActiveMask active(std::size_t leaf) const override {
    ActiveMask mask;
    mask.fill(~std::uint64_t{0});
    if (!active_.empty()) std::copy_n(&active_[leaf * mask.size()], mask.size(), mask.begin());
    return mask;
  }
  void values(std::size_t leaf, float* out) const override {
    std::copy_n(&values_[leaf * brick_voxels], brick_voxels, out);
  }

 private:
  std::span<const std::int32_t> origins_;
  std::span<const float> values_;
  std::span<const std::uint64_t> active_;
};

bool do_overlap(const Tile& a, const Tile& b) {
  return glm::all(glm::lessThanEqual(a.min, b.max)) && glm::all(glm::lessThanEqual(b.min, a.max));
}

/// Throws unless the tiles are disjoint and do not overlap bricks. Splits space between tiles until each side has only
/// a few.
class Disjointness {
 public:
  Disjointness(const SparseVoxels& voxels, const Progress* progress) : voxels_(&voxels), progress_(progress) {}

  void check() {
    std::vector<Part> parts(1);
    parts[0].tiles.resize(voxels_->tiles.size());
    std::iota(parts[0].tiles.begin(), parts[0].tiles.end(), std::uint32_t{0});
    if (!parts[0].tiles.empty()) {
      parts[0].bricks.resize(voxels_->brick_origins.size() / 3);
      std::iota(parts[0].bricks.begin(), parts[0].bricks.end(), std::uint32_t{0});
    }
    while (!parts.empty()) {
      cumulet::check(progress_);
      const Part part = std::move(parts.back());
      parts.pop_back();
      constexpr std::size_t few = 8;
      if (part.tiles.size() <= few) {
        compare(part);
        continue;
      }
      const Plane plane = between(part);
      Part low;
      Part high;
      for (const std::uint32_t t : part.tiles) {
        if (tile(t).min[plane.axis] <= plane.last) low.tiles.push_back(t);
        if (tile(t).max[plane.axis] > plane.last) high.tiles.push_back(t);
      }
      for (const std::uint32_t b : part.bricks) {
        if (brick(b).min[plane.axis] <= plane.last) low.bricks.push_back(b);
        if (brick(b).max[plane.axis] > plane.last) high.bricks.push_back(b);
      }
      parts.push_back(std::move(low));
      parts.push_back(std::move(high));
    }
  }

 private:
  struct Part {
    std::vector<std::uint32_t> tiles, bricks;
  };
  struct Plane {
    int axis;
    int last;  ///< the last voxel on the lower side
  };

  [[nodiscard]] const Tile& tile(std::uint32_t t) const { return voxels_->tiles[t].box; }
  [[nodiscard]] Tile brick(std::uint32_t b) const {
    const glm::ivec3 origin = origin_of(voxels_->brick_origins, b);
    return {origin, origin + (brick_size - 1), 0.0F};
  }

  void compare(const Part& part) const {
    for (std::size_t i = 0; i < part.tiles.size(); ++i) {
      const Tile& a = tile(part.tiles[i]);
      for (std::size_t j = 0; j < i; ++j) {
        if (do_overlap(a, tile(part.tiles[j]))) overlap(a, tile(part.tiles[j]));
      }
      for (const std::uint32_t b : part.bricks) {
        if (do_overlap(a, brick(b)))
          fail("its tile at " + to_string(a.min) + " overlaps the brick at " + to_string(brick(b).min));
      }
    }
  }

  [[noreturn]] static void overlap(const Tile& a, const Tile& b) {
    fail("its tiles at " + to_string(a.min) + " and " + to_string(b.min) + " overlap");
  }

  /// Returns the plane, at the median of the tiles' upper ends along an axis, that minimizes the tiles on its fuller
  /// side. If none of them reduces the number, returns a plane between two tiles.
  [[nodiscard]] Plane between(const Part& part) const {
    Plane best{0, 0};
    std::size_t fewest = part.tiles.size();
    std::vector<int> ends(part.tiles.size());
    for (int axis = 0; axis < 3; ++axis) {
      std::transform(part.tiles.begin(), part.tiles.end(), ends.begin(), [&](auto t) { return tile(t).max[axis]; });
      const auto middle = ends.begin() + static_cast<std::ptrdiff_t>(ends.size() / 2);
      std::nth_element(ends.begin(), middle, ends.end());
      std::size_t low = 0;
      std::size_t high = 0;
      for (const std::uint32_t t : part.tiles) {
        low += tile(t).min[axis] <= *middle ? 1 : 0;
        high += tile(t).max[axis] > *middle ? 1 : 0;
      }
      if (std::max(low, high) < fewest) {
        fewest = std::max(low, high);
        best = {axis, *middle};
      }
    }
    if (fewest < part.tiles.size()) return best;
    const Tile& a = tile(part.tiles[0]);
    const Tile& b = tile(part.tiles[1]);
    for (int axis = 0; axis < 3; ++axis) {
      if (a.max[axis] < b.min[axis]) return {axis, a.max[axis]};
      if (b.max[axis] < a.min[axis]) return {axis, b.max[axis]};
    }
    overlap(a, b);
  }

  const SparseVoxels* voxels_;
  const Progress* progress_;
};

ScalarVolume finish(SourceGrid source, const std::string& name, const Log& log, Progress* progress, double from) {
  ScalarVolume volume = assemble(std::move(source), log, one_line(name) + ": ", progress, {from, 1.0});
  volume.name = name;
  return volume;
}

constexpr double finding = 0.3;  // fraction of an import's time

void check_counts(const DenseVoxels& voxels, const std::string& name) {
  if (glm::any(glm::lessThanEqual(voxels.size, glm::ivec3(0)))) refuse(name, "its size is " + to_string(voxels.size));
  // Divided, because the product may overflow.
  const glm::u64vec3 size(voxels.size);
  const std::uint64_t count = voxels.values.size();
  if (count % size.x != 0 || count / size.x % size.y != 0 || count / size.x / size.y != size.z) {
    refuse(name, "has " + std::to_string(count) + " values for a size of " + to_string(voxels.size));
  }
}

void check_counts(const SparseVoxels& voxels, const std::string& name) {
  const std::size_t count = voxels.brick_origins.size() / 3;
  if (voxels.brick_origins.size() != 3 * count || voxels.brick_values.size() != count * brick_voxels ||
      (!voxels.brick_active.empty() && voxels.brick_active.size() != count * brick_size)) {
    refuse(name, "the numbers of brick origins, values and masks differ");
  }
}

void check_bricks(const SparseVoxels& voxels) {
  for (std::size_t i = 0; i < voxels.brick_origins.size() / 3; ++i) {
    const glm::ivec3 origin = origin_of(voxels.brick_origins, i);
    if (((origin.x | origin.y | origin.z) & (brick_size - 1)) != 0) {
      fail("its brick origin " + to_string(origin) + " is not a multiple of 8");
    }
  }
  for (const SourceTile& tile : voxels.tiles) {
    if (glm::any(glm::greaterThan(tile.box.min, tile.box.max))) {
      fail("its tile at " + to_string(tile.box.min) + " has its end before its beginning: " + to_string(tile.box.max));
    }
  }
}

void check_no_two_the_same(const SparseVoxels& voxels) {
  const std::size_t count = voxels.brick_origins.size() / 3;
  const auto order = [&](std::size_t a, std::size_t b) {
    return lexicographic(origin_of(voxels.brick_origins, a), origin_of(voxels.brick_origins, b));
  };
  std::vector<std::size_t> bricks(count);
  std::iota(bricks.begin(), bricks.end(), std::size_t{0});
  if (!std::ranges::is_sorted(bricks, order)) tbb::parallel_sort(bricks.begin(), bricks.end(), order);
  const auto same = std::ranges::adjacent_find(bricks, [&](std::size_t a, std::size_t b) { return !order(a, b); });
  if (same != bricks.end()) fail("has two bricks at " + to_string(origin_of(voxels.brick_origins, *same)));
}

SourceGrid source_of_dense(const DenseVoxels& voxels, Progress* progress, double from, double to) {
  SourceGrid source;
  source.index_to_world = voxels.index_to_world;
  source.leaves = std::make_unique<DenseLeaves>(voxels, dense_bricks(voxels, progress, from, to));
  return source;
}

SourceGrid source_of_sparse(SparseVoxels voxels, Progress* progress) {
  check_bricks(voxels);
  Disjointness(voxels, progress).check();
  SourceGrid source;
  source.index_to_world = voxels.index_to_world;
  source.background = voxels.background;
  source.leaves = std::make_unique<SparseLeaves>(voxels);
  source.tiles = std::move(voxels.tiles);
  return source;
}

std::string name_of_field(const std::string& name, Channel channel) { return name + ": " + name_of(channel); }

/// Returns the index of the first value that is not finite.
std::optional<std::size_t> first_not_finite(std::span<const float> values) {
  constexpr std::size_t piece = 1U << 16U;
  std::atomic<std::size_t> first = values.size();
  tbb::parallel_for(std::size_t{0}, (values.size() + piece - 1) / piece, [&](std::size_t p) {
    const std::span<const float> part = values.subspan(p * piece, std::min(piece, values.size() - p * piece));
    if (all_finite(part)) return;
    const auto bad = std::ranges::find_if(part, [](float value) { return !std::isfinite(value); });
    std::size_t at = p * piece + static_cast<std::size_t>(bad - part.begin());
    std::size_t known = first.load();
    while (at < known && !first.compare_exchange_weak(known, at)) {
    }
  });
  return first < values.size() ? std::optional(first.load()) : std::nullopt;
}

void refuse_twice(std::span<const MemoryField> fields, const std::string& name) {
  for (const MemoryField& field : fields) {
    if (std::ranges::count(fields, field.channel, &MemoryField::channel) > 1)
      refuse(name, std::string("has ") + name_of(field.channel) + " twice");
  }
}

void check_voxels(std::span<const MemoryField> fields, const std::string& name) {
  for (const MemoryField& field : fields) {
    const std::string of = name_of_field(name, field.channel);
    std::visit([&](const auto& voxels) { check_counts(voxels, of); }, field.voxels);
    naming(of, [&] {
      std::visit(
          [&](const auto& voxels) {
            check_affine(voxels.index_to_world);
            check_transform(voxels.index_to_world);
          },
          field.voxels);
      if (const auto* sparse = std::get_if<SparseVoxels>(&field.voxels)) {
        check_bricks(*sparse);
        check_no_two_the_same(*sparse);
        Disjointness(*sparse, nullptr).check();
      }
    });
  }
}

}  // namespace

bool detail::all_finite(std::span<const float> values) {
  // Integer arithmetic without a branch vectorizes.
  constexpr std::uint32_t exponent = 0x7f800000U;
  std::uint32_t bad = 0;
  for (const float value : values) bad |= (std::bit_cast<std::uint32_t>(value) & exponent) == exponent ? 1U : 0U;
  return bad == 0;
}

const char* name_of(Channel channel) {
  constexpr std::array<const char*, channel_count> names = {"density",    "temperature", "flame",      "red",
                                                            "green",      "blue",        "anisotropy", "velocity_x",
                                                            "velocity_y", "velocity_z"};
  return names.at(static_cast<std::size_t>(channel));
}

void check_fields(std::span<const MemoryField> fields, const std::string& name) {
  refuse_twice(fields, name);
  std::array<int, channel_count> count{};
  for (const MemoryField& field : fields) ++count.at(static_cast<std::size_t>(field.channel));
  const auto there = [&](Channel channel) { return count.at(static_cast<std::size_t>(channel)); };
  const int colors = there(Channel::red) + there(Channel::green) + there(Channel::blue);
  const int velocities = there(Channel::velocity_x) + there(Channel::velocity_y) + there(Channel::velocity_z);
  if (colors % 3 != 0) refuse(name, "has only some of red, green and blue");
  if (velocities % 3 != 0) refuse(name, "has only some of velocity_x, velocity_y and velocity_z");
  if (there(Channel::density) + there(Channel::temperature) + there(Channel::flame) == 0)
    refuse(name, "has no density, temperature or flame");
  check_voxels(fields, name);
}

void check_update(std::span<const MemoryField> fields, const std::string& name) {
  refuse_twice(fields, name);
  check_voxels(fields, name);
}

void require_finite(const MemoryField& field, const std::string& name) {
  const auto refuse_at = [&](const glm::ivec3& voxel) {
    throw Error(ErrorCode::file,
                one_line(name_of_field(name, field.channel) + ": its voxel " + to_string(voxel) + " is not finite"));
  };
  if (const auto* dense = std::get_if<DenseVoxels>(&field.voxels)) {
    const auto bad = first_not_finite(dense->values);
    if (!bad) return;
    const glm::u64vec3 size(dense->size);
    refuse_at(glm::ivec3(glm::u64vec3(*bad % size.x, *bad / size.x % size.y, *bad / size.x / size.y)));
  }
  const auto& sparse = std::get<SparseVoxels>(field.voxels);
  if (const auto bad = first_not_finite(sparse.brick_values)) {
    const std::size_t brick = *bad / brick_voxels;
    const auto v = static_cast<int>(*bad % brick_voxels);
    refuse_at(origin_of(sparse.brick_origins, brick) + glm::ivec3(v / 64, v / 8 % 8, v % 8));
  }
  for (const SourceTile& tile : sparse.tiles) {
    if (!std::isfinite(tile.box.value)) refuse_at(tile.box.min);
  }
  if (!std::isfinite(sparse.background))
    throw Error(ErrorCode::file, one_line(name_of_field(name, field.channel) + ": its background is not finite"));
}

SourceGrid detail::source_of(const MemoryField& field, Progress* progress, Portion portion) {
  if (const auto* dense = std::get_if<DenseVoxels>(&field.voxels))
    return source_of_dense(*dense, progress, portion.from, portion.to);
  return source_of_sparse(std::get<SparseVoxels>(field.voxels), progress);
}

ScalarVolume import_dense(const DenseVoxels& voxels, const std::string& name, const Log& log, Progress* progress) {
  check_counts(voxels, name);
  return naming(name, [&] {
    check_affine(voxels.index_to_world);
    return finish(source_of_dense(voxels, progress, 0.0, finding), name, log, progress, finding);
  });
}

ScalarVolume import_sparse(SparseVoxels voxels, const std::string& name, const Log& log, Progress* progress) {
  check_counts(voxels, name);
  return naming(name, [&] {
    check_affine(voxels.index_to_world);
    return finish(source_of_sparse(std::move(voxels), progress), name, log, progress, 0.0);
  });
}

}  // namespace cumulet::volume
