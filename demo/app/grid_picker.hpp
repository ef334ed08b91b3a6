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

/// A modal window that lists the grids of a file with their properties, and lets the user choose one. A worker thread
/// reads the file; grids are listed as they are read.
class GridPicker {
 public:
  /// wake: called from any thread when more grids are known.
  void open(const std::string& path, std::function<void()> wake);
  /// Draws the window if it is open. Adds Action::choose_grid when the user has chosen a grid.
  void draw(Ui& ui, std::vector<Command>& commands);
  [[nodiscard]] bool is_open() const { return open_; }

 private:
  struct Grid {
    std::string name;
    std::string type;     // for example "float, fog volume"
    std::string refusal;  // reason why the grid cannot be shown; "": it can
    std::uint64_t voxels = 0;
    float least = 0.0f;
    float most = 0.0f;
    std::vector<float> histogram;  // heights, 0 to 1
  };
  /// Worker thread that reads one file.
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
    std::thread thread_;  // last member: the thread uses those above
  };

  static bool draw_grid(Ui& ui, const Grid& grid);

  std::vector<std::unique_ptr<Reader>> readers_;  // the last one is displayed; the others are stopping
  std::string path_;
  bool opening_ = false;
  bool open_ = false;
};

}  // namespace cumulet::demo
