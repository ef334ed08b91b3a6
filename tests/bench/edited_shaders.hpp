#pragma once

#include <filesystem>
#include <memory>
#include <span>

#include "support/folder.hpp"
#include "viewer/sharing.hpp"

namespace cumulet::bench {

/// A text in a shader and its replacement.
struct Edit {
  const char* file;
  const char* text;
  const char* instead;
};

/// Returns a source folder of the build, or the value of the environment variable if that is set. Benchmarks run on
/// machines without the sources (tests/gpu).
std::filesystem::path source_folder(const char* built, const char* variable);

/// Shader programs of glsl/ with a few replaced texts, for measuring variants without a switch in the library. The
/// object must live until all programs are compiled.
class EditedShaders {
 public:
  /// files: added beside those of glsl/. Throws std::runtime_error if a text is missing or not unique, and
  /// std::filesystem::filesystem_error.
  explicit EditedShaders(std::span<const Edit> edits, std::span<const std::filesystem::path> files = {});

  [[nodiscard]] std::shared_ptr<viewer::Sharing> programs() const { return programs_; }

 private:
  test::Folder folder_;
  std::shared_ptr<viewer::Sharing> programs_;
};

}  // namespace cumulet::bench
