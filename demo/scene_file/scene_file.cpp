#include "scene_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <file.hpp>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "names.hpp"

namespace cumulet::demo {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr int format_version = 1;
constexpr double max_light = 1e30;
constexpr double max_u32 = 4294967295.0;
// JSON's numbers are exact integers up to here.
constexpr double max_integer = 9007199254740992.0;

[[noreturn]] void fail(const std::string& file, const std::string& cause) {
  throw std::runtime_error(file + ": " + cause);
}

std::string number_text(double value) {
  std::array<char, 64> text{};
  const auto* end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  const char* begin = text.data();
  return {begin, end};
}

struct Range {
  double least = -std::numeric_limits<double>::max();
  double most = std::numeric_limits<double>::max();
  bool open = false;  // the ends themselves are out
};

/// One JSON object: reads its keys, and refuses what it was not asked for, since a misspelt key would go unnoticed.
class Section {
 public:
  Section(std::string file, std::string where, const Json& json)
      : file_(std::move(file)), where_(std::move(where)), json_(json) {
    if (!json_.is_object()) fail(file_, (where_.empty() ? "the file" : where_) + " is not an object");
  }

  template <class Read>
  void section(const char* key, Read read) {
    if (const Json* value = find(key)) {
      Section inner(file_, name(key), *value);
      read(inner);
      inner.finish();
    }
  }

  void text(const char* key, std::string& out) {
    const Json* value = find(key);
    if (value == nullptr) return;
    if (!value->is_string()) wrong(key, "is not a text");
    out = value->get<std::string>();
    if (out.find('\0') != std::string::npos) wrong(key, "holds a zero byte");
  }

  /// Whether the key's value is this text.
  bool is_text(const char* key, const char* text) {
    const Json* value = find(key);
    return value != nullptr && value->is_string() && value->get<std::string>() == text;
  }

  void flag(const char* key, std::int32_t& out) {
    const Json* value = find(key);
    if (value == nullptr) return;
    if (!value->is_boolean()) wrong(key, "is neither true nor false");
    out = value->get<bool>() ? 1 : 0;
  }

  template <class Names, class Value>
  void choice(const char* key, const Names& names, Value& out) {
    std::string chosen;
    text(key, chosen);
    if (json_.find(key) == json_.end()) return;
    for (const auto& name : names) {
      if (chosen == name.text) {
        out = name.value;
        return;
      }
    }
    wrong(key, "'" + chosen + "' is none of " + list_names(names, ", "));
  }

  template <class Number>
  void number(const char* key, Number& out, const Range& range = {}) {
    if (const Json* value = find(key)) out = static_cast<Number>(checked(key, *value, range));
  }

  template <class Number>
  void integer(const char* key, Number& out, double least, double most) {
    const Json* value = find(key);
    if (value == nullptr) return;
    const double number = checked(key, *value, {least, most});
    if (number != std::floor(number)) wrong(key, number_text(number) + " is not a whole number");
    out = static_cast<Number>(number);
  }

  template <class Number>
  bool three(const char* key, Number (&out)[3], const Range& range = {}) {
    const Json* value = find(key);
    if (value == nullptr) return false;
    if (!value->is_array() || value->size() != 3) wrong(key, "is not three numbers");
    for (std::size_t i = 0; i < 3; ++i) out[i] = static_cast<Number>(checked(key, (*value)[i], range));
    return true;
  }

  [[nodiscard]] bool has(const char* key) const { return json_.contains(key); }

  [[noreturn]] void wrong(const char* key, const std::string& cause) const { fail(file_, name(key) + ": " + cause); }

  void finish() const {
    for (const auto& item : json_.items())
      if (std::find(known_.begin(), known_.end(), item.key()) == known_.end())
        fail(file_, name(item.key()) + ": there is no such setting");
  }

 private:
  [[nodiscard]] std::string name(const std::string& key) const { return where_.empty() ? key : where_ + "." + key; }

  const Json* find(const char* key) {
    known_.emplace_back(key);
    const auto found = json_.find(key);
    return found == json_.end() ? nullptr : &*found;
  }

