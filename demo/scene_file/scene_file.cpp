#include "scene_file.hpp"

#include <algorithm>
#include <analytic_light_limits.hpp>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <file.hpp>
#include <filesystem>
#include <frames.hpp>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <program.hpp>
#include <set>
#include <settings.hpp>
#include <span>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "matrix.hpp"

namespace cumulet::demo {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;
using settings::number_text;
using settings::Range;
using settings::Spelling;

constexpr double max_u32 = 4294967295.0;
// Largest integer up to which JSON numbers (doubles) are exact.
constexpr double max_integer = 9007199254740992.0;

[[noreturn]] void fail(const std::string& file, const std::string& cause) {
  throw std::runtime_error(file + ": " + one_line(cause));  // a key may contain any text
}

/// Lists names in quotes, for an error message.
std::string list_quoted(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "\"" : ", \"") + name + "\"";
  return list.empty() ? "none" : list;
}

/// Returns a rotation about axis x, y or z (0 to 2), counter-clockwise when looking against the axis.
Matrix rotation(std::size_t axis, double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const std::size_t u = (axis + 1) % 3;
  const std::size_t v = (axis + 2) % 3;
  Matrix m{1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0};
  m[5 * u] = m[5 * v] = std::cos(angle);
  m[4 * u + v] = std::sin(angle);
  m[4 * v + u] = -std::sin(angle);
  return m;
}

constexpr std::size_t max_transforms = 100'000;
constexpr std::size_t max_volumes = 10'000;
constexpr std::size_t max_models = 10'000;
constexpr std::size_t max_cameras = 10'000;

/// A transform: scale, then rotations about x, y and z, then translation.
struct TransformParts {
  double translate[3] = {};
  double degrees[3] = {};
  double scale[3] = {1.0, 1.0, 1.0};

  [[nodiscard]] Matrix matrix() const {
    Matrix m{scale[0], 0.0, 0.0, 0.0, 0.0, scale[1], 0.0, 0.0, 0.0, 0.0, scale[2], 0.0, 0.0, 0.0, 0.0, 1.0};
    for (std::size_t axis = 0; axis < 3; ++axis) m = product(rotation(axis, degrees[axis]), m);
    std::copy(translate, translate + 3, &m[12]);
    return m;
  }
};

/// Reads a scene file. Keys are paths such as "sun_sky.sun.irradiance" or "lights[0].power". Each key is removed
/// when it is read, and leftover keys are an error, because a misspelled key would otherwise go unnoticed. Callers use
/// the names of keys.hpp; errors use the names of the file's version.
class Reader {
 public:
  Reader(std::string file, Json json) : file_(std::move(file)), json_(std::move(json)) {
    if (!json_.is_object()) fail(file_, "the file is not a JSON object");
  }

  void set_format(SceneFormat format) { format_ = format; }
  /// Sets the volume that the following keys belong to.
  void of_volume(std::size_t volume) { volume_ = volume; }

  /// Returns the number of objects in a list; 0 if there is no list. More than `most` is an error.
  std::size_t list(const std::string& key, std::size_t most) {
    const auto found = json_.find(key);
    if (found == json_.end()) return 0;
    if (!found->is_array()) wrong(key, "is not a list");
    if (found->size() > most)
      wrong(key, "has " + std::to_string(found->size()) + " elements; the limit is " + std::to_string(most));
    sections_.insert(key);
    return found->size();
  }

  void text(const std::string& key, std::string& out) {
    const std::optional<Json> value = take(key);
    if (!value) return;
    if (!value->is_string()) wrong(key, "is not a string");
    out = value->get<std::string>();
    if (out.find('\0') != std::string::npos) wrong(key, "contains a zero byte");
  }

  [[nodiscard]] bool is_text(const std::string& key) {
    const Json* value = find(key).value;
    return value != nullptr && value->is_string();
  }

