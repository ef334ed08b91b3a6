#include "preferences.hpp"

#include <algorithm>
#include <array>
#include <exception>
#include <file.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <program.hpp>
#include <settings.hpp>
#include <stdexcept>
#include <system_error>

namespace cumulet::demo {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr std::size_t most_recent = 10;
constexpr int min_side = 320;
constexpr int max_side = 16384;
constexpr double min_autosave = 1.0;
constexpr double max_autosave = 3600.0;

std::string absolute(const std::string& path) {
  std::error_code error;
  const fs::path there = fs::absolute(fs::path(path), error).lexically_normal();
  // A folder of slices may have a slash at its end.
  return error ? "" : (there.has_filename() ? there : there.parent_path()).string();
}

bool is_scene(const std::string& path) { return fs::path(path).extension() == ".json"; }

}  // namespace

void Preferences::remember(const std::string& path) {
  const std::string text = absolute(path);
  if (text.empty()) return;
  std::erase(recent, text);
  recent.insert(recent.begin(), text);
  std::size_t scenes = 0;
  std::size_t others = 0;
  std::erase_if(recent, [&](const std::string& file) { return ++(is_scene(file) ? scenes : others) > most_recent; });
  folder = fs::path(text).parent_path().string();
}

void Preferences::forget(const std::string& path) { std::erase(recent, absolute(path)); }

std::string preferences_path() {
  const std::string folder = user_folder("XDG_CONFIG_HOME", ".config");
  return folder.empty() ? "" : folder + "/cumulet/demo.json";
}

std::string recovery_folder() {
  const std::string folder = user_folder("XDG_STATE_HOME", ".local/state");
  return folder.empty() ? "" : folder + "/cumulet";
}

Preferences load_preferences(const std::string& path) {
  Preferences preferences;
  try {
    const Json json = Json::parse(image::read_file(path));
    if (const auto recent = json.find("recent"); recent != json.end())
      for (const Json& file : *recent)
        if (file.is_string() && preferences.recent.size() < 2 * most_recent) preferences.recent.push_back(file);
    preferences.folder = json.value("folder", preferences.folder);
    const std::string style = json.value("navigation", std::string());
    for (const auto& choice : settings::navigation_choices)
      if (style == choice.name) preferences.style = static_cast<cumulet_navigation_style>(choice.value);
    preferences.width = std::clamp(json.value("width", preferences.width), min_side, max_side);
    preferences.panel_width =
        std::clamp(json.value("panel_width", preferences.panel_width), min_panel_width, max_panel_width);
    const int percent = json.value("scale_percent", preferences.scale_percent);
    preferences.scale_percent = percent == 0 ? 0 : std::clamp(percent, 100, 200);
    preferences.auto_exposure = json.value("auto_exposure", preferences.auto_exposure);
    preferences.desktop_dialogs = json.value("desktop_dialogs", preferences.desktop_dialogs);
    preferences.autosave_seconds =
        std::clamp(json.value("autosave_seconds", preferences.autosave_seconds), min_autosave, max_autosave);
    preferences.height = std::clamp(json.value("height", preferences.height), min_side, max_side);
  } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): a first run, or nothing worth a complaint
  }
  return preferences;
}

void save_preferences(const Preferences& preferences, const std::string& path) {
  if (path.empty()) return;
  Json json;
  json["recent"] = preferences.recent;
  json["folder"] = preferences.folder;
  for (const auto& choice : settings::navigation_choices)
    if (choice.value == preferences.style) json["navigation"] = choice.name;
  json["width"] = preferences.width;
  json["height"] = preferences.height;
  json["panel_width"] = preferences.panel_width;
  json["scale_percent"] = preferences.scale_percent;
  json["auto_exposure"] = preferences.auto_exposure;
  json["desktop_dialogs"] = preferences.desktop_dialogs;
  json["autosave_seconds"] = preferences.autosave_seconds;
  std::error_code error;
  fs::create_directories(fs::path(path).parent_path(), error);
  if (error) throw std::runtime_error(path + ": " + error.message());
  image::replace_file(path, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace cumulet::demo
