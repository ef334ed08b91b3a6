#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>

#include "base/error.hpp"

namespace cumulet::denoise {

/// Why the library cannot be used. The code is unsupported or out_of_memory.
class OidnError : public Error {
 public:
  using Error::Error;
};

/// No library with a usual name is installed.
class OidnMissing : public OidnError {
 public:
  using OidnError::OidnError;
};

/// Pixels of an image in main memory, row by row.
struct OidnImage {
  glm::uvec2 size{0U};
  std::span<const glm::vec4> color;   ///< radiance, linear Rec. 709; alpha is passed through
  std::span<const glm::vec4> albedo;  ///< 0 to 1, without noise
  std::span<const glm::vec4> normal;  ///< -1 to 1, without noise
};

/// Intel's Open Image Denoise, version 1.4 or later, loaded at run time. Not thread safe.
class OidnLibrary {
 public:
  /// Loads the library; "": by its usual names. Throws OidnError, also for a version that is too old, and OidnMissing
  /// for "" if none is installed. The process keeps the library, whose threads may outlive its use.
  explicit OidnLibrary(const std::string& file);

  /// Returns the version, such as "2.3.0".
  [[nodiscard]] std::string version() const;
  /// Denoises an image on the CPU, by all its threads. A pixel whose color is not finite is passed through and does not
  /// affect other pixels. Throws OidnError with the library's message.
  void denoise(const OidnImage& image, std::span<glm::vec4> result) const;

 private:
  struct Functions;
  struct Device;
  std::shared_ptr<const Device> device_;
};

using OidnLibraryPtr = std::shared_ptr<const OidnLibrary>;

}  // namespace cumulet::denoise