  /// Returns true and removes the key if its value is this word. Otherwise leaves it.
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
    std::string list;
    for (const auto& name : names) {
      const std::string_view spelled = value_in(format_, name);
      if (chosen == spelled) {
        out = static_cast<Value>(name.value);
        return;
      }
      if (chosen == value_in(SceneFormat::second, name)) wrong(key, "'" + chosen + "' is now '" + name.name + "'");
      list += (list.empty() ? "" : ", ") + std::string(spelled);
    }
    wrong(key, "'" + chosen + "' is not one of " + list);
  }

  /// Returns true if the key exists. The range is also checked after conversion, because a float may be rounded.
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
    return numbers(key, std::span<Number>(out), "three numbers", range);
  }

  template <class Number>
  bool numbers(const std::string& key, std::span<Number> out, const char* what, const Range& range = {}) {
    const std::optional<Json> value = take(key);
    if (!value) return false;
    take_numbers(key, *value, out, what, range);
    return true;
  }

  /// Reads a list of transforms, each 16 numbers or an object with translate, rotate_degrees and scale.
  void transforms(const std::string& key, std::vector<Matrix>& out) {
    const std::optional<Json> value = take(key);
    if (!value) return;
    if (!value->is_array()) wrong(key, "is not a list");
    if (value->empty()) wrong(key, "is empty: remove it for a single instance");
    if (value->size() > max_transforms)
      wrong(key, "has " + std::to_string(value->size()) + " elements; the limit is " + std::to_string(max_transforms));
    for (std::size_t i = 0; i < value->size(); ++i) {
      const Json& one = (*value)[i];
      const std::string where = key + "[" + std::to_string(i) + "]";
      Matrix& matrix = out.emplace_back();
      if (one.is_array()) {
        take_numbers(where, one, std::span<double>(matrix), "16 numbers", {});
        continue;
      }
      if (!one.is_object()) wrong(where, "is neither 16 numbers nor an object");
      TransformParts parts;
      for (const auto& item : one.items()) {
        const std::string part = where + "." + item.key();
        if (item.key() == "translate") {
          take_numbers(part, item.value(), std::span<double>(parts.translate), "three numbers", {});
        } else if (item.key() == "rotate_degrees") {
          take_numbers(part, item.value(), std::span<double>(parts.degrees), "three numbers", {});
        } else if (item.key() == "scale") {
          take_numbers(part, item.value(), std::span<double>(parts.scale), "three numbers", settings::above_zero);
        } else {
          wrong(part, "there is no such setting");
        }
      }
      matrix = parts.matrix();
    }
  }

  void names(const std::string& key, std::vector<std::string>& out) {
    const std::optional<Json> value = take(key);
    if (!value) return;
    if (!value->is_array()) wrong(key, "is not a list of names");
    out.clear();
    for (const Json& name : *value) {
      if (!name.is_string()) wrong(key, "has a name that is not a string");
      out.push_back(name.get<std::string>());
    }
  }

  void ramp(const std::string& key, settings::RampPoints& out) {
    const std::optional<Json> value = take(key);
    if (!value) return;
    if (!value->is_array()) wrong(key, "is not a list of points");
    out.clear();
    for (const Json& point : *value) {
      if (!point.is_array() || point.size() != 2) wrong(key, "has a point that is not two numbers");
      out.push_back({static_cast<float>(checked(key, point[0], {})), static_cast<float>(checked(key, point[1], {}))});
    }
    const std::string why = settings::ramp_refusal(out);
    if (!why.empty()) wrong(key, why);
  }

  [[nodiscard]] bool has(const std::string& key) { return find(key).value != nullptr; }

  [[noreturn]] void wrong(const std::string& key, const std::string& cause) const {
    fail(file_, key_in(format_, key, volume_) + ": " + cause);
  }

  void finish() const { refuse_rest(json_, ""); }

 private:
  template <class Number>
  void take_numbers(const std::string& key, const Json& value, std::span<Number> out, const char* what,
                    const Range& range) const {
    if (!value.is_array() || value.size() != out.size()) wrong(key, std::string("is not ") + what);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<Number>(checked(key, value[i], range));
  }

  /// A value and the object that contains it; both null if the key does not exist.
  struct Location {
    Json* value = nullptr;
    Json* object = nullptr;
  };

  /// Finds a value. Records the objects and lists on its path as known sections, which are valid even if they are
  /// empty.
  Location find(const std::string& wanted) {
    const std::string key = key_in(format_, wanted, volume_);
    Json* at = &json_;
    for (std::size_t begin = 0;;) {
      const std::size_t end = key.find('.', begin);
      const std::size_t bracket = key.find('[', begin);
      const bool of_list = bracket < end;
      const std::string name = key.substr(begin, std::min(bracket, end) - begin);
      const auto found = at->find(name);
      if (found == at->end()) return {};
      if (end == std::string::npos && !of_list) return {&*found, at};
      at = &*found;
      if (of_list) {
        const std::string list = key.substr(0, bracket);
        if (!at->is_array()) fail(file_, list + " is not a list");
        sections_.insert(list);
        const std::size_t index = std::stoul(key.substr(bracket + 1));
        if (index >= at->size()) return {};
        at = &(*at)[index];
      }
      const std::string section = key.substr(0, end);
      if (!at->is_object()) fail(file_, section + " is not an object");
      sections_.insert(section);
      begin = end + 1;
    }
  }

  std::optional<Json> take(const std::string& key) {
    const Location location = find(key);
    if (location.value == nullptr) return std::nullopt;
    Json taken = std::move(*location.value);
    const std::string path = key_in(format_, key, volume_);
    location.object->erase(path.substr(path.rfind('.') + 1));
    return taken;
  }

  void refuse_rest(const Json& rest, const std::string& where) const {
    for (const auto& item : rest.items()) {
      const std::string key =
          rest.is_array() ? where + "[" + item.key() + "]" : where + (where.empty() ? "" : ".") + item.key();
      if (!sections_.contains(key)) {
        const std::string now = format_ == SceneFormat::third ? replacement_of(key) : "";
        fail(file_, key + ": there is no such setting" + (now.empty() ? "" : ": it is now " + now));
      }
      refuse_rest(item.value(), key);
    }
  }

  [[nodiscard]] double checked(const std::string& key, const Json& value, const Range& range) const {
    if (!value.is_number()) wrong(key, "is not a number");
    const double number = value.get<double>();
    if (!range.holds(number)) wrong(key, number_text(number) + " " + range.refusal());
    return number;
  }

  std::string file_;
  SceneFormat format_ = SceneFormat::first;
  std::size_t volume_ = 0;
  Json json_;
  std::set<std::string> sections_;
};

/// Detects keys that occur twice in an object. The parser silently keeps only one of them.
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
  /// Returns the path of the first repeated key, such as "picture.width"; "" if there is none.
  [[nodiscard]] const std::string& first() const { return first_; }

 private:
  std::vector<std::vector<std::string>> objects_;  // open objects, each with its keys so far
  std::string first_;
};

