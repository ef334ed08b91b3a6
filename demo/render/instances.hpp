#pragma once

#include <cumulet/cumulet.h>

#include <cstddef>
#include <cstdint>
#include <frame_row.hpp>
#include <memory>
#include <optional>
#include <scene_file.hpp>
#include <vector>

namespace cumulet::demo {

/// A file's volume, and what it is shown with where a scene leaves that to it. Of a sequence that is of its largest
/// file.
struct OpenVolume {
  std::shared_ptr<cumulet_volume> volume;   // none of a sequence
  std::optional<FrameRow> row;              // its files
  double density_scale = 0.0;               // that suits it; 0: it shows nothing at any
  std::optional<cumulet_medium_desc> fire;  // of one that burns
};

/// In any thread, some milliseconds a million voxels.
[[nodiscard]] OpenVolume look_into(std::shared_ptr<cumulet_volume> volume);
/// Opens a file, or the first readable frame of a sequence, in any thread. Logs the notes and warnings of a file, and
/// the files that a sequence passes over; frames log when they are played. Throws std::runtime_error with the library's
/// cause.
[[nodiscard]] OpenVolume open_volume(const VolumeFile& file, cumulet_log_fn log, void* log_user);
/// Of a file a frame. file: what all of them are read as; its path is not looked at. memory_bytes: 0 is the library's
/// default. Reads nothing yet. Throws std::runtime_error with the library's cause.
[[nodiscard]] std::shared_ptr<cumulet_sequence> open_sequence(const std::vector<std::string>& files,
                                                              const cumulet_volume_file_desc& file,
                                                              std::uint64_t memory_bytes = 0);

/// A scene's further volumes (SceneOptions::others) in a viewer: an instance for each of their places. Those that are
/// sequences share their frames where the scene says the same of how they play. In the thread that has the viewer.
class Instances {
 public:
  /// The files of those to be shown that were not given yet, each once. One that the viewer shows itself is best given
  /// that volume: they share a grid.
  [[nodiscard]] std::vector<VolumeFile> missing(const std::vector<SceneVolume>& volumes) const;
  /// Without a volume: it cannot be had, and is not asked for again while a scene names it.
  void give(const VolumeFile& file, OpenVolume volume);
  /// A file's volume, if it was given.
  [[nodiscard]] cumulet_volume* volume(const VolumeFile& file) const;
  /// Shows those that were given, and forgets the files that are named no more. Throws std::runtime_error with the
  /// library's cause.
  void show(cumulet_viewer* viewer, const std::vector<SceneVolume>& volumes);
  /// Sequences go to this moment of the scene's clock; until then each stands where the scene says.
  void go_to(double seconds);
  /// Whether there is a sequence.
  [[nodiscard]] bool plays() const { return !playing_.empty(); }

  /// Which of the volumes an instance shows, and in which of its places.
  struct Placed {
    std::size_t volume = 0;
    std::size_t place = 0;
  };
  /// That of an instance that is shown, by the tag that it was given.
  [[nodiscard]] std::optional<Placed> find_tag(std::uint64_t tag) const;

 private:
  struct Given {
    VolumeFile file;
    OpenVolume volume;
  };
  struct Playing {
    VolumeFile file;
    SceneSequence as;
    std::shared_ptr<cumulet_sequence> sequence;
  };
  struct Shown {
    std::shared_ptr<cumulet_instance> instance;
    cumulet_instance_desc desc{};
    std::shared_ptr<cumulet_volume> volume;      // the descriptor's
    std::shared_ptr<cumulet_sequence> sequence;  // likewise
    cumulet_medium_desc medium{};                // likewise
    decltype(SceneVolume::ramps) ramps;
    Placed placed;
  };

  [[nodiscard]] const Given* find(const VolumeFile& file) const;
  // The one that plays so.
  std::shared_ptr<cumulet_sequence> sequence_of(const SceneVolume& scene, const FrameRow& row);

  std::vector<Given> given_;
  std::vector<Playing> playing_;
  std::optional<double> seconds_;  // of the clock
  std::vector<Shown> shown_;
};

}  // namespace cumulet::demo