  [[nodiscard]] double checked(const char* key, const Json& value, const Range& range) const {
    if (!value.is_number()) wrong(key, "is not a number");
    const double number = value.get<double>();
    const bool inside =
        range.open ? number > range.least && number < range.most : number >= range.least && number <= range.most;
    if (!inside) {
      const std::string given = number_text(number);
      if (range.most == std::numeric_limits<double>::max())
        wrong(key, given + (range.open ? " is not above " : " is less than ") + number_text(range.least));
      wrong(key, given + (range.open ? " is not between " : " is not from ") + number_text(range.least) +
                     (range.open ? " and " : " to ") + number_text(range.most));
    }
    return number;
  }

  std::string file_;
  std::string where_;
  const Json& json_;
  std::vector<std::string> known_;
};

/// Keys that an object has twice, of which a parser keeps one without a word.
class Repeats {
 public:
  void see(Json::parse_event_t event, const Json& parsed) {
    if (event == Json::parse_event_t::object_start) objects_.emplace_back();
    if (event == Json::parse_event_t::object_end) objects_.pop_back();
    if (event != Json::parse_event_t::key) return;
    auto& keys = objects_.back();
    keys.push_back(parsed.get<std::string>());
    if (std::find(keys.begin(), keys.end() - 1, keys.back()) == keys.end() - 1 || !first_.empty()) return;
    for (const auto& object : objects_) first_ += (first_.empty() ? "" : ".") + object.back();
  }
  /// Where the first one is, such as "picture.width"; "": there is none.
  [[nodiscard]] const std::string& first() const { return first_; }

