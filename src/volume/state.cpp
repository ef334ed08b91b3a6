#include "volume/state.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <utility>

#include "volume/import_detail.hpp"

namespace cumulet::volume {

using namespace detail;

namespace {

// Copies in pieces that are checked while still in the cache. Returns whether all values are finite.
bool copy_finite(std::span<const float> from, std::span<float> to) {
  constexpr std::size_t piece = 1U << 14U;
  std::atomic<bool> finite = true;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, (from.size() + piece - 1) / piece, 16), [&](const auto& range) {
    for (std::size_t p = range.begin(); p != range.end(); ++p) {
      const std::span<const float> part = from.subspan(p * piece, std::min(piece, from.size() - p * piece));
      std::memcpy(&to[p * piece], part.data(), part.size_bytes());
      if (!all_finite(part)) finite = false;
    }
  });
  return finite;
}

// Reserves space for `more` elements, at least doubling the size when it grows.
template <class Vector>
void make_room(Vector& vector, std::size_t more) {
  if (vector.capacity() - vector.size() < more) vector.reserve(std::max(vector.size() + more, 2 * vector.size()));
}

}  // namespace

// ---- bricks ----

BrickCopy::BrickCopy(const SparseVoxels& voxels, bool zeros)
    : origins_(voxels.brick_origins.begin(), voxels.brick_origins.end()),
      values_(voxels.brick_values.begin(), voxels.brick_values.end()),
      active_(voxels.brick_active.begin(), voxels.brick_active.end()),
      tiles_(voxels.tiles),
      background_(voxels.background),
      index_to_world_(voxels.index_to_world) {
  if (!active_.empty() || origins_.empty()) return;
  active_.assign(count() * brick_size, ~std::uint64_t{0});
  for (std::size_t brick = 0; zeros && brick < count(); ++brick) {
    const ActiveMask mask =
        not_zero(std::span<const float, brick_voxels>(&values_[brick * brick_voxels], brick_voxels));
    std::ranges::copy(mask, &active_[brick * brick_size]);
  }
}

BrickCopy::BrickCopy(const DenseCopy& dense) : index_to_world_(dense.index_to_world) {
  const SourceGrid source = source_of({Channel::density, DenseVoxels{dense.values.all(), dense.size}}, nullptr, {});
  const LeafSource& leaves = *source.leaves;
  const std::size_t count = leaves.count();
  origins_.resize(3 * count);
  values_.resize(count * brick_voxels);
  active_.resize(count * brick_size);
  const auto take = [&](std::size_t brick, std::span<float, brick_voxels> values) {
    for (int axis = 0; axis < 3; ++axis)
      origins_[3 * brick + static_cast<std::size_t>(axis)] = leaves.origin(brick)[axis];
    std::ranges::copy(values, &values_[brick * brick_voxels]);
    std::ranges::copy(not_zero(values), &active_[brick * brick_size]);
    return true;
  };
  leaves.sweep(take, nullptr, {});
}

void BrickCopy::reserve(std::size_t count) {
  origins_.reserve(3 * count);
  values_.reserve(brick_voxels * count);
  active_.reserve(brick_size * count);
}

bool BrickCopy::add(const glm::ivec3& origin, std::span<const float, brick_voxels> values) {
  for (int axis = 0; axis < 3; ++axis) origins_.push_back(origin[axis]);
  values_.insert(values_.end(), values.begin(), values.end());
  const ActiveMask mask = not_zero(values);
  active_.insert(active_.end(), mask.begin(), mask.end());
  return all_finite(values);
}

SparseVoxels BrickCopy::view() const { return {origins_, values_, active_, tiles_, background_, index_to_world_}; }

std::size_t BrickCopy::Hash::operator()(const glm::ivec3& origin) const {
  std::uint64_t hash = 0;
  for (int axis = 0; axis < 3; ++axis) {
    hash = (hash ^ static_cast<std::uint32_t>(origin[axis])) * 0x9e3779b97f4a7c15ULL;
    hash ^= hash >> 32U;
  }
  return hash;
}

void BrickCopy::index() {
  if (!indices_.empty()) return;
  indices_.reserve(count());
  for (std::size_t brick = 0; brick < count(); ++brick)
    indices_.emplace(glm::ivec3(origins_[3 * brick], origins_[3 * brick + 1], origins_[3 * brick + 2]), brick);
}

void BrickCopy::set(std::size_t brick, const BrickCopy& of, std::size_t from) {
  std::copy_n(&of.values_[from * brick_voxels], brick_voxels, &values_[brick * brick_voxels]);
  std::copy_n(&of.active_[from * brick_size], brick_size, &active_[brick * brick_size]);
}

void BrickCopy::put(const BrickCopy& other) {
  index();
  for (std::size_t from = 0; from < other.count(); ++from) {
    const glm::ivec3 origin(other.origins_[3 * from], other.origins_[3 * from + 1], other.origins_[3 * from + 2]);
    auto found = indices_.find(origin);
    if (found == indices_.end()) {
      // Everything that may throw comes before the first change.
      make_room(origins_, 3);
      make_room(values_, brick_voxels);
      make_room(active_, brick_size);
      found = indices_.emplace(origin, count()).first;
      for (int axis = 0; axis < 3; ++axis) origins_.push_back(origin[axis]);
      values_.resize(values_.size() + brick_voxels);
      active_.resize(active_.size() + brick_size);
    }
    set(found->second, other, from);
  }
}

// ---- fields ----

FieldCopy FieldCopy::of(const MemoryField& field, const std::string& name) {
  if (const auto* dense = std::get_if<DenseVoxels>(&field.voxels)) {
    DenseCopy copy{Floats(dense->values.size()), dense->size, dense->index_to_world};
    if (!copy_finite(dense->values, copy.values.all())) require_finite(field, name);
    return {field.channel, std::move(copy)};
  }
  require_finite(field, name);
  return {field.channel, BrickCopy(std::get<SparseVoxels>(field.voxels))};
}

MemoryField FieldCopy::view() const {
  if (const auto* dense = std::get_if<DenseCopy>(&voxels))
    return {channel, DenseVoxels{dense->values.all(), dense->size, dense->index_to_world}};
  return {channel, std::get<BrickCopy>(voxels).view()};
}

void FieldCopy::put(const BrickCopy& bricks) {
  if (const auto* dense = std::get_if<DenseCopy>(&voxels)) voxels = BrickCopy(*dense);
  std::get<BrickCopy>(voxels).put(bricks);
}

void Changes::put(Changes newer) {
  for (Bricks& bricks : newer.fields) {
    const auto same = std::ranges::find(fields, bricks.channel, &Bricks::channel);
    if (same == fields.end()) {
      fields.push_back(std::move(bricks));
    } else {
      same->bricks.put(bricks.bricks);
    }
  }
}

}  // namespace cumulet::volume