/// Reads a camera pose. of: "camera." or "camera.open." Returns true if the eye is given.
bool read_pose(Reader& reader, const std::string& of, bool is_end, cumulet_camera_desc& desc) {
  const bool eye = reader.three(of + "eye", desc.eye);
  const bool target = reader.three(of + "target", desc.target);
  if (eye != target && !is_end) reader.wrong(of + (eye ? "target" : "eye"), "is missing");
  if ((eye || target) && std::equal(desc.eye, desc.eye + 3, desc.target))
    reader.wrong(of + "target", "is the same point as the eye");
  if (reader.three(of + "up", desc.up) && std::equal(desc.up, desc.up + 3, std::array{0.0, 0.0, 0.0}.begin()))
    reader.wrong(of + "up", "is zero");
  reader.number(of + "fovy_degrees", desc.fovy_degrees, {0.0, 180.0, true});
  reader.number(of + "orthographic_height", desc.orthographic_height, settings::not_negative);
  return eye;
}

/// Reads a camera. of: "camera." or "cameras[0]." Values missing in the shutter poses are those of the camera itself.
void read_camera(Reader& reader, SceneFormat format, const std::string& of, SceneCamera& out) {
  const bool has_pose = read_pose(reader, of, false, out.camera);
  reader.number(of + "lens_radius", out.camera.lens_radius, settings::not_negative);
  reader.number(of + "focus_distance", out.camera.focus_distance, settings::not_negative);
  if (format == SceneFormat::first) return;
  const auto end = [&](const std::string& key, std::optional<cumulet_camera_desc>& pose) {
    if (!reader.has(key)) return;
    if (!has_pose) reader.wrong(key, "needs a camera with eye and target");
    pose = out.camera;
    read_pose(reader, key + ".", true, *pose);
    if ((pose->orthographic_height > 0.0) != (out.camera.orthographic_height > 0.0))
      reader.wrong(key + ".orthographic_height", "has another projection than the camera");
  };
  end(of + "open", out.camera_open);
  end(of + "close", out.camera_close);
}

void read_named_cameras(Reader& reader, std::vector<NamedCamera>& cameras) {
  cameras.resize(reader.list("cameras", max_cameras));
  std::set<std::string_view> known;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const std::string of = "cameras[" + std::to_string(i) + "].";
    std::string& name = cameras[i].name;
    if (!reader.has(of + "name")) reader.wrong(of + "name", "is missing");
    reader.text(of + "name", name);
    if (name.empty()) reader.wrong(of + "name", "is empty");
    if (!known.insert(name).second) reader.wrong(of + "name", "\"" + name + "\" is also the name of another camera");
    read_camera(reader, SceneFormat::third, of, cameras[i]);
  }
}

void read_cameras(Reader& reader, SceneFormat format, SceneOptions& scene) {
  if (format != SceneFormat::first) read_named_cameras(reader, scene.cameras);
  if (format == SceneFormat::first || !reader.is_text("camera")) return read_camera(reader, format, "camera.", scene);
  std::string name;
  reader.text("camera", name);
  try {
    look_through(scene, name);
  } catch (const std::runtime_error& error) {
    reader.wrong("camera", error.what());
  }
}

template <class Desc, class Value>
void read_setting(Reader& reader, const settings::Setting<Desc, Value>& setting, const std::string& key, Value& value) {
  const Range range = setting.given_range();
  if constexpr (settings::Enumerated<Value>) {
    reader.choice(key, setting.choices, value);
  } else if constexpr (settings::Switch<Value>) {
    reader.flag(key, value);
  } else if constexpr (settings::Count<Value>) {
    const double most = std::min({static_cast<double>(std::numeric_limits<Value>::max()), max_integer, range.most});
    reader.integer(key, value, std::max(range.least, 0.0), most);
  } else if constexpr (settings::Real<Value>) {
    const bool given = reader.number(key, value, range);
    if (given && setting.spelling == Spelling::zero_is_negative && value == 0.0) value = -1.0;
  } else if constexpr (settings::Rectangle<Value>) {
    reader.numbers(key, std::span<float>(value), "four numbers", range);
  } else if (setting.spelling == Spelling::complement) {
    double complement[3];
    if (!reader.three(key, complement, range)) return;
    for (std::size_t i = 0; i < 3; ++i) value[i] = static_cast<float>(1.0 - complement[i]);
  } else if (reader.three(key, value, range) && setting.zero != 0.0 && settings::all_zero(value)) {
    reader.wrong(key, "must not be black");
  }
}

/// Reads the settings of a descriptor. where: key prefix, "" or for example "lights[0]."
template <class Desc>
void read_settings(Reader& reader, Desc& desc, const std::string& where = "") {
  settings::for_each<Desc>([&](const auto& setting) {
    if (*setting.key != '\0') read_setting(reader, setting, where + setting.key, desc.*setting.field);
  });
}

void read_analytic_lights(Reader& reader, std::vector<cumulet_light_desc>& analytic_lights) {
  analytic_lights.resize(reader.list("lights", settings::max_analytic_lights));
  for (std::size_t i = 0; i < analytic_lights.size(); ++i) {
    cumulet_light_desc& analytic_light = analytic_lights[i];
    analytic_light.struct_size = sizeof analytic_light;
    const std::string where = "lights[" + std::to_string(i) + "].";
    if (!reader.has(where + "kind")) reader.wrong(where + "kind", "is missing");
    read_settings(reader, analytic_light, where);
    if (const auto refusal = settings::analytic_light_refusal(analytic_light))
      reader.wrong(where + refusal->name, refusal->cause);
  }
}

