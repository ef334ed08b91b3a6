#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "base/file_path.hpp"
#include "base/log.hpp"
#include "base/progress.hpp"
#include "viewer/surface_asset.hpp"
#include "viewer/worker.hpp"

namespace cumulet::viewer {

/// What there is to show.
struct PosedModel {
  SurfaceAssetPtr asset;  ///< if it was read from a file, which
  scene::ModelSourcePtr source;
};

/// Reads glTF scenes and poses them on a thread of its own. The newest wish wins, and none starves, as Builder has it.
/// All calls are safe from any thread.
class SurfaceBuilder {
 public:
  /// notify: called on the worker after a job ended.
  SurfaceBuilder(Log log, std::function<void()> notify, Trace trace = {}, AllowancePtr allowance = nullptr)
      : log_(std::move(log)), worker_(std::move(notify), trace, std::move(allowance)) {}

  /// Reads a file, then poses it. Replaces what is under way, as Worker::replace() does.
  void load(const FilePath& path, SurfaceChoice choice);
  /// Another choice for a load under way. Returns false if there is none: then take what it made, and call pose.
  bool configure_load(SurfaceChoice choice);
  /// Poses a scene, after the pose under way: a pose that takes long is shown before the next.
  void pose(SurfaceAssetPtr asset, SurfaceChoice choice);
  void cancel();
  /// Loads alone: other surfaces are there.
  void cancel_loads();
  /// How the last job ended is reported no more.
  void forget_failure() { worker_.forget_failure(); }
  /// The newest result, once.
  std::optional<PosedModel> take();
  /// Whether there is work under way, or a result that nobody took.
  [[nodiscard]] bool busy() const;
  [[nodiscard]] Worker::Status status() const { return worker_.status(); }
  /// Until idle, at most until then. Returns whether it is.
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const { return worker_.wait(until); }

 private:
  // What a load will be posed at: open until it is.
  struct Load {
    SurfaceChoice choice;
    bool open = true;
  };
  void read(const FilePath& path, Load& load, Progress& progress);

  Log log_;
  mutable std::mutex mutex_;
  std::weak_ptr<Load> load_;  // held by its job
  std::optional<PosedModel> result_;
  Worker worker_;  // last: its thread uses all of the above
};

}  // namespace cumulet::viewer
