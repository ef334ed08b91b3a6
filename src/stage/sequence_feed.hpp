#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "assets/sequence.hpp"
#include "jobs/frame_cache.hpp"
#include "jobs/resource_limits.hpp"
#include "stage/volume_feed.hpp"

namespace cumulet::viewer {

/// Frames of a sequence.
class SequenceFeed : public VolumeFeed {
 public:
  /// Media of the viewer's own volume may use the density scale that is suggested for the sequence.
  enum class Suggestion { used_if_asked, ignored };

  SequenceFeed(std::shared_ptr<Sequence> sequence, const std::optional<BuildSettings>& settings,
               std::shared_ptr<FrameCache> cache, Suggestion suggestion, ResourceLimitsPtr resource_limits,
               const FeedContext& context);

  void request(const std::optional<BuildSettings>& settings) override;
  /// The request is sent again by the next take(), because memory limits have changed.
  void renew_request() { request_due_ = true; }
  /// Takes the result of the analysis.
  bool take_info() override;
  Taken take(bool is_seen) override;
  [[nodiscard]] bool waits() const override { return take_due_; }
  [[nodiscard]] bool is_due() const override {
    return !cache_->is_final_taken() && (request_due_ || cache_->revision() != cache_revision_);
  }
  [[nodiscard]] VolumeInfoPtr info() const override { return volume_info_; }
  [[nodiscard]] VolumeAssetPtr volume() const override { return volume_; }
  [[nodiscard]] const void* source() const override { return sequence_.get(); }
  [[nodiscard]] std::shared_ptr<JobSource> jobs() const override { return cache_; }

  [[nodiscard]] const Sequence& sequence() const { return *sequence_; }
  [[nodiscard]] const FrameCache& cache() const { return *cache_; }

  struct Status {
    std::uint32_t asked = 0;          ///< the current frame of its clock
    double requested_position = 0.0;  ///< the current step, in frames
    std::optional<double> drawn;      ///< the step that is displayed, in frames
    FrameCache::Status frames;
    std::optional<double> density_scale;  ///< suggested for all frames
  };
  /// shown: the displayed frame of this feed; nullopt: none.
  [[nodiscard]] Status status(const std::optional<scene::SequenceFrame>& shown) const;

 private:
  void send_request();

  std::shared_ptr<Sequence> sequence_;
  std::shared_ptr<FrameCache> cache_;
  Suggestion suggestion_;
  ResourceLimitsPtr resource_limits_;
  std::shared_ptr<void> listener_;
  std::uint64_t revision_ = 0;  // of the last request
  SequenceState state_;
  VolumeInfoPtr volume_info_;
  std::optional<double> density_scale_;  // for its status: result of its analysis
  VolumeAssetPtr volume_;
  bool request_due_ = true;
  std::uint64_t cache_revision_ = 0;  // revision of the cache when it was last checked
  bool take_due_ = false;
};

/// Returns the feed if it is that of a sequence, else null.
[[nodiscard]] inline SequenceFeed* as_sequence(const VolumeFeedPtr& feed) {
  return dynamic_cast<SequenceFeed*>(feed.get());
}

}  // namespace cumulet::viewer
