#pragma once

#include <cumulet/cumulet.h>

#include <optional>
#include <scene_file.hpp>
#include <string>

namespace cumulet::demo {

/// Content of a volume, by which its default medium is chosen.
enum class Content { cloud, smoke, fire };

/// Medium of a volume for which the scene sets none.
struct DefaultMedium {
  Content content = Content::cloud;
  cumulet_medium_desc medium{};  // of a cloud: the scene's
};

/// Returns true if all fields except the density scale have their default values.
[[nodiscard]] bool is_unsaid(const cumulet_medium_desc& medium);

/// Returns the kelvin of the temperature value 1, for a medium that does not set temperature_scale. Returns nullopt if
/// the volume has no temperature above 0.
[[nodiscard]] std::optional<float> temperature_scale_of(const cumulet_volume* volume);

/// Returns true if a grid of the file has the metadata that Mantaflow writes.
[[nodiscard]] bool is_of_mantaflow(const cumulet_inspection* inspection);

/// Returns the content of a file:
/// - fire: it has flames, or its maximum temperature is that of a flame;
/// - smoke: it has grids of a simulation of fire or smoke, or the metadata of Mantaflow;
/// - else cloud. Temperatures of air, such as those of a weather model, belong to clouds.
[[nodiscard]] Content content_of(cumulet_inspection* inspection);

/// Returns the default medium of a volume with the suggested density scale: that of demo::apply(Burning) for fire, the
/// preset "smoke" for smoke, unless the scene sets the albedo, and the scene's for a cloud. The content is that of
/// content_of, with temperatures scaled by the scene's medium. The scene's other settings are ignored.
/// scene: names the volume's file, or the sequence that it belongs to.
[[nodiscard]] DefaultMedium default_medium(const cumulet_volume* volume, const SceneVolume& scene);

/// Reads a file with grids of a simulation, and shows it in the viewer with default_medium. The medium is set before
/// the grid is built for it, so the grid is built once. file.log receives notes. Returns false and changes nothing if
/// the file has no such grids, and if the volume cannot be read or is empty, which loading through the viewer reports.
[[nodiscard]] bool show_by_default(cumulet_viewer* viewer, const cumulet_volume_file_desc& file,
                                   const SceneVolume& scene);

}  // namespace cumulet::demo
