#pragma once

#include <cstdint>

namespace cumulet {

/// Revision number of one object: equal if nothing has changed. `Of` is the kind of object, so that revisions of
/// different kinds cannot be compared.
template <class Of>
class Revision {
 public:
  void advance() { ++number_; }
  bool operator==(const Revision&) const = default;

 private:
  std::uint64_t number_ = 0;
};

}  // namespace cumulet
