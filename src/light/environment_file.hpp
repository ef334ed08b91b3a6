#pragma once

#include <string>

#include "base/byte_source.hpp"
#include "base/file_path.hpp"
#include "light/environment.hpp"

namespace cumulet::light {

/// Reads a Radiance .hdr (radiance_file.hpp) or OpenEXR image (exr_file.hpp), recognized by its content. Reports the
/// first half of a load's progress. Throws Error(file), one line with the path and the cause, and Error(cancelled).
EnvironmentPixels read_environment(const FilePath& path, Progress* progress = nullptr);
/// Calls read_environment() and make_environment(); the latter reports the second half of a load's progress.
EnvironmentPtr open_environment(const FilePath& path, Progress* progress = nullptr);
/// Like open_environment(), for the content of a file. name: prefix of every message.
EnvironmentPtr read_environment_content(ByteSource& content, const std::string& name);

}  // namespace cumulet::light
