#pragma once

#include <cumulet/cumulet.h>

#include <cstddef>
#include <cstdint>
#include <frame_row.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <scene_file.hpp>
#include <vector>

#include "default_medium.hpp"

namespace cumulet::demo {

/// An opened volume and the medium settings derived from it. For a sequence, they are derived from the largest readable
/// file.
struct OpenVolume {
  std::shared_ptr<cumulet_volume> volume;  // null for a sequence
  std::optional<FrameRow> row;             // files of a sequence
  double density_scale = 0.0;              // suggested scale; 0: the volume shows nothing at any scale
  DefaultMedium look;                      // of a scene that sets no medium
};

/// Analyzes a volume of this file. Any thread; takes some milliseconds per million voxels.
[[nodiscard]] OpenVolume look_into(std::shared_ptr<cumulet_volume> volume, const VolumeFile& file);
/// Opens a file, or the first readable frame of a sequence, in any thread. Logs the notes and warnings of a file, and
/// the files that a sequence passes over; frames log when they are played. Throws std::runtime_error with the library's
/// cause.
/// see: called with the volume that the settings are derived from.
[[nodiscard]] OpenVolume open_volume(const VolumeFile& file, cumulet_log_fn log, void* log_user,
                                     const std::function<void(const cumulet_volume&)>& see = {});
/// Returns the medium that a volume is shown with: the scene's. If the scene does not set the density scale, it is
/// taken from the volume, or the whole medium is its default medium.
[[nodiscard]] cumulet_medium_desc medium_of(const SceneVolume& scene, const OpenVolume& open);
/// Creates a sequence with one file per frame. `file`: how all files are read; its path is ignored. memory_bytes: 0 is
/// the library's default. Reads nothing yet. Throws std::runtime_error with the library's error text.
[[nodiscard]] std::shared_ptr<cumulet_sequence> open_sequence(const std::vector<std::string>& files,
                                                              const cumulet_volume_file_desc& file,
                                                              std::uint64_t memory_bytes = 0);

/// A viewer's instances of the scene's further volumes (SceneOptions::others): one instance per transform. Sequences
/// with the same files and the same playback settings share their frames. Call from the viewer's thread.
class Instances {
 public:
  /// Returns the files of visible volumes that have not been given yet, each once. If the viewer itself shows a file,
  /// pass that volume to give(): both then share one grid.
  [[nodiscard]] std::vector<VolumeFile> missing(const std::vector<SceneVolume>& volumes) const;
  /// Provides a file's volume. An empty OpenVolume means that the file cannot be opened; it is not requested again
  /// while a scene names it.
  void give(const VolumeFile& file, OpenVolume volume);
  /// Returns a file's volume, or null if it was not given.
  [[nodiscard]] cumulet_volume* volume(const VolumeFile& file) const;
  /// Shows the given volumes and drops files that the scene no longer names. Throws std::runtime_error with the
  /// library's error text.
  void show(cumulet_viewer* viewer, const std::vector<SceneVolume>& volumes);
  /// Sets all sequences to this time of the scene's clock. Before the first call each shows the scene's own frame.
  void go_to(double seconds);
  /// Returns true if at least one sequence is shown.
  [[nodiscard]] bool plays() const { return !playing_.empty(); }

  /// Index of a volume in SceneOptions::others, and index of one of its transforms.
  struct Indices {
    std::size_t volume = 0;
    std::size_t transform = 0;
  };
  /// Returns the volume and transform of a displayed instance by its tag.
  [[nodiscard]] std::optional<Indices> find_tag(std::uint64_t tag) const;

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
    std::shared_ptr<cumulet_volume> volume;      // keeps desc.volume alive
    std::shared_ptr<cumulet_sequence> sequence;  // keeps desc.sequence alive
    cumulet_medium_desc medium{};                // the value of desc.medium
    decltype(SceneVolume::ramps) ramps;
    decltype(SceneVolume::color_ramps) color_ramps;
    settings::Clip clip;
    Indices indices;
  };

  [[nodiscard]] const Given* find(const VolumeFile& file) const;
  // Returns the sequence with these files and playback settings; creates it if there is none.
  std::shared_ptr<cumulet_sequence> sequence_of(const SceneVolume& scene, const FrameRow& row);

  std::vector<Given> given_;
  std::vector<Playing> playing_;
  std::optional<double> seconds_;  // time of the scene's clock
  std::vector<Shown> shown_;
};

}  // namespace cumulet::demo
