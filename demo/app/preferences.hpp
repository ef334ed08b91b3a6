#pragma once

#include <cumulet/cumulet.h>

#include <string>
#include <vector>

namespace cumulet::demo {

inline constexpr float min_panel_width = 280.0f;
inline constexpr float max_panel_width = 480.0f;

/// Settings that the demo stores between runs.
struct Preferences {
  std::vector<std::string> recent;  // absolute paths, newest first
  std::string folder;               // folder of the last opened or saved file
  cumulet_navigation_style style = CUMULET_NAVIGATION_SIMPLE;
  int width = 1440;
  int height = 900;
  float panel_width = 372.0f;      // at user interface scale 1
  int scale_percent = 0;           // of the user interface; 0: as the screen
  bool auto_exposure = true;       // measure the exposure after each load
  bool desktop_dialogs = true;     // the desktop's file dialogs where it has some
  double autosave_seconds = 60.0;  // between two copies of unsaved changes

  /// Puts a file at the top of the recent files and stores its folder. Scenes do not displace other files, and vice
  /// versa.
  void remember(const std::string& path);
  /// Removes a file that cannot be opened from the recent files.
  void forget(const std::string& path);
};

/// Returns $XDG_CONFIG_HOME/cumulet/demo.json, or the same below ~/.config; "" if neither exists.
[[nodiscard]] std::string preferences_path();
/// Returns $XDG_STATE_HOME/cumulet, or the same below ~/.local/state; "" if neither exists.
[[nodiscard]] std::string recovery_folder();
/// Loads the preferences. A missing or damaged file gives the defaults, never an error.
[[nodiscard]] Preferences load_preferences(const std::string& path);
/// Saves the preferences; does nothing if path is "". Throws std::runtime_error, one line with the path and the cause.
void save_preferences(const Preferences& preferences, const std::string& path);

}  // namespace cumulet::demo
