#pragma once

#include <utility>

#include "base/revision.hpp"

namespace cumulet::scene {

/// A part of a scene, and its revision. Copies are told apart by that: of one part, one copy is set.
template <class Value>
class Part {
 public:
  [[nodiscard]] const Value& operator*() const { return value_; }
  [[nodiscard]] const Value* operator->() const { return &value_; }
  /// Another revision, where the value is another.
  void set(Value value) {
    if (value == value_) return;
    value_ = std::move(value);
    revision_.advance();
  }
  /// Whether both are of one revision. O(1).
  bool operator==(const Part& other) const { return revision_ == other.revision_; }

 private:
  Value value_{};
  Revision<Value> revision_;
};

}  // namespace cumulet::scene
