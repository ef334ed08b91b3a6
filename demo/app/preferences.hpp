#pragma once

#include <cumulet/cumulet.h>

#include <string>
#include <vector>

namespace cumulet::demo {

/// What the demo remembers from one run to the next.
struct Preferences {
  std::vector<std::string> recent;  // absolute paths, the newest first
  std::string folder;               // the last one a file was opened from or saved to
  cumulet_navigation_style style = CUMULET_NAVIGATION_SIMPLE;
  int width = 1440;
  int height = 900;

  /// Puts a file at the top of the recent ones, and remembers its folder.
  void remember(const std::string& path);
  /// Takes a file that cannot be opened from the recent ones.
  void forget(const std::string& path);
};

/// $XDG_CONFIG_HOME/cumulet/demo.json, or below ~/.config; "" if there is neither.
[[nodiscard]] std::string preferences_path();
/// What of the file can be read: a missing or damaged one gives the defaults, never an error.
[[nodiscard]] Preferences load_preferences(const std::string& path);
/// Throws std::runtime_error, one line with the path and the cause. Nothing if path is "".
void save_preferences(const Preferences& preferences, const std::string& path);

}  // namespace cumulet::demo
