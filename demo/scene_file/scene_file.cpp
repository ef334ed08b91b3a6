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
#include <optional>
#include <program.hpp>
#include <set>
#include <settings.hpp>
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
using settings::number_text;
using settings::Range;
using settings::Spelling;

constexpr int format_version = 1;
constexpr double max_u32 = 4294967295.0;
// JSON's numbers are exact integers up to here.
constexpr double max_integer = 9007199254740992.0;

[[noreturn]] void fail(const std::string& file, const std::string& cause) {
  throw std::runtime_error(file + ": " + one_line(cause));  // a key may be of any text
}

/// A file's keys, each named by its path, such as "light.sun.irradiance", and taken out of it when it is read: what is
/// left over is refused, since a misspelt key would go unnoticed.
class Reader {
 public:
  Reader(std::string file, Json json) : file_(std::move(file)), json_(std::move(json)) {
    if (!json_.is_object()) fail(file_, "the file is not an object");
  }

  void text(const std::string& key, std::string& out) {
    const std::optional<Json> value = take(key);
    if (!value) return;
    if (!value->is_string()) wrong(key, "is not a text");
    out = value->get<std::string>();
    if (out.find('\0') != std::string::npos) wrong(key, "holds a zero byte");
  }

  /// Whether the key's value is this word; takes nothing else.
  bool word(const std::string& key, const char* word) {
    const Json* value = find(key).value;
    if (value == nullptr || !value->is_string() || value->get<std::string>() != word) return false;
    take(key);
    return true;
  }

  void flag(const std::string& key, std::int32_t& out) {
    const std::optional<Json> value = take(key);
    if (!value) return;
    if (!value->is_boolean()) wrong(key, "is neither true nor false");
    out = value->get<bool>() ? 1 : 0;
  }

  template <class Names, class Value>
  void choice(const std::string& key, const Names& names, Value& out) {
    if (!has(key)) return;
    std::string chosen;
    text(key, chosen);
    for (const auto& name : names) {
      if (chosen == name.name) {
        out = static_cast<Value>(name.value);
        return;
      }
    }
    wrong(key, "'" + chosen + "' is none of " + list_names(names, ", "));
  }

  /// Whether there is one. It holds for the number that is kept, too: a float may be less exact.
  template <class Number>
  bool number(const std::string& key, Number& out, const Range& range) {
    const std::optional<Json> value = take(key);
    if (!value) return false;
    out = static_cast<Number>(checked(key, *value, range));
    if (!range.holds(out)) wrong(key, range.refusal());
    return true;
  }

  template <class Number>
  void integer(const std::string& key, Number& out, double least, double most) {
    const std::optional<Json> value = take(key);
    if (!value) return;
    const double number = checked(key, *value, {least, most});
    if (number != std::floor(number)) wrong(key, number_text(number) + " is not a whole number");
    out = static_cast<Number>(number);
  }

  template <class Number>
  bool three(const std::string& key, Number (&out)[3], const Range& range = {}) {
    const std::optional<Json> value = take(key);
    if (!value) return false;
    if (!value->is_array() || value->size() != 3) wrong(key, "is not three numbers");
    for (std::size_t i = 0; i < 3; ++i) out[i] = static_cast<Number>(checked(key, (*value)[i], range));
    return true;
  }

  [[nodiscard]] bool has(const std::string& key) { return find(key).value != nullptr; }

  [[noreturn]] void wrong(const std::string& key, const std::string& cause) const { fail(file_, key + ": " + cause); }

  void finish() const { refuse_rest(json_, ""); }

 private:
  /// A value and the object that it is in; null where there is none.
  struct Place {
    Json* value = nullptr;
    Json* object = nullptr;
  };

  /// Remembers the objects on the way, which may be there, be it empty.
  Place find(const std::string& key) {
    Json* at = &json_;
    for (std::size_t begin = 0;;) {
      const std::size_t end = key.find('.', begin);
      const auto found = at->find(key.substr(begin, end - begin));
      if (found == at->end()) return {};
      if (end == std::string::npos) return {&*found, at};
      at = &*found;
      const std::string section = key.substr(0, end);
      if (!at->is_object()) fail(file_, section + " is not an object");
      sections_.insert(section);
      begin = end + 1;
    }
  }

  std::optional<Json> take(const std::string& key) {
    const Place place = find(key);
    if (place.value == nullptr) return std::nullopt;
    Json taken = std::move(*place.value);
    place.object->erase(key.substr(key.rfind('.') + 1));
    return taken;
  }

  void refuse_rest(const Json& object, const std::string& where) const {
    for (const auto& item : object.items()) {
      const std::string key = where + item.key();
      if (!sections_.contains(key)) wrong(key, "there is no such setting");
      refuse_rest(item.value(), key + ".");
    }
  }

