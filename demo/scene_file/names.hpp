#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <string>

namespace cumulet::demo {

/// Up axis of a volume file. Blender and Mantaflow use Z; images use Y.
enum class UpAxis { y, z };

/// Spelling of a value on the command line and in scene files, for values that are not in a settings table.
template <class Value>
struct Name {
  const char* name;
  Value value;
};
template <class Value>
Name(const char*, Value) -> Name<Value>;

inline constexpr std::array up_names = {Name{"y", UpAxis::y}, Name{"z", UpAxis::z}};
/// Name of the Cryptomatte layers, which are not an AOV of the library.
inline constexpr const char* cryptomatte_name = "cryptomatte";
/// Joins the names for an error message or a help text.
template <class Names>
[[nodiscard]] std::string list_names(const Names& names, const char* separator) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : separator) + std::string(name.name);
  return text;
}

}  // namespace cumulet::demo
