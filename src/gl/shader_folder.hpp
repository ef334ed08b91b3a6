#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "base/file_path.hpp"

namespace cumulet::gl {

/// A folder like glsl/ whose files are reloaded when they change, for shader development.
class ShaderFolder {
 public:
  explicit ShaderFolder(FilePath folder) : folder_(std::move(folder)) {}
  /// Returns a shader (Shader::path) with its includes resolved, like cmake/embed_glsl.py. Throws Error(file).
  [[nodiscard]] std::string source(std::string_view path) const;
  [[nodiscard]] const std::string& given() const { return folder_.given(); }
  /// Whether a file was written since the previous check; false at the first call. Checks the folder a few times per
  /// second at most.
  bool changed();

 private:
  using Clock = std::chrono::steady_clock;
  FilePath folder_;
  std::optional<Clock::time_point> looked_;
  std::filesystem::file_time_type newest_{};
};

}  // namespace cumulet::gl
