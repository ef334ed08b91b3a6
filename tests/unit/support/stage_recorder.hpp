#pragma once

// Records the decisions of a viewer without a GL context: its requests to workers, its scenes, flags, failures and
// messages.

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/folder.hpp"
#include "support/stage_text.hpp"

namespace cumulet::test {

/// Holds worker threads until they are released, so that a script can act while a job is running.
class Gate {
 public:
  /// Each thread that passes a text with this part waits for release().
  void hold(const std::string& part);
  /// May hold the calling thread.
  void pass(const std::string& text);
  /// Throws std::runtime_error if no thread is held after a minute.
  void wait_until_held();
  void release();

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<std::string> part_;
  bool held_ = false;
  std::uint64_t releases_ = 0;
};

/// A viewer whose steps are written down. Each step ends with the requests that it made and the logged messages.
///
/// The text must not depend on the time that workers take. A script therefore calls wait() or settle() before a step
/// that takes results, or holds the worker. The recorder does the rest:
///
/// - A list of requests that is sent again unchanged is written once. An empty list is not written, because it follows
///   each result that is taken.
/// - Requests of a wait are sorted by worker.
/// - Messages of workers are written by the next step that waits. They are sorted, and equal ones are written once.
class StageRecorder : private viewer::JobLog {
 public:
  StageRecorder();
  ~StageRecorder() override;
  StageRecorder(const StageRecorder&) = delete;
  StageRecorder& operator=(const StageRecorder&) = delete;

  [[nodiscard]] viewer::Viewer& viewer() { return *viewer_; }
  [[nodiscard]] Gate& gate() { return gate_; }
  /// Path of a file in the script's own folder.
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  [[nodiscard]] const std::string& text() const { return text_; }
  /// Ends the test without a comparison.
  void skip(std::string reason) { skipped_ = std::move(reason); }
  [[nodiscard]] const std::optional<std::string>& skipped() const { return skipped_; }

  // ---- steps ----

  /// Calls a function of the viewer or of a handle. An Error that it throws is written.
  void call(const std::string& name, const std::function<void()>& function);
  void load(const std::string& name, const std::function<void(viewer::VolumeFile&)>& change = {});
  void look(const glm::dvec3& eye, const glm::dvec3& target);
  /// Waits for all workers.
  void wait();
  /// Waits until jobs have ended, and takes no results.
  void settle();
  /// Waits until this many frames of a sequence are ready or failed. instance: follows the sequence; null: the viewer.
  void settle_frames(std::size_t count, const viewer::Instance* instance = nullptr);
  /// The next job that logs a message with this part is held. At the end of a piece of work the text is "ended NAME.".
  void hold(const std::string& part) { gate_.hold(part); }
  /// Waits until a job is held.
  void held();
  void release() { gate_.release(); }
  /// Writes a frame without GL (Viewer::dry_run): flags, and the changes of the scene and of the settings.
  void frame(const glm::uvec2& size = {64, 48}, double budget_ms = 10.0);

  /// Writes stage and failures; the failures count as reported.
  void status();
  /// Writes the volume, the bounds and the environment.
  void contents();
  void sequence(const viewer::Instance* instance = nullptr);
  /// Writes sequence() with the state of each frame, which must be settled or held.
  void frames(const viewer::Instance* instance = nullptr);
  /// Writes why a frame of a sequence cannot be shown.
  void frame_failure(std::uint32_t frame, const viewer::Instance* instance = nullptr);
  void states(const viewer::Instance* instance = nullptr);
  /// Writes the number of update callbacks since the last call.
  void updates();
  /// Waits for an update callback, then calls updates(). Throws std::runtime_error after a minute.
  void wait_for_update();

 private:
  void load_volume(const viewer::VolumeFile& file, const std::optional<viewer::BuildSettings>& settings,
                   const std::optional<viewer::BuildSettings>& proxy) override;
  void configure_volume(const std::optional<viewer::BuildSettings>& settings) override;
  void build_volume(const viewer::VolumeAssetPtr& volume, const viewer::BuildSettings& settings,
                    const scene::GridPlanPtr& before) override;
  void load_surfaces(const FilePath& path, const viewer::SurfaceChoice& choice) override;
  void configure_surfaces(const viewer::SurfaceChoice& choice) override;
  void pose_surfaces(const viewer::SurfaceAssetPtr& asset, const viewer::SurfaceChoice& choice) override;
  void load_environment(const FilePath& path) override;
  void make_sky(const light::Day& day) override;
  void request(const std::vector<viewer::GridRequest>& requests) override;
  void request(const std::vector<viewer::PoseRequest>& requests) override;
  void request(Player player, const viewer::FrameRequest& request) override;
  void follow_states(Player player, const std::shared_ptr<viewer::Live>& live,
                     const std::optional<viewer::BuildSettings>& settings) override;
  void configure_states(Player player, const std::optional<viewer::BuildSettings>& settings) override;
  void call(const char* worker, Player player, const char* function) override;

  void hear(LogLevel level, const std::string& message);
  static void end_of_work(void* user, const char* name, double begin, double end);
  void add(const std::string& worker, const std::string& text);
  // Adds a request that replaces the last one of the worker, unless they are equal.
  void replace(const std::string& worker, const std::string& text);
  void begin(const std::string& name);
  void write(const std::string& line);
  // waited: workers were waited for. The order of requests to different workers then depends on time.
  enum class Workers { running, waited };
  void end(Workers workers = Workers::running);
  void attempt(const std::function<void()>& function);
  void write_status();
  void write_scene(const scene::SnapshotPtr& scene);
  viewer::Viewer::SequenceStatus sequence_status(const viewer::Instance* instance);
  void write_sequence(const viewer::Viewer::SequenceStatus& status);
  // Replaces the folder and numbers of bytes, which differ between runs.
  [[nodiscard]] std::string clean(std::string text) const;

  Folder folder_;
  Gate gate_;
  StageText texts_;
  std::string text_;
  std::optional<std::string> skipped_;
  std::atomic<int> updates_ = 0;
  std::mutex heard_mutex_;
  std::vector<std::string> heard_;  // from the host's thread
  std::vector<std::string> heard_of_workers_;
  std::thread::id host_ = std::this_thread::get_id();
  std::vector<std::pair<std::string, std::string>> requests_;  // worker and text
  std::map<std::string, std::string> last_;                    // text of the last request of each worker
  scene::SnapshotPtr scene_;                                   // of the last frame
  std::map<std::string, std::string> shot_;                    // of the last frame
  std::unique_ptr<viewer::Viewer> viewer_;                     // last: its threads use the above
};

}  // namespace cumulet::test