/// Reads the transform of a volume or model. of: "volume." or "models[0]."
void read_transform(Reader& reader, const std::string& of, Matrix& to_world) {
  const bool whole = reader.numbers(of + "to_world", std::span<double>(to_world), "16 numbers");
  TransformParts transform;
  bool parts = reader.three(of + "translate", transform.translate);
  parts = reader.three(of + "rotate_degrees", transform.degrees) || parts;
  parts = reader.three(of + "scale", transform.scale, settings::above_zero) || parts;
  if (whole && parts) reader.wrong(of + "to_world", "cannot be combined with translate, rotate_degrees or scale");
  if (parts) to_world = transform.matrix();
}

/// Reads the transforms at shutter open and close. of: as in read_transform.
void read_shutter(Reader& reader, const std::string& of, SceneShutter& shutter) {
  const auto end = [&](const std::string& key, std::optional<Matrix>& out) {
    if (!reader.has(key)) return;
    Matrix step{};
    read_transform(reader, key + ".", step);
    if (step == Matrix{}) step = TransformParts().matrix();
    out = step;
  };
  end(of + "open", shutter.open);
  end(of + "close", shutter.close);
}

bool read_visible(Reader& reader, const std::string& of) {
  std::int32_t visible = 1;
  reader.flag(of + "visible", visible);
  return visible != 0;
}

SceneFormat read_version(Reader& reader) {
  int version = 0;
  if (!reader.has("cumulet_scene")) reader.wrong("cumulet_scene", "is missing: not a Cumulet scene");
  reader.integer("cumulet_scene", version, 0.0, max_u32);
  if (version < 1 || version > 3)
    reader.wrong("cumulet_scene",
                 "version " + std::to_string(version) + " is not supported: this program reads 1 to 3");
  return static_cast<SceneFormat>(version);
}

/// Reads a volume except the settings of its medium.
void read_volume(Reader& reader, SceneFormat format, SceneVolume& volume) {
  reader.text("volume.file", volume.volume);
  reader.text("volume.grid", volume.grid_name);
  reader.text("medium.temperature_grid", volume.temperature_grid);
  reader.text("medium.flame_grid", volume.flame_grid);
  reader.text("medium.color_grid", volume.color_grid);
  reader.text("medium.anisotropy_grid", volume.anisotropy_grid);
  reader.text("medium.velocity_grid", volume.velocity_grid);
  reader.choice("volume.up", up_names, volume.up);
  volume.auto_density_scale = reader.word("medium.density_scale", "auto");
  for (std::size_t i = 0; i < volume.ramps.size(); ++i) reader.ramp(settings::ramps[i].key, volume.ramps[i]);
  if (format == SceneFormat::first) return;
  read_transform(reader, "volume.", volume.to_world);
  reader.transforms("volume.transforms", volume.transforms);
  read_shutter(reader, "volume.", volume.shutter);
  reader.text("volume.name", volume.name);
  volume.visible = read_visible(reader, "volume.");
}

/// Reads a model other than the scene's surfaces. of: "models[1]."
SceneModel read_model(Reader& reader, const std::string& of) {
  SceneModel model;
  if (!reader.has(of + "file")) reader.wrong(of + "file", "is missing");
  reader.text(of + "file", model.file);
  if (model.file.empty()) reader.wrong(of + "file", "is empty");
  reader.text(of + "name", model.name);
  read_transform(reader, of, model.to_world);
  read_shutter(reader, of, model.shutter);
  model.visible = read_visible(reader, of);
  std::int32_t flag = 0;
  reader.flag(of + "shadow_only", flag);
  model.shadow_only = flag != 0;
  flag = 0;
  reader.flag(of + "holdout", flag);
  model.holdout = flag != 0;
  reader.number(of + "time", model.time, {});
  reader.integer(of + "animation", model.animation, 0.0, max_u32);
  reader.text(of + "variant", model.variant);
  flag = 0;
  reader.flag(of + "double_sided", flag);
  model.double_sided = flag != 0;
  reader.integer(of + "group", model.group, 0.0, settings::group_range.most);
  return model;
}

/// Returns true if models[0] is a model with its own transform or name. Otherwise it is the scene's surfaces, which
/// version 1 also supports.
bool has_transform(Reader& reader, const std::string& of) {
  constexpr std::array keys{"name",    "to_world",    "translate", "rotate_degrees", "scale",
                            "visible", "shadow_only", "open",      "close"};
  return std::ranges::any_of(keys, [&](const char* key) { return reader.has(of + key); });
}

void read_models(Reader& reader, SceneOptions& scene) {
  const std::size_t count = reader.list("models", max_models);
  for (std::size_t i = 0; i < count; ++i) {
    const std::string of = "models[" + std::to_string(i) + "].";
    if (i == 0 && !has_transform(reader, of)) continue;
    if (i == 0 && reader.has(of + "camera"))
      reader.wrong(of + "camera", "is only supported for a model without transform and name");
    scene.models.push_back(read_model(reader, of));
  }
}

