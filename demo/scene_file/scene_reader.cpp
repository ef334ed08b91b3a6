#include <algorithm>
#include <analytic_light_limits.hpp>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
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
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "keys.hpp"
#include "matrix.hpp"
#include "names.hpp"
#include "scene_file.hpp"

// Reads scene files.
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

  void color_ramp(const settings::ColorRampInfo& info, settings::ColorStops& out) {
    const std::optional<Json> value = take(info.key);
    if (!value) return;
    if (!value->is_array()) wrong(info.key, "is not a list of points");
    out.clear();
    for (const Json& stop : *value) {
      if (!stop.is_array() || stop.size() != 4) wrong(info.key, "has a point that is not four numbers");
      settings::ColorStop& numbers = out.emplace_back();
      for (std::size_t i = 0; i < 4; ++i) numbers[i] = static_cast<float>(checked(info.key, stop[i], {}));
    }
    const std::string why = settings::color_ramp_refusal(info, out);
    if (!why.empty()) wrong(info.key, why);
  }

  /// of: "volume."
  void clip(const std::string& of, settings::Clip& out) {
    const auto accept = [&](const std::string& key, const std::string& why) {
      if (!why.empty()) wrong(key, why);
    };
    const std::string box = of + "clip.box";
    settings::ClipBox corners{};
    if (numbers(box, std::span<double>(corners), "six numbers")) {
      accept(box, settings::clip_box_refusal(corners));
      out.box = corners;
    }
    const std::string planes = of + "clip.planes";
    const std::optional<Json> value = take(planes);
    if (!value) return;
    if (!value->is_array()) wrong(planes, "is not a list of planes");
    accept(planes, settings::clip_count_refusal(value->size()));
    for (const Json& one : *value) {
      settings::ClipPlane& plane = out.planes.emplace_back();
      const std::string where = planes + '[' + std::to_string(out.planes.size() - 1) + ']';
      take_numbers(where, one, std::span<double>(plane), "four numbers", {});
      accept(where, settings::clip_plane_refusal(plane));
    }
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
  volume.albedo_given = reader.has("medium.albedo");
  for (std::size_t i = 0; i < volume.ramps.size(); ++i) {
    reader.ramp(settings::ramps[i].key, volume.ramps[i]);
    reader.color_ramp(settings::color_ramps[i], volume.color_ramps[i]);
  }
  if (format == SceneFormat::first) return;
  read_transform(reader, "volume.", volume.to_world);
  reader.transforms("volume.transforms", volume.transforms);
  read_shutter(reader, "volume.", volume.shutter);
  reader.clip("volume.", volume.clip);
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

void read_ocio(Reader& reader, OcioView& view) {
  reader.text("display.ocio.config", view.config);
  reader.text("display.ocio.display", view.display);
  reader.text("display.ocio.view", view.view);
  reader.text("display.ocio.input", view.input);
  if (view.config.empty() && view != OcioView()) reader.wrong("display.ocio.config", "is missing");
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
  read_ocio(reader, scene.ocio);
  const bool names_criterion = reader.has("grid.criterion");
  for_each_group(scene, [&](auto& group) { read_settings(reader, group); });
  if (names_criterion) settings::name_criterion(scene.grid);
  reader.finish();
}

}  // namespace

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
    if (cause.size() > 200) {
      std::size_t end = 200;
      while (end > 0 && continues_character(cause[end])) --end;
      cause = cause.substr(0, end) + "...";
    }
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
  if (is_config_file(scene.ocio.config)) find(scene.ocio.config);
  return scene;
}

SceneOptions load_scene(const std::string& path) {
  constexpr std::uintmax_t largest = 1 << 20;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (!error && size > largest) fail(path, "too large for a scene file");
  return parse_scene(image::read_file(path), path);
}

}  // namespace cumulet::demo
