#pragma once

#include <string>

#include "base/file_path.hpp"
#include "light/environment.hpp"

namespace cumulet::light {

/// Reads a Radiance .hdr (radiance_file.hpp) or an OpenEXR picture (exr_file.hpp), which it recognizes by content; the
/// first half of a load's progress. Throws Error(file), one line with the path and the cause, and Error(cancelled).
EnvironmentPixels read_environment(const FilePath& path, Progress* progress = nullptr);
/// Reads it and makes an environment of it, the second half of a load's progress.
EnvironmentPtr open_environment(const FilePath& path, Progress* progress = nullptr);

}  // namespace cumulet::light