void read_sequence(Reader& reader, SceneSequence& sequence) {
  read_settings(reader, sequence.playback);
  const auto frame = [&](const char* key, std::optional<Frame>& out) {
    Frame number = 0;
    if (!reader.has(key)) return;
    reader.integer(key, number, first_frame, last_frame);
    out = number;
  };
  frame("sequence.first_frame", sequence.first);
  frame("sequence.last_frame", sequence.last);
  double position = 0.0;
  if (reader.number("sequence.frame", position, {double{first_frame}, double{last_frame}}))
    sequence.frame = Moment::of_thousandths(std::llround(1000.0 * position));
  if (sequence.first && sequence.last && *sequence.first > *sequence.last)
    reader.wrong("sequence.last_frame", "is less than sequence.first_frame");
}

/// Reads the sections that version 1 does not have.
void read_lists(Reader& reader, SceneFormat format, SceneOptions& scene) {
  const std::size_t volumes = reader.list("volumes", max_volumes);
  read_models(reader, scene);
  read_analytic_lights(reader, scene.analytic_lights);
  for (std::size_t i = 1; i < volumes; ++i) {
    SceneVolume& volume = scene.others.emplace_back();
    reader.of_volume(i);
    if (!reader.has("volume.file")) reader.wrong("volume.file", "is missing");
    read_volume(reader, format, volume);
    if (volume.volume.empty()) reader.wrong("volume.file", "is empty");
    read_settings(reader, volume.medium);
    if (volume.medium.max_bounces != 0)
      reader.wrong("medium.max_bounces", "can only be set for the first volume and applies to all");
    read_sequence(reader, volume.sequence);
  }
  reader.of_volume(0);
  read_sequence(reader, scene.sequence);
}

void read_scene(Reader& reader, SceneOptions& scene) {
  const SceneFormat format = read_version(reader);
  const bool has_lists = format != SceneFormat::first;
  reader.set_format(format);
  if (has_lists) read_lists(reader, format, scene);
  read_volume(reader, format, scene);
  read_cameras(reader, format, scene);
  reader.text("surfaces.file", scene.surfaces);
  reader.text("surfaces.variant", scene.surface_variant);
  reader.integer("surfaces.camera", scene.surface_camera, -1.0, 1e6);
  reader.text("environment.file", scene.environment);
  if (has_lists) {
    if (!reader.has("sun_sky") && !reader.has("environment") && !reader.has("lights")) scene.set_daylight();
  } else if (!reader.has("sun_sky") && scene.environment.empty()) {
    scene.set_daylight_of_version_1();
  }
  reader.integer("picture.width", scene.width, 1.0, 16384.0);
  reader.integer("picture.height", scene.height, 1.0, 16384.0);
  reader.names("picture.light_groups", scene.light_groups);
  if (const std::string why = light_groups_refusal(scene.light_groups); !why.empty())
    reader.wrong("picture.light_groups", why);
  const bool names_criterion = reader.has("grid.criterion");
  for_each_group(scene, [&](auto& group) { read_settings(reader, group); });
  if (names_criterion) settings::name_criterion(scene.grid);
  reader.finish();
}

/// Returns the decimal number with the fewest digits that identifies the float: 0.1, not 0.10000000149011612.
double shortest(float value) {
  std::array<char, 64> text{};
  const auto* end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  double number = 0.0;
  std::from_chars(text.data(), end, number);
  return number;
}

/// Returns the albedo with the fewest digits that is read back as this coalbedo.
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
std::string name_of(SceneFormat format, const Names& names, Value value) {
  for (const auto& name : names)
    if (static_cast<Value>(name.value) == value) return std::string(value_in(format, name));
  throw std::logic_error("a setting has no name");
}

/// Returns the JSON value of a setting; nullopt if it is left to the library's default.
template <class Desc, class Value>
std::optional<Json> json_of(SceneFormat format, const settings::Setting<Desc, Value>& setting, const Value& value) {
  if constexpr (settings::Enumerated<Value>) {
    return name_of(format, setting.choices, value);
  } else if constexpr (settings::Switch<Value>) {
    return value != 0;
  } else if constexpr (settings::Rectangle<Value>) {
    Json numbers = Json::array();
    for (const float number : value) numbers.push_back(shortest(number));
    if (std::ranges::all_of(value, [](float number) { return number == 0.0f; })) return std::nullopt;
    return numbers;
  } else if constexpr (settings::Triple<Value>) {
    if (setting.zero != 0.0 && settings::all_zero(value)) return std::nullopt;
    const bool complement = setting.spelling == Spelling::complement;
    const auto one = [&](auto component) -> double {
      if constexpr (std::is_same_v<decltype(component), double>) return component;
      return complement ? albedo_of(static_cast<float>(component)) : shortest(static_cast<float>(component));
    };
    return Json{one(value[0]), one(value[1]), one(value[2])};
  } else {
    const bool negative = setting.spelling == Spelling::zero_is_negative;
    const bool left = setting.zero != 0.0 || negative || (setting.given && !setting.given->holds(0.0));
    if (value == Value{} && left) return std::nullopt;
    if constexpr (settings::Count<Value>) {
      return value;
    } else {
      const Value spelled = negative ? std::max(value, Value{}) : value;
      if constexpr (std::is_same_v<Value, float>) return shortest(spelled);
      return spelled;
    }
  }
}

/// Writes a scene's keys at the paths of the file's version.
class Writer {
 public:
  explicit Writer(SceneFormat format) : format_(format) { json_["cumulet_scene"] = static_cast<int>(format); }

