#pragma once

#include <cstdint>

namespace cumulet {

/// Which state of one thing it is: equal where nothing changed. Of is the kind of thing, so that revisions of different
/// ones are not compared.
template <class Of>
class Revision {
 public:
  void advance() { ++number_; }
  bool operator==(const Revision&) const = default;

 private:
  std::uint64_t number_ = 0;
};

}  // namespace cumulet
