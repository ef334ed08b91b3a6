#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "child_process.hpp"

namespace cumulet::demo {

/// Thumbnails of recent files. `cumulet-render --thumbnail` makes the missing ones in the background, one after
/// another, and they are kept in a folder until their files change; those of a scene also until the files that it uses
/// change. Of files that are not listed, the newest ones are kept. All calls from one thread.
class RecentThumbnails {
 public:
  static constexpr int side = 256;  // pixels

  /// program: path of cumulet-render; folder: of the thumbnails. "" for either one: there are no thumbnails.
  RecentThumbnails(std::string program, std::string folder);
  RecentThumbnails(const RecentThumbnails&) = delete;
  RecentThumbnails& operator=(const RecentThumbnails&) = delete;
  /// Ends the program if it runs.
  ~RecentThumbnails();

  /// Begins the next missing thumbnail of these files. Call it repeatedly. It checks once per second whether files have
  /// changed. now: in seconds. Returns true if thumbnails may have changed since the last call.
  bool follow(std::span<const std::string> files, double now);
  /// Ends the current thumbnail's rendering, for example because the user has opened a file. It is begun again later.
  void stop();
  [[nodiscard]] bool works() const { return making_.has_value(); }
  /// Returns the path of the file's thumbnail; "" if there is none yet.
  [[nodiscard]] std::string find(const std::string& file) const;

 private:
  struct Making {
    std::unique_ptr<ChildProcess> process;
    std::string file;
    std::string picture;     // complete when it has this name
    std::string unfinished;  // name until then
  };
  // Returns the path that the file's thumbnail has or gets; "" for a file that is missing or of another kind.
  [[nodiscard]] std::string path_for(const std::string& file) const;
  void begin(const std::string& file, const std::string& picture);
  // Takes the thumbnail of a program that has ended. Returns false if the program still runs.
  bool finish();
  // Removes the oldest thumbnails of files that are not listed.
  void remove_old() const;
  // Removes the unfinished thumbnails that killed programs have left.
  void remove_left() const;

  /// The files that a scene file in this state refers to.
  struct Scene {
    std::string state;
    std::vector<std::string> files;
  };

  std::string program_;
  std::string folder_;
  std::optional<Making> making_;
  std::vector<std::string> followed_;            // files of the last look
  double next_look_ = 0.0;                       // in seconds
  bool removed_left_ = false;                    // unfinished thumbnails of ended programs were removed
  mutable std::map<std::string, Scene> scenes_;  // by the name of the scene file; a cache
  std::map<std::string, std::string> failed_;    // file and the path of the thumbnail that could not be made
};

/// Returns the path of cumulet-render, in the folder of this program; "" if it is not there.
[[nodiscard]] std::string thumbnail_program();
/// Returns the folder of the thumbnails for the user; "" if there is none.
[[nodiscard]] std::string thumbnail_folder();

}  // namespace cumulet::demo
