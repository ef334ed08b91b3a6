#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "child_process.hpp"

namespace cumulet::demo {

/// A sample scene of cumulet-scene.
struct Sample {
  const char* label;
  const char* tip;
  const char* scene;         // name of its scene file
  std::string_view picture;  // content of a PNG file, 256 x 128
};
[[nodiscard]] const std::array<Sample, 2>& samples();

/// Writes the files of the sample scenes once, by the program cumulet-scene. All calls from one thread.
class SampleFiles {
 public:
  /// program: path of cumulet-scene; folder: of the files. "" for either one: there are no samples.
  SampleFiles(std::string program, std::string folder);
  SampleFiles(const SampleFiles&) = delete;
  SampleFiles& operator=(const SampleFiles&) = delete;

  [[nodiscard]] bool exist() const { return !program_.empty() && !folder_.empty(); }
  [[nodiscard]] bool writes() const { return process_.has_value(); }
  /// Requests a scene. Throws std::runtime_error, one line, if the program cannot be started.
  void request(const std::string& scene);
  /// Returns the path of the requested scene once, when its files are complete. Call it repeatedly. Throws
  /// std::runtime_error, one line, if the program has failed.
  [[nodiscard]] std::optional<std::string> take();

 private:
  [[nodiscard]] bool are_complete() const;
  // Returns true if the program has ended.
  bool has_ended();

  std::string program_;
  std::string folder_;
  std::string wanted_;                   // name of the requested scene; "": none
  std::optional<ChildProcess> process_;  // nullopt: does not run
};

/// Returns the path of cumulet-scene, in the folder of this program; "" if it is not there.
[[nodiscard]] std::string sample_program();
/// Returns the folder of the sample scenes for the user; "" if there is none.
[[nodiscard]] std::string sample_folder();

}  // namespace cumulet::demo
