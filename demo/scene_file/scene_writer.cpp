#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <file.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <program.hpp>
#include <settings.hpp>
#include <stdexcept>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>

#include "keys.hpp"
#include "matrix.hpp"
#include "names.hpp"
#include "scene_file.hpp"

// Writes scene files, and compares scenes by the text of their files.
namespace cumulet::demo {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;
using settings::Spelling;

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
    if (setting.zero != 0.0 && value == Value{}) return std::nullopt;
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
  void put_settings(const Desc& desc, const std::string& where = "", std::string_view left_out = "") {
    settings::for_each<Desc>([&](const auto& setting) {
      if (*setting.key == '\0' || setting.key == left_out) return;
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
    if (volume.clip.box) writer.put("volume.clip.box", *volume.clip.box);
    if (!volume.clip.planes.empty()) writer.put("volume.clip.planes", volume.clip.planes);
    if (!volume.visible) writer.put("volume.visible", false);
  }
  writer.put_text("medium.temperature_grid", volume.temperature_grid);
  writer.put_text("medium.flame_grid", volume.flame_grid);
  writer.put_text("medium.color_grid", volume.color_grid);
  writer.put_text("medium.anisotropy_grid", volume.anisotropy_grid);
  writer.put_text("medium.velocity_grid", volume.velocity_grid);
  const bool is_auto = volume.auto_density_scale && volume.medium.density_scale == 0.0;
  if (is_auto) writer.put("medium.density_scale", "auto");
  const bool left = is_auto && !volume.albedo_given && settings::all_zero(volume.medium.coalbedo);
  writer.put_settings(volume.medium, "", left ? "medium.albedo" : "");
  for (std::size_t i = 0; i < volume.ramps.size(); ++i) {
    Json points = Json::array();
    for (const auto& [value, result] : volume.ramps[i]) points.push_back({shortest(value), shortest(result)});
    if (!points.empty()) writer.put(settings::ramps[i].key, points);
    Json stops = Json::array();
    for (const auto& [value, red, green, blue] : volume.color_ramps[i])
      stops.push_back({shortest(value), shortest(red), shortest(green), shortest(blue)});
    if (!stops.empty()) writer.put(settings::color_ramps[i].key, stops);
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
  if (has_lists && !scene.ocio.config.empty()) {
    writer.put("display.ocio.config", is_config_file(scene.ocio.config) ? named(scene.ocio.config) : scene.ocio.config);
    writer.put_text("display.ocio.display", scene.ocio.display);
    writer.put_text("display.ocio.view", scene.ocio.view);
    writer.put_text("display.ocio.input", scene.ocio.input);
  }
  Json json = writer.take();
  if (settings::criterion_of(scene.grid) != scene.grid.criterion) json["grid"].erase("criterion");
  return json;
}

fs::path folder_of(const std::string& path) {
  std::error_code error;
  const fs::path absolute = fs::absolute(fs::path(path), error);
  return error ? fs::path(path).parent_path() : absolute.parent_path();
}

bool is_utf8(const std::string& text) {
  try {
    static_cast<void>(Json(text).dump());
    return true;
  } catch (const Json::type_error&) {
    return false;
  }
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

const NamedCamera* looked_through(const SceneOptions& scene) {
  const Json shown = camera_json(scene, SceneFormat::third);
  const auto found = std::ranges::find_if(
      scene.cameras, [&](const NamedCamera& camera) { return camera_json(camera, SceneFormat::third) == shown; });
  return found == scene.cameras.end() ? nullptr : &*found;
}

std::string scene_text(const SceneOptions& scene, const std::string& path, SceneFormat format) {
  // A file name may have any encoding: invalid UTF-8 is replaced instead of throwing. save_scene() refuses it.
  return to_json(scene, format, [&](const std::string& file) { return portable_file(file, path); })
             .dump(2, ' ', false, Json::error_handler_t::replace) +
         "\n";
}

void save_scene(const SceneOptions& scene, const std::string& path, SceneFormat format) {
  const auto checked = [&](const std::string& file) {
    std::string name = portable_file(file, path);
    if (!is_utf8(name)) throw std::runtime_error(path + ": cannot name " + name + ", because that is not UTF-8");
    return name;
  };
  static_cast<void>(to_json(scene, format, checked));
  image::replace_file(path, scene_text(scene, path, format));
}

bool same_scene(const SceneOptions& a, const SceneOptions& b) {
  const auto all = [](SceneOptions s) {
    s.sequence.frame.reset();
    return to_json(s, SceneFormat::third, [](const std::string& file) { return file; });
  };
  return all(a) == all(b);
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
