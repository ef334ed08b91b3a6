#include "render_viewer.hpp"

#include <array>
#include <cstdio>
#include <program.hpp>
#include <shader_cache.hpp>
#include <stdexcept>

#include "default_medium.hpp"
#include "transforms.hpp"

namespace cumulet::demo {

Viewer create_viewer(headless::Context& context, Messages& messages, Timeline* timeline,
                     const std::string& shader_cache, const std::string& shaders) {
  cumulet_create_desc desc{};
  desc.struct_size = sizeof desc;
  desc.get_proc = headless::Context::get_proc;
  desc.get_proc_user = &context;
  desc.log = Messages::print;
  desc.log_user = &messages;
  if (timeline != nullptr) {
    desc.trace = Timeline::add;
    desc.trace_user = timeline;
  }
  const auto programs = make_programs(shader_cache, shaders);
  desc.shader_cache = programs.get();
  cumulet_viewer* viewer = nullptr;
  std::array<char, 1024> error{};
  if (cumulet_create(&desc, &viewer, error.data(), error.size()) != CUMULET_OK)
    throw std::runtime_error(std::string(context.name()) + ": " + error.data());
  return Viewer(viewer);
}

void check(const Viewer& viewer, cumulet_status status) {
  if (status == CUMULET_OK) return;
  const std::string cause = cumulet_last_error(viewer.get());
  throw std::runtime_error(cause.empty() ? "status " + std::to_string(status) : cause);
}

void show_camera(const Viewer& viewer, const SceneOptions& scene) {
  cumulet_camera* camera = nullptr;
  check(viewer, cumulet_get_camera(viewer.get(), &camera));
  const cumulet_status status = set_camera(camera, scene);
  cumulet_camera_release(camera);
  if (status != CUMULET_OK) throw std::runtime_error("the camera is invalid");
}

std::shared_ptr<cumulet_volume> volume_of(const Viewer& viewer) {
  cumulet_volume* volume = nullptr;
  check(viewer, cumulet_get_volume(viewer.get(), &volume));
  return {volume, cumulet_volume_release};
}

double ground_below(const Viewer& viewer, const SceneOptions& scene) {
  std::array<double, 3> least{};
  std::array<double, 3> most{};
  check(viewer, cumulet_get_bounds(viewer.get(), least.data(), most.data()));
  const double size = std::hypot(most[0] - least[0], most[1] - least[1], most[2] - least[2]);
  return least[1] - (scene.surfaces.empty() && scene.models.empty() ? 0.0 : 1e-4 * size);
}

cumulet_stats stats_of(const Viewer& viewer) {
  cumulet_stats stats{};
  stats.struct_size = sizeof stats;
  check(viewer, cumulet_get_stats(viewer.get(), &stats));
  return stats;
}

std::string driver_of(const Viewer& viewer) {
  const cumulet_stats stats = stats_of(viewer);
  return std::string(stats.gl_vendor) + ", " + stats.gl_renderer + ", " + stats.gl_version;
}

void print_line(Progress& progress, const std::string& line) {
  progress.clear();
  std::fprintf(stderr, "%s\n", one_line(line).c_str());
}

void print_density_scale(const Viewer& viewer, bool ramped, Progress& progress) {
  double scale = 0.0;
  if (cumulet_volume_suggest_density_scale(volume_of(viewer).get(), &scale) != CUMULET_OK) return;  // nothing visible
  std::array<char, 32> digits{};
  std::snprintf(digits.data(), digits.size(), "%g", scale);
  print_line(progress, std::string("density scale ") + digits.data() + " for a mean optical depth of 8" +
                           (ramped ? " before the ramp" : "") + " (--density-scale)");
}

bool sets_no_medium(const SceneOptions& scene) {
  return scene.is_shown() && scene.auto_density_scale && is_unsaid(scene.medium);
}

bool show_by_default(const Viewer& viewer, const SceneOptions& scene, const cumulet_volume_file_desc& file) {
  return sets_no_medium(scene) && show_by_default(viewer.get(), file, scene);
}

}  // namespace cumulet::demo
