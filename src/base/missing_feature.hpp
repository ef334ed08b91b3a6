#pragma once

#include <string>

namespace cumulet {

/// Returns the cause of an error for a file that needs a feature which this build was configured without. option: the
/// CMake option of the feature.
inline std::string missing_feature(const std::string& what, const char* option) {
  return what + ", which this build of Cumulet does not read (" + option + "=OFF)";
}

}  // namespace cumulet