  [[nodiscard]] double checked(const std::string& key, const Json& value, const Range& range) const {
    if (!value.is_number()) wrong(key, "is not a number");
    const double number = value.get<double>();
    if (!range.holds(number)) wrong(key, number_text(number) + " " + range.refusal());
    return number;
  }

  std::string file_;
  Json json_;
  std::set<std::string> sections_;
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

void read_camera(Reader& reader, cumulet_camera_desc& desc) {
  const bool eye = reader.three("camera.eye", desc.eye);
  const bool target = reader.three("camera.target", desc.target);
  if (eye != target) reader.wrong(eye ? "camera.target" : "camera.eye", "is missing");
  if (eye && std::equal(desc.eye, desc.eye + 3, desc.target))
    reader.wrong("camera.target", "is the same point as the eye");
  if (reader.three("camera.up", desc.up) && std::equal(desc.up, desc.up + 3, std::array{0.0, 0.0, 0.0}.begin()))
    reader.wrong("camera.up", "has no direction");
  reader.number("camera.fovy_degrees", desc.fovy_degrees, {0.0, 180.0, true});
  reader.number("camera.orthographic_height", desc.orthographic_height, settings::not_negative);
}

template <class Desc, class Value>
void read_setting(Reader& reader, const settings::Setting<Desc, Value>& setting, Value& value) {
  const Range range = setting.given_range();
  if constexpr (settings::Enumerated<Value>) {
    reader.choice(setting.key, setting.choices, value);
  } else if constexpr (settings::Switch<Value>) {
    reader.flag(setting.key, value);
  } else if constexpr (settings::Count<Value>) {
    const double most = std::min(static_cast<double>(std::numeric_limits<Value>::max()), max_integer);
    reader.integer(setting.key, value, std::max(range.least, 0.0), most);
  } else if constexpr (settings::Real<Value>) {
    const bool given = reader.number(setting.key, value, range);
    if (given && setting.spelling == Spelling::zero_is_negative && value == 0.0) value = -1.0;
  } else if (setting.spelling == Spelling::complement) {
    double complement[3];
    if (!reader.three(setting.key, complement, range)) return;
    for (std::size_t i = 0; i < 3; ++i) value[i] = static_cast<float>(1.0 - complement[i]);
  } else if (reader.three(setting.key, value, range) && setting.zero != 0.0 && settings::all_zero(value)) {
    reader.wrong(setting.key, "is black");
  }
}

template <class Desc>
void read_settings(Reader& reader, Desc& desc) {
  settings::for_each<Desc>([&](const auto& setting) {
    if (*setting.key != '\0') read_setting(reader, setting, desc.*setting.field);
  });
}

void read_scene(Reader& reader, SceneOptions& scene) {
  int version = 0;
  if (!reader.has("cumulet_scene")) reader.wrong("cumulet_scene", "is missing: not a Cumulet scene");
  reader.integer("cumulet_scene", version, 0.0, max_u32);
  if (version != format_version)
    reader.wrong("cumulet_scene", "version " + std::to_string(version) + " is not known: this program reads 1");
  reader.text("volume.file", scene.volume);
  reader.text("volume.grid", scene.grid_name);
  reader.text("medium.temperature_grid", scene.temperature_grid);
  reader.text("medium.flame_grid", scene.flame_grid);
  reader.text("medium.color_grid", scene.color_grid);
  reader.choice("volume.up", up_names, scene.up);
  reader.text("surfaces.file", scene.surfaces);
  reader.integer("surfaces.camera", scene.surface_camera, -1.0, 1e6);
  read_camera(reader, scene.camera);
  // Without a word, a file of this version means 1: there was no other way.
  scene.auto_density_scale = reader.word("medium.density_scale", "auto");
  reader.text("environment.file", scene.environment);
  if (!reader.has("light") && scene.environment.empty()) scene.set_daylight_of_version_1();
  reader.integer("picture.width", scene.width, 1.0, 16384.0);
  reader.integer("picture.height", scene.height, 1.0, 16384.0);
  for_each_group(scene, [&](auto& group) { read_settings(reader, group); });
  reader.finish();
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

Json three(const double (&xyz)[3]) { return {xyz[0], xyz[1], xyz[2]}; }

template <class Names, class Value>
const char* name_of(const Names& names, Value value) {
  for (const auto& name : names)
    if (static_cast<Value>(name.value) == value) return name.name;
  throw std::logic_error("a setting has no name");
}

/// Nothing for what is left to the library.
template <class Desc, class Value>
std::optional<Json> json_of(const settings::Setting<Desc, Value>& setting, const Value& value) {
  if constexpr (settings::Enumerated<Value>) {
    return name_of(setting.choices, value);
  } else if constexpr (settings::Switch<Value>) {
    return value != 0;
  } else if constexpr (settings::Triple<Value>) {
    if (setting.zero != 0.0 && settings::all_zero(value)) return std::nullopt;
    const auto one = setting.spelling == Spelling::complement ? albedo_of : shortest;
    return Json{one(value[0]), one(value[1]), one(value[2])};
  } else {
    const bool negative = setting.spelling == Spelling::zero_is_negative;
    if (value == Value{} && (setting.zero != 0.0 || negative)) return std::nullopt;
    if constexpr (settings::Count<Value>) {
      return value;
    } else {
      const Value spelled = negative ? std::max(value, Value{}) : value;
      if constexpr (std::is_same_v<Value, float>) return shortest(spelled);
      return spelled;
    }
  }
}

template <class Desc>
void write_settings(Json& json, const Desc& desc) {
  settings::for_each<Desc>([&](const auto& setting) {
    if (*setting.key == '\0') return;
    const std::optional<Json> value = json_of(setting, desc.*setting.field);
    std::string path = "/" + std::string(setting.key);
    std::ranges::replace(path, '.', '/');
    if (value) json[Json::json_pointer(path)] = *value;
  });
}

Json to_json(const SceneOptions& scene, const std::string& volume, const std::string& surfaces,
             const std::string& environment) {
  Json json;
  json["cumulet_scene"] = format_version;
  json["volume"]["file"] = volume;
  if (!scene.grid_name.empty()) json["volume"]["grid"] = scene.grid_name;
  if (scene.up != UpAxis::y) json["volume"]["up"] = name_of(up_names, scene.up);
  if (!scene.temperature_grid.empty()) json["medium"]["temperature_grid"] = scene.temperature_grid;
  if (!scene.flame_grid.empty()) json["medium"]["flame_grid"] = scene.flame_grid;
  if (!scene.color_grid.empty()) json["medium"]["color_grid"] = scene.color_grid;

  if (!surfaces.empty()) {
    Json& shown = json["surfaces"];
    shown["file"] = surfaces;
    if (scene.surface_camera >= 0) shown["camera"] = scene.surface_camera;
    write_settings(json, scene.surface);
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

  if (scene.auto_density_scale && scene.medium.density_scale == 0.0) json["medium"]["density_scale"] = "auto";
  write_settings(json, scene.medium);
  write_settings(json, scene.light);
  if (!environment.empty()) {
    json["environment"]["file"] = environment;
    write_settings(json, scene.environment_settings);
  }
  write_settings(json, scene.grid);
  json["picture"]["width"] = scene.width;
  json["picture"]["height"] = scene.height;
  write_settings(json, scene.sampling);
  write_settings(json, scene.display);
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
  for_each_group(*this, [](auto& group) { group.struct_size = sizeof group; });
  camera.struct_size = sizeof camera;
  sampling.samples = 64;
}

cumulet_volume_file_desc volume_file(const SceneOptions& scene) {
  cumulet_volume_file_desc desc{};
  desc.struct_size = sizeof desc;
  desc.path = scene.volume.c_str();
  desc.grid_name = scene.grid_name.c_str();
  desc.temperature_grid = scene.temperature_grid.c_str();
  desc.flame_grid = scene.flame_grid.c_str();
  desc.color_grid = scene.color_grid.c_str();
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
  set_daylight_of_version_1();
  light.sky = CUMULET_SKY_PHYSICAL;
  light.turbidity = 2.5f;
  light.ground_albedo = 0.3f;
}

void SceneOptions::set_daylight_of_version_1() {
  light.sun_azimuth_degrees = 65.0f;
  light.sun_elevation_degrees = 40.0f;
  constexpr std::array<float, 3> sun = {4.4f, 4.05f, 3.55f};
  constexpr std::array<float, 3> sky = {0.06f, 0.11f, 0.21f};
  std::copy(sun.begin(), sun.end(), light.sun_irradiance);
  std::copy(sky.begin(), sky.end(), light.sky_radiance);
}

void SceneOptions::set_environment(const std::string& file) {
  SceneOptions day;
  SceneOptions first;
  day.set_daylight();
  first.set_daylight_of_version_1();
  if (settings::same(light, day.light) || settings::same(light, first.light)) light = SceneOptions().light;
  environment = file;
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
  Reader reader(path, std::move(json));
  read_scene(reader, scene);
  const fs::path folder = fs::path(path).parent_path();
  for (std::string* file : {&scene.volume, &scene.surfaces, &scene.environment})
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
  return to_json(scene, portable_file(scene.volume, path), portable_file(scene.surfaces, path),
                 portable_file(scene.environment, path))
             .dump(2, ' ', false, Json::error_handler_t::replace) +
         "\n";
}

void save_scene(const SceneOptions& scene, const std::string& path) {
  image::replace_file(path, scene_text(scene, path));
}

bool same_scene(const SceneOptions& a, const SceneOptions& b) {
  return to_json(a, a.volume, a.surfaces, a.environment) == to_json(b, b.volume, b.surfaces, b.environment);
}

}  // namespace cumulet::demo