  /// Sets the volume that the following keys belong to.
  void of_volume(std::size_t volume) { volume_ = volume; }
  void put(const std::string& key, const Json& value) {
    std::string path = "/";
    for (const char c : key_in(format_, key, volume_)) {
      if (c == ']') continue;
      path += c == '.' || c == '[' ? '/' : c;
    }
    json_[Json::json_pointer(path)] = value;
  }
  void put_text(const std::string& key, const std::string& value) {
    if (!value.empty()) put(key, value);
  }
  template <class Desc>
  void put_settings(const Desc& desc, const std::string& where = "") {
    settings::for_each<Desc>([&](const auto& setting) {
      if (*setting.key == '\0') return;
      const std::optional<Json> value = json_of(format_, setting, desc.*setting.field);
      if (value) put(where + setting.key, *value);
    });
  }
  Json take() { return std::move(json_); }

 private:
  SceneFormat format_;
  std::size_t volume_ = 0;
  Json json_;
};

void put_shutter(Writer& writer, const std::string& of, const SceneShutter& shutter) {
  if (shutter.open) writer.put(of + "open.to_world", *shutter.open);
  if (shutter.close) writer.put(of + "close.to_world", *shutter.close);
}

Json pose_json(const cumulet_camera_desc& view) {
  Json camera = Json::object();
  if (!std::equal(view.eye, view.eye + 3, view.target)) {
    camera["eye"] = three(view.eye);
    camera["target"] = three(view.target);
  }
  if (view.up[0] != 0.0 || view.up[1] != 0.0 || view.up[2] != 0.0) camera["up"] = three(view.up);
  if (view.fovy_degrees > 0.0) camera["fovy_degrees"] = view.fovy_degrees;
  if (view.orthographic_height > 0.0) camera["orthographic_height"] = view.orthographic_height;
  return camera;
}

Json camera_json(const SceneCamera& view, SceneFormat format) {
  Json camera = pose_json(view.camera);
  if (view.camera.lens_radius > 0.0) camera["lens_radius"] = view.camera.lens_radius;
  if (view.camera.focus_distance > 0.0) camera["focus_distance"] = view.camera.focus_distance;
  if (format == SceneFormat::first) return camera;
  if (view.camera_open) camera["open"] = pose_json(*view.camera_open);
  if (view.camera_close) camera["close"] = pose_json(*view.camera_close);
  return camera;
}

void put_cameras(Writer& writer, SceneFormat format, const SceneOptions& scene) {
  const NamedCamera* const named = format != SceneFormat::first ? looked_through(scene) : nullptr;
  writer.put("camera", named != nullptr ? Json(named->name) : camera_json(scene, format));
  if (format == SceneFormat::first) return;
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    Json camera = {{"name", scene.cameras[i].name}};
    camera.update(camera_json(scene.cameras[i], format));
    writer.put("cameras[" + std::to_string(i) + "]", camera);
  }
}

void put_volume(Writer& writer, SceneFormat format, const SceneVolume& volume, const std::string& file) {
  const bool has_lists = format != SceneFormat::first;
  if (has_lists) writer.put_text("volume.name", volume.name);
  writer.put("volume.file", file);
  writer.put_text("volume.grid", volume.grid_name);
  if (volume.up != UpAxis::y) writer.put("volume.up", name_of(format, up_names, volume.up));
  if (has_lists) {
    if (volume.to_world != Matrix{}) writer.put("volume.to_world", volume.to_world);
    if (!volume.transforms.empty()) writer.put("volume.transforms", volume.transforms);
    put_shutter(writer, "volume.", volume.shutter);
    if (!volume.visible) writer.put("volume.visible", false);
  }
  writer.put_text("medium.temperature_grid", volume.temperature_grid);
  writer.put_text("medium.flame_grid", volume.flame_grid);
  writer.put_text("medium.color_grid", volume.color_grid);
  writer.put_text("medium.anisotropy_grid", volume.anisotropy_grid);
  writer.put_text("medium.velocity_grid", volume.velocity_grid);
  if (volume.auto_density_scale && volume.medium.density_scale == 0.0) writer.put("medium.density_scale", "auto");
  writer.put_settings(volume.medium);
  for (std::size_t i = 0; i < volume.ramps.size(); ++i) {
    Json points = Json::array();
    for (const auto& [value, result] : volume.ramps[i]) points.push_back({shortest(value), shortest(result)});
    if (!points.empty()) writer.put(settings::ramps[i].key, points);
  }
}

void put_model(Writer& writer, std::size_t number, const SceneModel& model, const std::string& file) {
  const std::string of = "models[" + std::to_string(number) + "].";
  // For model 0 the name is always written, because without it the reader takes the model for the scene's surfaces.
  // The other values of model 0 replace those of scene.surface, which were written at the same paths.
  if (!model.name.empty() || number == 0) writer.put(of + "name", model.name);
  writer.put(of + "file", file);
  if (model.to_world != Matrix{}) writer.put(of + "to_world", model.to_world);
  put_shutter(writer, of, model.shutter);
  if (!model.visible) writer.put(of + "visible", false);
  if (model.shadow_only) writer.put(of + "shadow_only", true);
  if (model.holdout) writer.put(of + "holdout", true);
  if (model.time != 0.0 || number == 0) writer.put(of + "time", model.time);
  if (model.animation != 0 || number == 0) writer.put(of + "animation", model.animation);
  if (!model.variant.empty()) writer.put(of + "variant", model.variant);
  if (model.double_sided || number == 0) writer.put(of + "double_sided", model.double_sided);
  if (model.group != 0) writer.put(of + "group", model.group);
}

