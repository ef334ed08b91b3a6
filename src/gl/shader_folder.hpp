#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "base/file_path.hpp"

namespace cumulet::gl {

/// Whether this build takes shaders from a folder: debug builds do.
#ifdef NDEBUG
inline constexpr bool reloads_shaders = false;
#else
inline constexpr bool reloads_shaders = true;
#endif

/// A folder like glsl/ whose files are read anew when they change, for whoever works on them.
class ShaderFolder {
 public:
  explicit ShaderFolder(FilePath folder) : folder_(std::move(folder)) {}
  /// A shader with its includes, as cmake/embed_glsl.py has it. Throws Error(file).
  [[nodiscard]] std::string source(const std::string& name) const;
  /// Whether a file was written since this was last asked; not the first time. Looks a few times a second at most.
  bool changed();

 private:
  using Clock = std::chrono::steady_clock;
  FilePath folder_;
  std::optional<Clock::time_point> looked_;
  std::filesystem::file_time_type newest_{};
};

}  // namespace cumulet::gl