 private:
  std::vector<std::vector<std::string>> objects_;  // under way, each with its keys so far
  std::string first_;
};

constexpr Range above_zero = {0.0, std::numeric_limits<double>::max(), true};
constexpr Range light_range = {0.0, max_light};

void read_camera(Section& camera, cumulet_camera_desc& desc) {
  const bool eye = camera.three("eye", desc.eye);
  const bool target = camera.three("target", desc.target);
  if (eye != target) camera.wrong(eye ? "target" : "eye", "is missing");
  if (eye && std::equal(desc.eye, desc.eye + 3, desc.target)) camera.wrong("target", "is the same point as the eye");
  if (camera.three("up", desc.up) && std::equal(desc.up, desc.up + 3, std::array{0.0, 0.0, 0.0}.begin()))
    camera.wrong("up", "has no direction");
  camera.number("fovy_degrees", desc.fovy_degrees, {0.0, 180.0, true});
  camera.number("orthographic_height", desc.orthographic_height, {0.0});
}

void read_medium(Section& medium, cumulet_medium_desc& desc, bool& automatic) {
  automatic = medium.is_text("density_scale", "auto");
  if (!automatic) medium.number("density_scale", desc.density_scale, above_zero);
  double albedo[3];
  if (medium.three("albedo", albedo, {0.0, 1.0}))
    for (std::size_t i = 0; i < 3; ++i) desc.coalbedo[i] = static_cast<float>(1.0 - albedo[i]);
  medium.number("anisotropy", desc.anisotropy, {-1.0, 1.0, true});
  // Close enough to 1 for a float to be 1.
  if (!(desc.anisotropy > -1.0f && desc.anisotropy < 1.0f)) medium.wrong("anisotropy", "is not between -1 and 1");
  medium.integer("max_bounces", desc.max_bounces, 0.0, max_u32);
  medium.three("emission", desc.emission, light_range);
}

void read_light(Section& light, cumulet_light_desc& desc) {
  light.section("sun", [&](Section& sun) {
    sun.number("azimuth_degrees", desc.sun_azimuth_degrees, {-360.0, 360.0});
    sun.number("elevation_degrees", desc.sun_elevation_degrees, {-90.0, 90.0});
    sun.three("irradiance", desc.sun_irradiance, light_range);
  });
  light.section("sky", [&](Section& sky) { sky.three("radiance", desc.sky_radiance, light_range); });
}

void read_grid(Section& grid, cumulet_grid_desc& desc) {
  grid.choice("march", march_names, desc.march);
  grid.choice("cells", cells_names, desc.cells);
  grid.choice("criterion", criterion_names, desc.criterion);
  grid.number("threshold", desc.threshold, {0.0});
  // Zero means the default in the API and "always split" to whoever writes it.
  if (grid.has("threshold") && desc.threshold == 0.0) desc.threshold = -1.0;
  grid.integer("max_cells", desc.max_cells, 1.0, max_integer);
  grid.flag("camera_adaptive", desc.camera_adaptive);
  grid.number("pixel_size", desc.pixel_size, above_zero);
}

void read_scene(Section& root, SceneOptions& scene) {
  // What a file of this version meant before there was another way.
  scene.auto_density_scale = false;
  int version = 0;
  root.integer("cumulet_scene", version, 0.0, max_u32);
  if (version != format_version)
    root.wrong("cumulet_scene", root.has("cumulet_scene")
                                    ? "version " + std::to_string(version) + " is not known: this program reads 1"
                                    : "is missing: not a Cumulet scene");
  root.section("volume", [&](Section& volume) {
    volume.text("file", scene.volume);
    volume.text("grid", scene.grid_name);
    volume.choice("up", up_names, scene.up);
  });
  root.section("surfaces", [&](Section& surfaces) {
    surfaces.text("file", scene.surfaces);
    surfaces.number("time", scene.surface.time);
    surfaces.integer("animation", scene.surface.animation, 0.0, max_u32);
    surfaces.integer("camera", scene.surface_camera, -1.0, 1e6);
    surfaces.choice("light", surface_light_names, scene.surface.light);
    surfaces.number("indirect_roughness", scene.surface.indirect_roughness, {0.0, 1.0});
    surfaces.flag("double_sided", scene.surface.double_sided);
  });
  root.section("camera", [&](Section& camera) { read_camera(camera, scene.camera); });
  root.section("medium", [&](Section& medium) { read_medium(medium, scene.medium, scene.auto_density_scale); });
  if (root.has("light"))
    root.section("light", [&](Section& light) { read_light(light, scene.light); });
  else
    scene.set_daylight();
  root.section("grid", [&](Section& grid) { read_grid(grid, scene.grid); });
  root.section("picture", [&](Section& picture) {
    picture.integer("width", scene.width, 1.0, 16384.0);
    picture.integer("height", scene.height, 1.0, 16384.0);
    picture.integer("samples", scene.sampling.samples, 1.0, max_u32);
    picture.integer("seed", scene.sampling.seed, 0.0, max_u32);
    picture.choice("view", view_names, scene.sampling.view);
  });
  root.section("display", [&](Section& display) {
    display.number("exposure_stops", scene.display.exposure_stops, {-64.0, 64.0});
    display.choice("tone_map", tone_map_names, scene.display.tone_map);
    display.choice("background", background_names, scene.display.background);
  });
  root.finish();
}

/// The decimal number with the fewest digits that says the float: 0.1, not 0.10000000149011612.
double shortest(float value) {
  std::array<char, 64> text{};
  const auto* end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  double number = 0.0;
  std::from_chars(text.data(), end, number);
  return number;
}

/// The albedo with the fewest digits that is read back as this coalbedo.
double albedo_of(float coalbedo) {
  for (int digits = 1; digits < 17; ++digits) {
    std::array<char, 64> text{};
    const auto* end = std::to_chars(text.data(), text.data() + text.size(), 1.0 - static_cast<double>(coalbedo),
                                    std::chars_format::general, digits)
                          .ptr;
    double albedo = 0.0;
    std::from_chars(text.data(), end, albedo);
    if (static_cast<float>(1.0 - albedo) == coalbedo) return albedo;
  }
  return 1.0 - static_cast<double>(coalbedo);
}

Json three(const float (&rgb)[3]) { return {shortest(rgb[0]), shortest(rgb[1]), shortest(rgb[2])}; }
Json three(const double (&xyz)[3]) { return {xyz[0], xyz[1], xyz[2]}; }

template <class Names, class Value>
const char* name_of(const Names& names, Value value) {
  for (const auto& name : names)
    if (name.value == value) return name.text;
  throw std::logic_error("a setting has no name");
}

Json to_json(const SceneOptions& scene, const std::string& volume, const std::string& surfaces) {
  Json json;
  json["cumulet_scene"] = format_version;
  json["volume"]["file"] = volume;
  if (!scene.grid_name.empty()) json["volume"]["grid"] = scene.grid_name;
  if (scene.up != UpAxis::y) json["volume"]["up"] = name_of(up_names, scene.up);

  if (!surfaces.empty()) {
    Json& shown = json["surfaces"];
    shown["file"] = surfaces;
    shown["time"] = scene.surface.time;
    shown["animation"] = scene.surface.animation;
    if (scene.surface_camera >= 0) shown["camera"] = scene.surface_camera;
    shown["light"] = name_of(surface_light_names, scene.surface.light);
    shown["indirect_roughness"] = shortest(scene.surface.indirect_roughness);
    shown["double_sided"] = scene.surface.double_sided != 0;
  }

  Json camera = Json::object();
  const auto& view = scene.camera;
  if (!std::equal(view.eye, view.eye + 3, view.target)) {
    camera["eye"] = three(view.eye);
    camera["target"] = three(view.target);
  }
  if (view.up[0] != 0.0 || view.up[1] != 0.0 || view.up[2] != 0.0) camera["up"] = three(view.up);
  if (view.fovy_degrees > 0.0) camera["fovy_degrees"] = view.fovy_degrees;
  if (view.orthographic_height > 0.0) camera["orthographic_height"] = view.orthographic_height;
  json["camera"] = camera;

  Json medium = Json::object();
  if (scene.medium.density_scale > 0.0) {
    medium["density_scale"] = scene.medium.density_scale;
  } else if (scene.auto_density_scale) {
    medium["density_scale"] = "auto";
  }
  const auto& coalbedo = scene.medium.coalbedo;
  medium["albedo"] = {albedo_of(coalbedo[0]), albedo_of(coalbedo[1]), albedo_of(coalbedo[2])};
  medium["anisotropy"] = shortest(scene.medium.anisotropy);
  medium["max_bounces"] = scene.medium.max_bounces;
  medium["emission"] = three(scene.medium.emission);
  json["medium"] = medium;

  Json& sun = json["light"]["sun"];
  sun["azimuth_degrees"] = shortest(scene.light.sun_azimuth_degrees);
  sun["elevation_degrees"] = shortest(scene.light.sun_elevation_degrees);
  sun["irradiance"] = three(scene.light.sun_irradiance);
  json["light"]["sky"]["radiance"] = three(scene.light.sky_radiance);

  Json& grid = json["grid"];
  grid["march"] = name_of(march_names, scene.grid.march);
  grid["cells"] = name_of(cells_names, scene.grid.cells);
  grid["criterion"] = name_of(criterion_names, scene.grid.criterion);
  if (scene.grid.threshold != 0.0) grid["threshold"] = std::max(scene.grid.threshold, 0.0);
  if (scene.grid.max_cells != 0) grid["max_cells"] = scene.grid.max_cells;
  grid["camera_adaptive"] = scene.grid.camera_adaptive != 0;
  if (scene.grid.pixel_size > 0.0) grid["pixel_size"] = scene.grid.pixel_size;

  Json& picture = json["picture"];
  picture["width"] = scene.width;
  picture["height"] = scene.height;
  if (scene.sampling.samples != 0) picture["samples"] = scene.sampling.samples;
  picture["seed"] = scene.sampling.seed;
  picture["view"] = name_of(view_names, scene.sampling.view);

  Json& display = json["display"];
  display["exposure_stops"] = shortest(scene.display.exposure_stops);
  display["tone_map"] = name_of(tone_map_names, scene.display.tone_map);
  display["background"] = name_of(background_names, scene.display.background);
  return json;
}

fs::path folder_of(const std::string& path) {
  std::error_code error;
  const fs::path absolute = fs::absolute(fs::path(path), error);
  return error ? fs::path(path).parent_path() : absolute.parent_path();
}

/// As it is written into the file at path: relative if it lies in that folder or below.
std::string portable_file(const std::string& file, const std::string& path) {
  if (file.empty()) return file;
  std::error_code error;
  const fs::path absolute = fs::absolute(fs::path(file), error).lexically_normal();
  if (error) return file;
  const fs::path relative = absolute.lexically_relative(folder_of(path).lexically_normal());
  const bool below = !relative.empty() && *relative.begin() != fs::path("..");
  return (below ? relative : absolute).string();
}

}  // namespace

