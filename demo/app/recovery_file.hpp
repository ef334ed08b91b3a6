#pragma once

#include <optional>
#include <scene_file.hpp>
#include <string>

namespace cumulet::demo {

/// A copy of the unsaved scene, which remains if the program is killed. Each running program has its own file, a scene
/// file. A lock file beside it names the scene file that was open, and is locked until the process ends.
class RecoveryFile {
 public:
  /// Takes a file that an ended process has left, or else an unused one. folder: created if it is missing; "": no
  /// recovery file.
  explicit RecoveryFile(std::string folder);
  RecoveryFile(const RecoveryFile&) = delete;
  RecoveryFile& operator=(const RecoveryFile&) = delete;
  ~RecoveryFile();

  /// A scene that an ended process has left.
  struct Left {
    std::string path;        // of the copy
    std::string scene_path;  // of the scene file that was open; "": none
  };
  /// Returns the scene of an ended process, until take_over().
  [[nodiscard]] const std::optional<Left>& left() const { return left_; }
  /// The scene of the ended process becomes this program's: write() replaces it, and remove() removes it.
  void take_over() { left_.reset(); }

  /// Replaces the copy. Keeps a scene of an ended process, for which it uses another file. Throws std::runtime_error,
  /// one line.
  void write(const SceneOptions& scene, const std::string& scene_path);
  /// Removes the copy, but not a scene of an ended process.
  void remove() const;

 private:
  // Locks a file that has a copy, or one that has none. Returns false if there is no such file.
  bool lock(bool with_copy);
  void unlock();

  std::string folder_;
  std::string path_;
  std::optional<int> lock_;  // descriptor of the lock file; nullopt: there is no recovery file
  std::optional<Left> left_;
};

}  // namespace cumulet::demo
