#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <scene_file.hpp>
#include <string>

namespace cumulet::demo {

/// How a value is spelled on the command line and in scene files.
template <class Value>
struct Name {
  const char* text;
  Value value;
};
template <class Value>
Name(const char*, Value) -> Name<Value>;

inline constexpr std::array up_names = {Name{"y", UpAxis::y}, Name{"z", UpAxis::z}};
inline constexpr std::array march_names = {Name{"tet", CUMULET_MARCH_TET}, Name{"dense", CUMULET_MARCH_DENSE},
                                           Name{"brick", CUMULET_MARCH_BRICK}};
inline constexpr std::array cells_names = {Name{"constant", CUMULET_CELLS_CONSTANT},
                                           Name{"linear", CUMULET_CELLS_LINEAR}};
inline constexpr std::array criterion_names = {Name{"range-mean", CUMULET_CRITERION_RANGE_MEAN},
                                               Name{"deviation", CUMULET_CRITERION_DEVIATION}};
inline constexpr std::array view_names = {Name{"shaded", CUMULET_VIEW_SHADED}, Name{"cells", CUMULET_VIEW_CELLS},
                                          Name{"steps", CUMULET_VIEW_STEPS}, Name{"density", CUMULET_VIEW_DENSITY},
                                          Name{"wireframe", CUMULET_VIEW_WIREFRAME}};
inline constexpr std::array tone_map_names = {Name{"neutral", CUMULET_TONE_MAP_NEUTRAL},
                                              Name{"filmic", CUMULET_TONE_MAP_FILMIC},
                                              Name{"clip", CUMULET_TONE_MAP_CLIP}};
inline constexpr std::array surface_light_names = {Name{"full", CUMULET_SURFACE_LIGHT_FULL},
                                                   Name{"shadows", CUMULET_SURFACE_LIGHT_SHADOWS},
                                                   Name{"none", CUMULET_SURFACE_LIGHT_NONE}};
inline constexpr std::array aov_names = {
    Name{"volume", CUMULET_AOV_VOLUME},       Name{"transmittance", CUMULET_AOV_TRANSMITTANCE},
    Name{"depth", CUMULET_AOV_SURFACE_DEPTH}, Name{"volume_depth", CUMULET_AOV_VOLUME_DEPTH},
    Name{"normal", CUMULET_AOV_NORMAL},       Name{"albedo", CUMULET_AOV_ALBEDO}};
inline constexpr std::array background_names = {Name{"sky", CUMULET_BACKGROUND_SKY},
                                                Name{"transparent", CUMULET_BACKGROUND_TRANSPARENT}};

/// The names, for a message or a help text.
template <class Names>
[[nodiscard]] std::string list_names(const Names& names, const char* separator) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : separator) + std::string(name.text);
  return text;
}

}  // namespace cumulet::demo