SceneOptions::SceneOptions() {
  grid.struct_size = sizeof grid;
  medium.struct_size = sizeof medium;
  light.struct_size = sizeof light;
  camera.struct_size = sizeof camera;
  surface.struct_size = sizeof surface;
  sampling.struct_size = sizeof sampling;
  sampling.samples = 64;
  display.struct_size = sizeof display;
}

cumulet_volume_file_desc volume_file(const SceneOptions& scene) {
  cumulet_volume_file_desc desc{};
  desc.struct_size = sizeof desc;
  desc.path = scene.volume.c_str();
  desc.grid_name = scene.grid_name.empty() ? nullptr : scene.grid_name.c_str();
  if (scene.up == UpAxis::z) {
    constexpr std::array upright = {1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0};
    std::copy(upright.begin(), upright.end(), desc.to_world);
  }
  return desc;
}

std::string animation_refusal(const SceneOptions& scene, std::uint32_t animations) {
  const std::uint32_t wanted = scene.surface.animation;
  if (wanted == 0 || wanted < animations) return {};  // 0: the default, of a file without any
  return scene.surfaces + ": there is no animation " + std::to_string(wanted) + ": the file has " +
         std::to_string(animations);
}

void SceneOptions::set_daylight() {
  light.sun_azimuth_degrees = 65.0f;
  light.sun_elevation_degrees = 40.0f;
  constexpr std::array<float, 3> sun = {4.4f, 4.05f, 3.55f};
  constexpr std::array<float, 3> sky = {0.06f, 0.11f, 0.21f};
  std::copy(sun.begin(), sun.end(), light.sun_irradiance);
  std::copy(sky.begin(), sky.end(), light.sky_radiance);
}

