#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "base/log.hpp"
#include "base/progress.hpp"
#include "grid/refine.hpp"
#include "render/march_data.hpp"
#include "viewer/volume_asset.hpp"

namespace cumulet::viewer {

/// What a march is made with.
struct BuildSettings {
  render::March march = render::March::tet;
  grid::RefineSettings refine;
};

struct BuildSeconds {
  double load = 0.0;
  double statistics = 0.0;
  double refine = 0.0;
  double records = 0.0;
  double upload = 0.0;
};

/// A march's data in main memory, ready for any context.
struct Built {
  VolumePtr volume;
  std::shared_ptr<const render::MarchSource> source;
  std::uint64_t cells = 0;
  std::uint32_t levels = 0;
  bool limited = false;
  BuildSeconds seconds;
};

/// Loads volumes and builds what marches need on a thread of its own, one job at a time; the newest wish wins. All
/// calls are safe from any thread.
class Builder {
 public:
  struct Status {
    Progress::Stage stage = Progress::Stage::idle;
    double fraction = 0.0;
    std::optional<ErrorCode> error;  // how the last job ended
    std::string message;
  };

  /// notify: called on the worker after a job ended.
  Builder(Log log, std::function<void()> notify);
  /// Cancels and waits.
  ~Builder();
  Builder(const Builder&) = delete;
  Builder& operator=(const Builder&) = delete;

  /// Reads a file; then builds, unless settings are not known yet. Replaces what is under way.
  void load(std::string path, std::string grid_name, std::optional<BuildSettings> settings);
  /// Builds of this volume. Replaces what is under way.
  void build(VolumePtr volume, const BuildSettings& settings);
  /// Other settings for a load under way. Returns false if there is none: then call build.
  bool configure_load(const std::optional<BuildSettings>& settings);
  void cancel();

  /// The newest volume that was read, once.
  std::optional<VolumePtr> take_loaded();
  /// The newest result, once.
  std::optional<Built> take_built();

  /// Whether there is work under way, or a result that nobody took.
  [[nodiscard]] bool busy() const;
  [[nodiscard]] Status status() const;
  /// Until idle, at most until then. Returns whether it is.
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const;

 private:
  struct Job {
    std::string path;  // empty: build only
    std::string grid_name;
    VolumePtr volume;
    std::optional<BuildSettings> settings;
  };
  void post(Job job);
  void run();
  void work(const Job& job, Progress& progress);
  Built make(const VolumePtr& volume, const BuildSettings& settings, Progress& progress) const;

  Log log_;
  std::function<void()> notify_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::optional<Job> next_;
  std::shared_ptr<Progress> current_;  // of the job under way
  bool loading_ = false;               // its settings are still open: load_settings_
  std::optional<BuildSettings> load_settings_;
  bool stopping_ = false;
  std::optional<VolumePtr> loaded_;
  std::optional<Built> built_;
  std::optional<ErrorCode> error_;
  std::string message_;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace cumulet::viewer
