#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "assets/live.hpp"
#include "jobs/built.hpp"
#include "jobs/job_source.hpp"

namespace cumulet::viewer {

/// Builds grids of a dynamic volume's states on a worker thread. It builds the newest state as soon as the previous
/// grid was taken, so that every grid that is built can be displayed. All calls are thread-safe.
class LiveBuilder : public JobSource {
 public:
  explicit LiveBuilder(const JobContext& context)
      : JobSource(context),
        log_(context.log),
        resource_limits_(context.resource_limits),
        worker_(context.notify, context.trace) {}

  /// Follows this volume instead of the previous one; null: none.
  void follow(std::shared_ptr<Live> live, std::optional<BuildSettings> settings);
  /// Changes the settings; a running build continues. Nullopt: the next state waits for settings.
  void configure(std::optional<BuildSettings> settings);
  /// Starts a build if there is a newer state.
  void look() noexcept;
  /// Rebuilds the newest state.
  void rebuild() override;
  /// Ends running work until the next state or other settings.
  void cancel() override;

  struct Ready {
    Built built;
    std::uint64_t number = 0;  ///< of the state
  };
  /// Returns the newest result, once, and starts the next build.
  std::optional<Ready> take();

  /// True if the newest state is due, is being built or has not been taken.
  [[nodiscard]] bool busy() const override;
  [[nodiscard]] Worker::Status status() const override { return worker_.status(); }
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const override { return worker_.wait(until); }
  void set_awaited(bool awaited) override { worker_.set_awaited(awaited); }

 private:
  // State and settings of the last build, successful or not.
  struct Begun {
    std::uint64_t number = 0;
    BuildSettings settings;
  };
  // mutex_ must be held for all of these.
  [[nodiscard]] bool is_due() const;
  void begin();
  // Sets the emission requested of GPU-resident states; nullopt: none.
  void request(Live& live, const std::optional<scene::Emission>& wanted);
  // Returns the settings to build a state with. The emission of a GPU-resident state may exist for other settings;
  // these are used until that for the requested ones exists. Nullopt: required data does not exist yet.
  std::optional<BuildSettings> settings_for(Live& live, const VolumeAsset& state, const BuildSettings& settings);
  // Logs a warning for the first state with values beyond 1e30.
  void warn_of_huge(const VolumeAsset& state);
  // Returns true if the job is done, false to try again because a newer state followed a failed one.
  bool build(std::uint64_t job, Progress& progress);

  Log log_;
  ResourceLimitsPtr resource_limits_;
  mutable std::mutex mutex_;
  std::shared_ptr<Live> live_;
  std::optional<BuildSettings> settings_;
  Live::Request request_;  // emission request for GPU-resident states
  std::optional<Begun> begun_;
  std::optional<std::uint64_t> job_;  // running or queued
  std::uint64_t last_job_ = 0;
  std::optional<Ready> ready_;
  bool huge_is_said_ = false;  // the warning about values beyond 1e30 was logged
  Worker worker_;              // last: its thread uses all of the above
};

}  // namespace cumulet::viewer
