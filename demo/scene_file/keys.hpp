#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace cumulet::demo {

/// Versions of the file format. Version 1 has one volume without transform and no lights; saving in it drops the rest.
/// Version 3 is version 2 with other names.
enum class SceneFormat { first = 1, second = 2, third = 3 };

// Keys of scene files. The code names a key as version 3 does, but with the sections `volume`, `medium` and `surfaces`
// of version 1: "volume.transforms" is "volumes[0].transforms" in a file. The tables of settings have such keys.

/// Returns the path of a key in a file of this version. volume: index of the volume that the key belongs to.
[[nodiscard]] std::string key_in(SceneFormat format, const std::string& key, std::size_t volume);

/// Returns the path in version 3 of a path that only versions 1 and 2 have; "" if there is none.
[[nodiscard]] std::string replacement_of(const std::string& path);

/// Returns the name of a value in a file of this version.
template <class Name>
[[nodiscard]] std::string_view value_in(SceneFormat format, const Name& name) {
  if constexpr (requires { name.old; }) {
    if (format != SceneFormat::third && *name.old != '\0') return name.old;
  }
  return name.name;
}

}  // namespace cumulet::demo
