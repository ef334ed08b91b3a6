#pragma once

#include <cumulet/cumulet.h>

#include <headless.hpp>
#include <memory>
#include <scene_file.hpp>
#include <string>
#include <timeline.hpp>

#include "messages.hpp"
#include "progress.hpp"

namespace cumulet::demo {

struct DestroyViewer {
  void operator()(cumulet_viewer* viewer) const { cumulet_destroy(viewer); }
};
using Viewer = std::unique_ptr<cumulet_viewer, DestroyViewer>;

/// Creates a viewer in a context without a display. timeline: receives trace events, or null. shader_cache, shaders:
/// folders as for make_programs. Throws std::runtime_error.
[[nodiscard]] Viewer create_viewer(headless::Context& context, Messages& messages, Timeline* timeline,
                                   const std::string& shader_cache, const std::string& shaders);
/// Throws the error of a failed call.
void check(const Viewer& viewer, cumulet_status status);
/// Sets the camera of the scene.
void show_camera(const Viewer& viewer, const SceneOptions& scene);
/// Returns the viewer's volume, with a reference.
[[nodiscard]] std::shared_ptr<cumulet_volume> volume_of(const Viewer& viewer);
[[nodiscard]] cumulet_stats stats_of(const Viewer& viewer);
/// Returns the height of a ground plane below all objects. With models it is slightly lower, because many models
/// contain their own floor. Throws if the scene is empty.
[[nodiscard]] double ground_below(const Viewer& viewer, const SceneOptions& scene);
/// Returns vendor, renderer and version: other drivers may not give bit-identical images.
[[nodiscard]] std::string driver_of(const Viewer& viewer);

/// Prints a line on standard error.
void print_line(Progress& progress, const std::string& line);
/// Logs the suggested density scale, which does not depend on the camera. The volume was loaded with it.
void print_density_scale(const Viewer& viewer, bool ramped, Progress& progress);

/// Returns true if the medium may be chosen for the scene's volume, because no setting of it is given.
[[nodiscard]] bool sets_no_medium(const SceneOptions& scene);

/// Reads and shows a file that may hold fire or smoke, if the scene sets no medium. Returns false if it is to be loaded
/// as others are.
[[nodiscard]] bool show_by_default(const Viewer& viewer, const SceneOptions& scene,
                                   const cumulet_volume_file_desc& file);

}  // namespace cumulet::demo
