#include "keys.hpp"

#include <algorithm>
#include <array>
#include <charconv>

namespace cumulet::demo {
namespace {

/// A key or section that version 3 renamed. [] stands for an index.
struct Renamed {
  std::string_view now;
  std::string_view first;   // in version 1; "": version 1 does not have it
  std::string_view second;  // in version 2
};
// Longer keys come before their sections.
constexpr std::array renamed = {
    Renamed{"sun_sky.sun", "light.sun", "environment.sun"},
    Renamed{"sun_sky.sky", "light.sky", "environment.sky"},
    Renamed{"sun_sky", "light", "environment"},
    Renamed{"volume.transforms", "", "volume.places"},
    Renamed{"medium.second_weight", "medium.second_share", "medium.second_share"},
    Renamed{"sequence.interpolation", "", "sequence.between"},
    Renamed{"surfaces.lighting", "surfaces.light", "surfaces.light"},
    Renamed{"lights[].tangent", "", "lights[].across"},
    Renamed{"ground.mode", "ground.place", "ground.place"},
    Renamed{"grid.type", "grid.march", "grid.march"},
    Renamed{"grid.build_device", "grid.build", "grid.build"},
};

/// A section of version 1 and its path in later versions.
struct Moved {
  std::string_view first;
  std::string_view later;
};
constexpr std::array moved = {Moved{"volume", "volumes[]"}, Moved{"medium", "volumes[].medium"},
                              Moved{"surfaces", "models[0]"}};

/// Replaces "[]" by the index.
std::string with_index(std::string_view key, std::size_t index) {
  std::string text(key);
  if (const auto bracket = text.find("[]"); bracket != std::string::npos)
    text.insert(bracket + 1, std::to_string(index));
  return text;
}

/// Returns the number in the first brackets of a path; 0 without brackets.
std::size_t index_of(std::string_view path) {
  std::size_t index = 0;
  const auto bracket = path.find('[');
  if (bracket != std::string_view::npos) std::from_chars(path.data() + bracket + 1, path.data() + path.size(), index);
  return index;
}

/// Returns true if the key is the section, or is inside it.
bool is_in(std::string_view key, std::string_view section) {
  return key.starts_with(section) &&
         (key.size() == section.size() || key[section.size()] == '.' || key[section.size()] == '[');
}

std::string old_name(SceneFormat format, const std::string& key) {
  if (format == SceneFormat::third) return key;
  // The table has keys of lights without the index.
  const std::string plain = key.starts_with("lights[") ? "lights[" + key.substr(key.find(']')) : key;
  for (const Renamed& one : renamed) {
    if (!is_in(plain, one.now)) continue;
    const std::string_view old = format == SceneFormat::first ? one.first : one.second;
    if (old.empty()) return key;
    return with_index(old, index_of(key)) + plain.substr(one.now.size());
  }
  return key;
}

}  // namespace

std::string key_in(SceneFormat format, const std::string& key, std::size_t volume) {
  std::string name = old_name(format, key);
  const std::string section = name.substr(0, name.find('.'));
  if (section == "sequence" && volume > 0) return "volumes[" + std::to_string(volume) + "]." + name;
  const auto* const found = std::ranges::find(moved, section, &Moved::first);
  if (format == SceneFormat::first || found == moved.end()) return name;
  return with_index(found->later, volume) + name.substr(section.size());
}

std::string replacement_of(const std::string& path) {
  const std::size_t index = index_of(path);
  for (const SceneFormat format : {SceneFormat::second, SceneFormat::first}) {
    for (const Renamed& one : renamed) {
      const std::string key = with_index(one.now, index);
      if (old_name(format, key) != key && key_in(format, key, index) == path)
        return key_in(SceneFormat::third, key, index);
    }
  }
  if (std::ranges::find(moved, path, &Moved::first) != moved.end()) return key_in(SceneFormat::third, path, 0);
  return "";
}

}  // namespace cumulet::demo
