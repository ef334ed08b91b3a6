#pragma once

#include <filesystem>
#include <memory>
#include <span>

#include "support/folder.hpp"
#include "viewer/sharing.hpp"

namespace cumulet::bench {

/// A text of a shader, and what stands there instead.
struct Edit {
  const char* file;
  const char* text;
  const char* instead;
};

/// Programs of glsl/ with a few texts changed: so are techniques measured that the library has no switch for. For as
/// long as programs are made.
class EditedShaders {
 public:
  /// files: stand beside those of glsl/. Throws std::runtime_error where a text is not there, or more than once, and
  /// std::filesystem::filesystem_error.
  explicit EditedShaders(std::span<const Edit> edits, std::span<const std::filesystem::path> files = {});

  [[nodiscard]] std::shared_ptr<viewer::Sharing> programs() const { return programs_; }

 private:
  test::Folder folder_;
  std::shared_ptr<viewer::Sharing> programs_;
};

}  // namespace cumulet::bench
