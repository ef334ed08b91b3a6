#pragma once

// Field offsets of cumulet.h's structs, for struct_size checks.

#include <array>
#include <cstddef>

#include "cumulet/cumulet.h"

namespace cumulet::c_abi {

/// A field of a struct of the ABI.
struct Field {
  const char* name;
  size_t offset, size, alignment;
  [[nodiscard]] constexpr size_t end() const { return offset + size; }
};
template <class Desc>
inline constexpr auto fields_of = nullptr;

constexpr size_t aligned(size_t size, size_t alignment) { return (size + alignment - 1) / alignment * alignment; }

/// Returns true if the fields cover the whole struct.
template <class Desc>
constexpr bool covers() {
  size_t end = 0;
  for (const Field& field : fields_of<Desc>) {
    if (field.offset != aligned(end, field.alignment)) return false;
    end = field.end();
  }
  return aligned(end, alignof(Desc)) == sizeof(Desc);
}
#include "struct_fields.inc"

/// Returns the number of bytes that hold fields in a struct of this size. The size must be that of the struct in this
/// header or an older one: it ends with a field, or with the padding after a field. Returns 0 for any other size.
template <class Desc>
size_t bytes_of_fields(size_t size) {
  size_t bytes = 0;
  for (const Field& field : fields_of<Desc>) {
    if (field.end() <= size) bytes = field.end();
  }
  return size == bytes || size == aligned(bytes, alignof(Desc)) ? bytes : 0;
}

}  // namespace cumulet::c_abi