void put_sequence(Writer& writer, const SceneSequence& sequence) {
  const bool unsaid = settings::same(sequence.playback, SceneOptions().sequence.playback);
  if (!unsaid) writer.put_settings(sequence.playback);
  if (sequence.first) writer.put("sequence.first_frame", *sequence.first);
  if (sequence.last) writer.put("sequence.last_frame", *sequence.last);
  if (!sequence.frame) return;
  const Moment& moment = *sequence.frame;
  if (moment.is_between()) {
    writer.put("sequence.frame", static_cast<double>(moment.in_thousandths()) / 1000.0);
  } else {
    writer.put("sequence.frame", moment.frame);
  }
}

/// named: function that returns a file name as it is to be written.
template <class Named>
Json to_json(const SceneOptions& scene, SceneFormat format, const Named& named) {
  Writer writer(format);
  const bool has_lists = format != SceneFormat::first;
  put_volume(writer, format, scene, named(scene.volume));
  for (std::size_t i = 0; has_lists && i < scene.others.size(); ++i) {
    writer.of_volume(i + 1);
    put_volume(writer, format, scene.others[i], named(scene.others[i].volume));
    put_sequence(writer, scene.others[i].sequence);
  }
  writer.of_volume(0);
  if (has_lists) put_sequence(writer, scene.sequence);

  if (!scene.surfaces.empty()) {
    writer.put("surfaces.file", named(scene.surfaces));
    if (!scene.surface_variant.empty()) writer.put("surfaces.variant", scene.surface_variant);
    if (scene.surface_camera >= 0) writer.put("surfaces.camera", scene.surface_camera);
  }
  const bool models = has_lists && !scene.models.empty();
  if (!scene.surfaces.empty() || models) writer.put_settings(scene.surface);
  for (std::size_t i = 0; models && i < scene.models.size(); ++i)
    put_model(writer, i + (scene.surfaces.empty() ? 0 : 1), scene.models[i], named(scene.models[i].file));

  put_cameras(writer, format, scene);

  writer.put_settings(scene.light);
  if (!scene.environment.empty()) {
    writer.put("environment.file", named(scene.environment));
    writer.put_settings(scene.environment_settings);
  }
  for (std::size_t i = 0; has_lists && i < scene.analytic_lights.size(); ++i)
    writer.put_settings(scene.analytic_lights[i], "lights[" + std::to_string(i) + "].");
  writer.put_settings(scene.ground);
  writer.put_settings(scene.grid);
  writer.put("picture.width", scene.width);
  writer.put("picture.height", scene.height);
  writer.put_settings(scene.sampling);
  if (!scene.light_groups.empty()) writer.put("picture.light_groups", scene.light_groups);
  writer.put_settings(scene.display);
  Json json = writer.take();
  if (settings::criterion_of(scene.grid) != scene.grid.criterion) json["grid"].erase("criterion");
  return json;
}

fs::path folder_of(const std::string& path) {
  std::error_code error;
  const fs::path absolute = fs::absolute(fs::path(path), error);
  return error ? fs::path(path).parent_path() : absolute.parent_path();
}

/// Returns a file name as it is written into the scene file at `path`: relative if the file is in that folder or below
/// it.
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

SceneVolume::SceneVolume() { medium.struct_size = sizeof medium; }

std::string SceneModel::label() const { return name.empty() ? fs::path(file).filename().string() : name; }

std::string SceneVolume::label() const { return name.empty() ? fs::path(volume).filename().string() : name; }

SceneOptions::SceneOptions() {
  for_each_group(*this, [](auto& group) { group.struct_size = sizeof group; });
  sampling.samples = 64;
  display.denoise = CUMULET_DENOISE_FAST;
}

cumulet_playback_desc playback_of(const SceneSequence& sequence, const FrameRow& row) {
  cumulet_playback_desc desc = sequence.playback;
  const std::uint32_t first = sequence.first ? row.index_of(*sequence.first) : 0;
  const std::uint32_t last = sequence.last ? row.index_of(*sequence.last) : row.count() - 1;
  desc.first_frame = std::min(first, last);
  desc.frame_count = last - desc.first_frame + 1;
  // One playback frame is the step from one file to the next, whatever the step of their numbers. Velocities are per
  // number, so scale them by that step.
  if (row.count() > 1) {
    settings::spell_out_zeros(desc);
    desc.velocity_scale *= row.number(1) - row.number(0);
  }
  return desc;
}

cumulet_volume_file_desc volume_file(const VolumeFile& file) {
  cumulet_volume_file_desc desc{};
  desc.struct_size = sizeof desc;
  desc.path = file.volume.c_str();
  desc.grid_name = file.grid_name.c_str();
  desc.temperature_grid = file.temperature_grid.c_str();
  desc.flame_grid = file.flame_grid.c_str();
  desc.color_grid = file.color_grid.c_str();
  desc.anisotropy_grid = file.anisotropy_grid.c_str();
  desc.velocity_grid = file.velocity_grid.c_str();
  Matrix to_world = file.to_world;
  if (file.up == UpAxis::z) {
    constexpr Matrix upright = {1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0};
    to_world = to_world == Matrix{} ? upright : product(to_world, upright);
  }
  std::ranges::copy(to_world, desc.to_world);
  return desc;
}

