#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "viewer/builder.hpp"
#include "viewer/live.hpp"

namespace cumulet::viewer {

/// Grids of a live volume's states, built on a thread of its own: of the newest, as soon as the one before was taken,
/// so that each that is begun can be shown, and none is built that nobody will see. All calls are safe from any thread.
class LiveBuilder {
 public:
  /// notify: called on the worker after each state, and when a job ended.
  LiveBuilder(Log log, std::function<void()> notify, Trace trace = {},
              AllowancePtr allowance = std::make_shared<const Allowance>())
      : log_(std::move(log)), allowance_(std::move(allowance)), worker_(std::move(notify), trace) {}

  /// Of this from now on; what there was goes. Null: of none.
  void follow(std::shared_ptr<Live> live, std::optional<BuildSettings> settings);
  /// Other settings; what is under way goes on. None: the next state waits for them.
  void configure(std::optional<BuildSettings> settings);
  /// Another state may be there.
  void look() noexcept;
  /// The newest is built anew.
  void rebuild();
  /// Ends what is under way until the next state or other settings.
  void cancel();

  struct Ready {
    Built built;
    std::uint64_t number = 0;  ///< of the state
  };
  /// What was built last, once; the next is begun.
  std::optional<Ready> take();

  /// Whether the newest state is to be built, is under way or waits to be taken.
  [[nodiscard]] bool busy() const;
  [[nodiscard]] Worker::Status status() const { return worker_.status(); }
  /// Until nothing is under way, at most until then. Returns whether it is so.
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const { return worker_.wait(until); }

 private:
  // The last that was, whatever came of it.
  struct Begun {
    std::uint64_t number = 0;
    BuildSettings settings;
  };
  // All of these under the lock.
  [[nodiscard]] bool is_due() const;
  void begin();
  // What is wanted of states in GL from now on; none: nothing.
  void wish(Live& live, const std::optional<scene::Emission>& wanted);
  // What a state in GL gives off may have been found by other settings: the same with these, until it is found by those
  // that are wanted; none: something of it was not made yet.
  std::optional<BuildSettings> settings_for(Live& live, const VolumeAsset& state, const BuildSettings& settings);
  // Of the first state that has any.
  void warn_of_huge(const VolumeAsset& state);
  // Returns whether the job is done: no newer state is there in place of one that failed.
  bool build(std::uint64_t job, Progress& progress);

  Log log_;
  AllowancePtr allowance_;
  mutable std::mutex mutex_;
  std::shared_ptr<Live> live_;
  std::optional<BuildSettings> settings_;
  Live::Wish wish_;  // of a state in GL
  std::optional<Begun> begun_;
  std::optional<std::uint64_t> job_;  // that is under way, or waits for the worker
  std::uint64_t last_job_ = 0;
  std::optional<Ready> ready_;
  bool huge_is_said_ = false;  // that some of live_'s voxels are huge
  Worker worker_;              // last: its thread uses all of the above
};

}  // namespace cumulet::viewer
