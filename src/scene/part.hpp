#pragma once

#include <utility>

#include "base/revision.hpp"

namespace cumulet::scene {

/// A part of a scene with its revision. Copies are compared by revision: only one copy of a part may be set.
template <class Value>
class Part {
 public:
  [[nodiscard]] const Value& operator*() const { return value_; }
  [[nodiscard]] const Value* operator->() const { return &value_; }
  /// Advances the revision if the value differs.
  void set(Value value) {
    if (value == value_) return;
    value_ = std::move(value);
    revision_.advance();
  }
  /// Whether both have the same revision. O(1).
  bool operator==(const Part& other) const { return revision_ == other.revision_; }

 private:
  Value value_{};
  Revision<Value> revision_;
};

}  // namespace cumulet::scene
