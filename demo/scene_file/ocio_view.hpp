#pragma once

#include <string>

namespace cumulet::demo {

/// A view of an OpenColorIO configuration.
struct OcioView {
  std::string config = {};   ///< a file, or a name that OpenColorIO knows; empty: none
  std::string display = {};  ///< empty: the configuration's default
  std::string view = {};     ///< empty: the display's default
  std::string input = {};    ///< color space of linear Rec. 709 radiance; empty: found

  friend bool operator==(const OcioView&, const OcioView&) = default;
};

/// Returns true if the configuration is a file, and not a name with a scheme, such as "ocio://default".
[[nodiscard]] inline bool is_config_file(const std::string& config) { return config.find("://") == std::string::npos; }

}  // namespace cumulet::demo
