#pragma once

// What a host hands over of a simulation, in memory that outlives the call.

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

/// Numbers that are filled by whoever makes them: a vector would fill them first, on one thread.
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

/// Bricks, of which some may be replaced.
class BrickCopy {
 public:
  /// zeros: a brick without a mask has as active voxels those that are not 0, as a dense field has; else all.
  explicit BrickCopy(const SparseVoxels& voxels, bool zeros = false);
  /// Of voxels that are not 0.
  explicit BrickCopy(const DenseCopy& dense);
  /// Of none yet.
  explicit BrickCopy(const glm::dmat4& index_to_world) : index_to_world_(index_to_world) {}

  void reserve(std::size_t count);
  /// One more, at a place where none is: active are those of its voxels that are not 0. Returns whether all are finite.
  bool add(const glm::ivec3& origin, std::span<const float, brick_voxels> values);

  /// What it reads from stays here.
  [[nodiscard]] SparseVoxels view() const;
  /// Bricks of the other take the place of those here, or are added. O(bricks of the other), the first time of all.
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
  std::unordered_map<glm::ivec3, std::size_t, Hash> places_;  // of bricks; empty until one is put
};

/// A field in memory of its own.
struct FieldCopy {
  Channel channel;
  std::variant<DenseCopy, BrickCopy> voxels;

  /// A copy, in parallel. Throws what require_finite does.
  static FieldCopy of(const MemoryField& field, const std::string& name);
  [[nodiscard]] MemoryField view() const;
  void put(const BrickCopy& bricks);
};

/// What changes of fields that are there.
struct Changes {
  struct Bricks {
    Channel channel;
    BrickCopy bricks;
  };
  std::vector<Bricks> fields;
  /// Newer ones on top of these.
  void put(Changes newer);
};

}  // namespace cumulet::volume