std::string light_groups_refusal(const std::vector<std::string>& names) {
  if (names.size() > CUMULET_LIGHT_GROUPS)
    return "are more than " + std::to_string(int{CUMULET_LIGHT_GROUPS}) + " names";
  std::set<std::string_view> known;
  for (const std::string& name : names) {
    constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
    if (name.empty() || name.find_first_not_of(letters) != std::string::npos)
      return "has a name with characters other than letters, digits, _ and -";
    if (!known.insert(name).second) return "has a name twice";
  }
  return "";
}

void set_shutter(const SceneShutter& shutter, const double (&to_world)[16], double (&open)[16], double (&close)[16]) {
  Matrix transform{};
  std::ranges::copy(to_world, transform.begin());
  const auto end = [&](const std::optional<Matrix>& step, double(&out)[16]) {
    const Matrix at = !step ? Matrix{} : transform == Matrix{} ? *step : product(*step, transform);
    std::ranges::copy(at, out);
  };
  end(shutter.open, open);
  end(shutter.close, close);
}

void look_through(SceneOptions& scene, const std::string& name) {
  const auto found = std::ranges::find(scene.cameras, name, &NamedCamera::name);
  if (found == scene.cameras.end()) {
    std::vector<std::string> names;
    for (const NamedCamera& camera : scene.cameras) names.push_back(camera.name);
    throw std::runtime_error("no camera \"" + name + "\"; the scene has " + list_quoted(names));
  }
  static_cast<SceneCamera&>(scene) = *found;
  scene.surface_camera = -1;
}

const NamedCamera* looked_through(const SceneOptions& scene) {
  const Json shown = camera_json(scene, SceneFormat::third);
  const auto found = std::ranges::find_if(
      scene.cameras, [&](const NamedCamera& camera) { return camera_json(camera, SceneFormat::third) == shown; });
  return found == scene.cameras.end() ? nullptr : &*found;
}

void end_shutter(SceneOptions& scene) {
  scene.camera_open.reset();
  scene.camera_close.reset();
}

std::string animation_refusal(const std::string& file, std::uint32_t wanted, std::uint32_t animations) {
  if (wanted == 0 || wanted < animations) return {};  // 0 is the default, also for a file without animations
  return file + ": no animation " + std::to_string(wanted) + "; the file has " + std::to_string(animations);
}

std::uint32_t variant_number(const std::string& file, const std::string& wanted,
                             const std::vector<std::string>& names) {
  if (wanted.empty()) return 0;
  const auto named = std::ranges::find(names, wanted);
  if (named != names.end()) return static_cast<std::uint32_t>(named - names.begin()) + 1;
  std::uint32_t number = 0;
  const char* const end = wanted.data() + wanted.size();
  const auto [rest, error] = std::from_chars(wanted.data(), end, number);
  if (error == std::errc() && rest == end && number < names.size()) return number + 1;
  throw std::runtime_error(file + ": no material variant \"" + wanted + "\"; the file has " + list_quoted(names));
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
    // Example: "[json.exception.parse_error.101] parse error at line 1, column 2: ...; last read: ..."
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
  const auto find = [&](std::string& file) {
    if (!file.empty() && fs::path(file).is_relative()) file = (folder / file).string();
  };
  find(scene.volume);
  for (SceneVolume& other : scene.others) find(other.volume);
  find(scene.surfaces);
  for (SceneModel& model : scene.models) find(model.file);
  find(scene.environment);
  return scene;
}

SceneOptions load_scene(const std::string& path) {
  constexpr std::uintmax_t largest = 1 << 20;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (!error && size > largest) fail(path, "too large for a scene file");
  return parse_scene(image::read_file(path), path);
}

std::string scene_text(const SceneOptions& scene, const std::string& path, SceneFormat format) {
  // A file name may have any encoding: invalid UTF-8 is replaced instead of throwing.
  return to_json(scene, format, [&](const std::string& file) { return portable_file(file, path); })
             .dump(2, ' ', false, Json::error_handler_t::replace) +
         "\n";
}

void save_scene(const SceneOptions& scene, const std::string& path, SceneFormat format) {
  image::replace_file(path, scene_text(scene, path, format));
}

bool same_scene(const SceneOptions& a, const SceneOptions& b) {
  const auto all = [](SceneOptions s) {
    s.sequence.frame.reset();
    return to_json(s, SceneFormat::third, [](const std::string& file) { return file; });
  };
  return all(a) == all(b);
}

std::string version_text() {
  return std::to_string(CUMULET_VERSION_MAJOR) + "." + std::to_string(CUMULET_VERSION_MINOR) + "." +
         std::to_string(CUMULET_VERSION_PATCH);
}

std::string scene_hash(const SceneOptions& scene) {
  SceneOptions shown = scene;
  shown.sampling.samples = 0;
  shown.sampling.seed = 0;
  shown.sampling.noise_target_percent = 0.0f;
  shown.sampling.adaptive = 0;
  const auto named = [](const std::string& file) {
    if (file.empty()) return file;
    std::error_code error;
    const std::uintmax_t size = fs::file_size(file, error);
    std::string name = fs::path(file).filename().string();
    if (!error) name.append(1, ' ').append(std::to_string(size));
    return name;
  };
  shown.name.clear();
  for (SceneVolume& other : shown.others) other.name.clear();
  for (SceneModel& model : shown.models) model.name.clear();
  shown.cameras.clear();
  const std::string text =
      to_json(shown, SceneFormat::third, named).dump(-1, ' ', false, Json::error_handler_t::replace);
  std::array<char, 17> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx", static_cast<unsigned long long>(fnv1a(text)));
  return digits.data();
}

}  // namespace cumulet::demo
