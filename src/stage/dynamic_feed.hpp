#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "assets/live.hpp"
#include "jobs/live_builder.hpp"
#include "stage/volume_feed.hpp"

namespace cumulet::viewer {

/// States of a dynamic volume.
class DynamicFeed : public VolumeFeed {
 public:
  DynamicFeed(std::shared_ptr<Live> live, const std::optional<BuildSettings>& settings,
              std::shared_ptr<LiveBuilder> builder, const FeedContext& context);

  void request(const std::optional<BuildSettings>& settings) override;
  bool take_info() override { return false; }  // each state has its own
  Taken take(bool is_seen) override;
  [[nodiscard]] bool waits() const override { return waits_; }
  [[nodiscard]] bool is_due() const override { return false; }  // the builder is notified of states
  /// Metadata of all states if their bounds are known, else of the state taken last.
  [[nodiscard]] VolumeInfoPtr info() const override;
  [[nodiscard]] VolumeAssetPtr volume() const override;
  [[nodiscard]] const void* source() const override { return live_.get(); }
  [[nodiscard]] const Live& live() const { return *live_; }
  [[nodiscard]] std::shared_ptr<JobSource> jobs() const override { return builder_; }

  struct Status {
    std::uint64_t handed = 0;           ///< number of the newest submitted state; 0: none
    std::uint64_t ready = 0;            ///< number of the state taken last
    std::uint64_t drawn = 0;            ///< number of the displayed state
    std::uint64_t ready_count = 0;      ///< how many were taken
    std::uint64_t displayed_count = 0;  ///< how many of them were displayed
  };
  [[nodiscard]] Status status() const;
  /// Records the displayed state of this feed.
  void note_displayed(const scene::SequenceFrame& shown);

 private:
  std::shared_ptr<Live> live_;
  std::shared_ptr<LiveBuilder> builder_;
  VolumeInfoPtr volume_info_;       // of all states, if their bounds are known
  bool waits_ = false;              // another state may be ready, but waits until the last one has been displayed
  std::uint64_t seen_last_ = 0;     // displayed last, as scene::SequenceFrame::taken
  Status counts_;                   // without `handed`
  std::shared_ptr<void> listener_;  // last: it notifies the builder
};

/// Returns the feed if it is that of a dynamic volume, else null.
[[nodiscard]] inline DynamicFeed* as_dynamic(const VolumeFeedPtr& feed) {
  return dynamic_cast<DynamicFeed*>(feed.get());
}

}  // namespace cumulet::viewer
