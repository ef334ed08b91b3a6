#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "model.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// A small modal window with the grids of a file, what is in each, and one to be chosen. The file is read in a thread
/// of its own: what is known is shown.
class GridPicker {
 public:
  /// wake is called from any thread when more is known.
  void open(const std::string& path, std::function<void()> wake);
  /// Draws it, if it is open, and adds Action::choose_grid once the user has chosen.
  void draw(Ui& ui, std::vector<Command>& commands);
  [[nodiscard]] bool is_open() const { return open_; }

 private:
  struct Grid {
    std::string name;
    std::string type;     // "float, fog volume"
    std::string refusal;  // "": can be shown
    std::uint64_t voxels = 0;
    float least = 0.0f;
    float most = 0.0f;
    std::vector<float> histogram;  // heights from 0 to 1
  };
  /// Reads one file.
  class Reader {
   public:
    Reader(std::string path, std::function<void()> wake);
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;
    ~Reader();
    struct Found {
      std::vector<Grid> grids;
      std::string trouble;
      bool all = false;
    };
    [[nodiscard]] Found found() const;
    void stop() { stop_ = true; }

   private:
    void read();
    std::string path_;
    std::function<void()> wake_;
    mutable std::mutex mutex_;
    Found found_;
    std::atomic<bool> stop_ = false;
    std::thread thread_;  // last: it uses the above
  };

  static bool draw_grid(Ui& ui, const Grid& grid);

  std::vector<std::unique_ptr<Reader>> readers_;  // the last is shown; those before are coming to their end
  std::string path_;
  bool opening_ = false;
  bool open_ = false;
};

}  // namespace cumulet::demo
