#pragma once

#include <cumulet/cumulet.h>

namespace cumulet::demo {

/// A file that the viewer loads on its worker threads: the volume, the surfaces or the environment. The scene has the
/// requested file. File: its name, or its name with options.
template <class File>
struct ViewerFile {
  File passed{};                         // passed to the viewer
  File shown{};                          // displayed
  bool loading = false;                  // the viewer loads the passed file
  cumulet_status reported = CUMULET_OK;  // reported result of the last job

  /// Returns true if the file is not the passed one, and records it as passed.
  [[nodiscard]] bool take(const File& file) {
    if (passed == file) return false;
    passed = file;
    return true;
  }
  /// Sets the displayed file again, in the scene too, after a failed load.
  void restore(File& file) { file = passed = shown; }
  /// Returns true if the result of a job is an error that is not reported yet. Rebuilding displayed content can fail
  /// too.
  [[nodiscard]] bool is_news(cumulet_status status) const {
    return status != reported && status != CUMULET_OK && status != CUMULET_ERROR_CANCELLED;
  }
  /// Records the result of the last job as reported. While the viewer is busy, only a success is final.
  void see(cumulet_status status, bool busy) {
    if (!busy || status == CUMULET_OK) reported = status;
  }
};

}  // namespace cumulet::demo
