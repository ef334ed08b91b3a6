#pragma once

// Copies of a host's simulation fields, which outlive the call.

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <variant>
#include <vector>

#include "volume/memory.hpp"

namespace cumulet::volume {

/// An uninitialized array of floats: a vector would initialize them first, on one thread.
class Floats {
 public:
  Floats() = default;
  explicit Floats(std::size_t count) : values_(new float[count]), count_(count) {}
  [[nodiscard]] std::span<float> all() { return {values_.get(), count_}; }
  [[nodiscard]] std::span<const float> all() const { return {values_.get(), count_}; }

 private:
  std::unique_ptr<float[]> values_;
  std::size_t count_ = 0;
};

/// A dense field.
struct DenseCopy {
  Floats values;
  glm::ivec3 size{0};
  glm::dmat4 index_to_world{1.0};
};

/// Bricks that can be replaced.
class BrickCopy {
 public:
  /// zeros: in bricks without a mask, only voxels that are not 0 are active, as in a dense field; otherwise all are.
  explicit BrickCopy(const SparseVoxels& voxels, bool zeros = false);
  /// The active voxels are those that are not 0.
  explicit BrickCopy(const DenseCopy& dense);
  /// Creates a field without bricks.
  explicit BrickCopy(const glm::dmat4& index_to_world) : index_to_world_(index_to_world) {}

  void reserve(std::size_t count);
  /// Adds a brick at a new origin; its voxels that are not 0 are active. Returns whether all values are finite.
  bool add(const glm::ivec3& origin, std::span<const float, brick_voxels> values);

  /// Returns a view; it refers to this object.
  [[nodiscard]] SparseVoxels view() const;
  /// Replaces or adds bricks. O(bricks of the other); the first call is O(all bricks).
  void put(const BrickCopy& other);
  [[nodiscard]] std::size_t count() const { return origins_.size() / 3; }
  [[nodiscard]] const glm::dmat4& index_to_world() const { return index_to_world_; }

 private:
  struct Hash {
    std::size_t operator()(const glm::ivec3& origin) const;
  };
  void index();
  void set(std::size_t brick, const BrickCopy& of, std::size_t from);

  std::vector<std::int32_t> origins_;
  std::vector<float> values_;
  std::vector<std::uint64_t> active_;
  std::vector<SourceTile> tiles_;
  float background_ = 0.0F;
  glm::dmat4 index_to_world_{1.0};
  std::unordered_map<glm::ivec3, std::size_t, Hash> indices_;  // index of bricks by origin; empty until put() is called
};

/// A field with its own memory.
struct FieldCopy {
  Channel channel;
  std::variant<DenseCopy, BrickCopy> voxels;

  /// Copies a field, in parallel. Throws like require_finite().
  static FieldCopy of(const MemoryField& field, const std::string& name);
  [[nodiscard]] MemoryField view() const;
  void put(const BrickCopy& bricks);
};

/// An update of existing fields.
struct Changes {
  struct Bricks {
    Channel channel;
    BrickCopy bricks;
  };
  std::vector<Bricks> fields;
  /// Merges a newer update over this one.
  void put(Changes newer);
};

}  // namespace cumulet::volume
