#pragma once

#include <memory>
#include <optional>
#include <string>

#include "base/log.hpp"
#include "denoise/oidn_library.hpp"

namespace cumulet::denoise {

/// Keeps the library that was requested last, and that it cannot be used.
class OidnCache {
 public:
  /// Returns the library, or null if it cannot be used. Logs that once. instead: the denoiser that is used then.
  OidnLibraryPtr get(const std::string& file, const std::string& instead, const Log& log) {
    if (file_ == file) return library_;
    file_ = file;
    library_ = nullptr;
    try {
      library_ = std::make_shared<const OidnLibrary>(file);
      log.info("denoising by Open Image Denoise " + library_->version());
    } catch (const OidnMissing& error) {
      log.write(LogLevel::debug, text_of(error, instead));  // it need not be installed
    } catch (const OidnError& error) {
      log.warning(text_of(error, instead));
    }
    return library_;
  }
  /// Drops a library that has failed.
  void drop(const OidnError& error, const Log& log) {
    library_ = nullptr;
    log.warning(std::string("no longer denoising by the library of Open Image Denoise: ") + error.what());
  }

 private:
  static std::string text_of(const OidnError& error, const std::string& instead) {
    return std::string("not denoising by the library of Open Image Denoise but by ") + instead + ": " + error.what();
  }

  std::optional<std::string> file_;
  OidnLibraryPtr library_;
};

}  // namespace cumulet::denoise
