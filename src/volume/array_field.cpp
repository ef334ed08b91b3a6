#include "volume/array_field.hpp"

#include <algorithm>
#include <array>

#include "volume/import_detail.hpp"

namespace cumulet::volume::detail {

namespace {

constexpr int max_side = 1 << 20;

struct TypeName {
  std::string_view name;
  NumberType type;
};
constexpr std::array type_names = {
    TypeName{"int8", NumberType::int8},
    TypeName{"uint8", NumberType::uint8},
    TypeName{"int16", NumberType::int16},
    TypeName{"uint16", NumberType::uint16},
    TypeName{"int32", NumberType::int32},
    TypeName{"uint32", NumberType::uint32},
    TypeName{"int64", NumberType::int64},
    TypeName{"uint64", NumberType::uint64},
    TypeName{"float32", NumberType::float32},
    TypeName{"float64", NumberType::float64},
    TypeName{"int8_t", NumberType::int8},
    TypeName{"signed char", NumberType::int8},
    TypeName{"uint8_t", NumberType::uint8},
    TypeName{"uchar", NumberType::uint8},
    TypeName{"unsigned char", NumberType::uint8},
    TypeName{"int16_t", NumberType::int16},
    TypeName{"short", NumberType::int16},
    TypeName{"short int", NumberType::int16},
    TypeName{"signed short", NumberType::int16},
    TypeName{"signed short int", NumberType::int16},
    TypeName{"uint16_t", NumberType::uint16},
    TypeName{"ushort", NumberType::uint16},
    TypeName{"unsigned short", NumberType::uint16},
    TypeName{"unsigned short int", NumberType::uint16},
    TypeName{"int32_t", NumberType::int32},
    TypeName{"int", NumberType::int32},
    TypeName{"signed int", NumberType::int32},
    TypeName{"uint32_t", NumberType::uint32},
    TypeName{"uint", NumberType::uint32},
    TypeName{"unsigned int", NumberType::uint32},
    TypeName{"int64_t", NumberType::int64},
    TypeName{"longlong", NumberType::int64},
    TypeName{"long long", NumberType::int64},
    TypeName{"long long int", NumberType::int64},
    TypeName{"signed long long", NumberType::int64},
    TypeName{"signed long long int", NumberType::int64},
    TypeName{"uint64_t", NumberType::uint64},
    TypeName{"ulonglong", NumberType::uint64},
    TypeName{"unsigned long long", NumberType::uint64},
    TypeName{"unsigned long long int", NumberType::uint64},
    TypeName{"float", NumberType::float32},
    TypeName{"double", NumberType::float64},
};

}  // namespace

std::optional<NumberType> number_type_of(std::string_view name) {
  for (const TypeName& type : type_names)
    if (type.name == name) return type.type;
  return std::nullopt;
}

const char* name_of(NumberType type) { return std::ranges::find(type_names, type, &TypeName::type)->name.data(); }

std::size_t size_of(NumberType type) {
  constexpr std::array<std::size_t, 10> sizes = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return sizes.at(static_cast<std::size_t>(type));
}

void check_array_size(const ArrayField& field) {
  if (glm::any(glm::lessThan(field.size, glm::ivec3(1))) ||
      glm::any(glm::greaterThan(field.size, glm::ivec3(max_side))))
    fail("its size is " + to_string(field.size) + "; each side is from 1 to " + std::to_string(max_side));
}

}  // namespace cumulet::volume::detail