SceneOptions parse_scene(const std::string& text, const std::string& path) {
  Json json;
  Repeats repeats;
  try {
    json = Json::parse(text, [&](int, Json::parse_event_t event, const Json& parsed) {
      repeats.see(event, parsed);
      return true;
    });
  } catch (const Json::exception& error) {
    // "[json.exception.parse_error.101] parse error at line 1, column 2: ...; last read: ..."
    std::string cause = error.what();
    if (const auto end = cause.find("] "); end != std::string::npos) cause.erase(0, end + 2);
    for (char& c : cause)
      if (static_cast<unsigned char>(c) < 0x20) c = ' ';
    if (cause.size() > 200) cause = cause.substr(0, 200) + "...";
    fail(path, "not JSON: " + cause);
  }
  if (!repeats.first().empty()) fail(path, repeats.first() + ": is given twice");
  SceneOptions scene;
  Section root(path, "", json);
  read_scene(root, scene);
  const fs::path folder = fs::path(path).parent_path();
  for (std::string* file : {&scene.volume, &scene.surfaces})
    if (!file->empty() && fs::path(*file).is_relative()) *file = (folder / *file).string();
  return scene;
}

SceneOptions load_scene(const std::string& path) {
  constexpr std::uintmax_t largest = 1 << 20;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (!error && size > largest) fail(path, "too large for a scene");
  return parse_scene(image::read_file(path), path);
}

std::string scene_text(const SceneOptions& scene, const std::string& path) {
  // A file's name may be in any encoding: what is not UTF-8 is replaced, not thrown at.
  return to_json(scene, portable_file(scene.volume, path), portable_file(scene.surfaces, path))
             .dump(2, ' ', false, Json::error_handler_t::replace) +
         "\n";
}

void save_scene(const SceneOptions& scene, const std::string& path) {
  image::replace_file(path, scene_text(scene, path));
}

bool same_scene(const SceneOptions& a, const SceneOptions& b) {
  return to_json(a, a.volume, a.surfaces) == to_json(b, b.volume, b.surfaces);
}

}  // namespace cumulet::demo
