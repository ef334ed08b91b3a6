#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>

#include "base/log.hpp"
#include "gl/objects.hpp"
#include "grid/statistics.hpp"
#include "grid/tet_grid.hpp"
#include "render/march_data.hpp"
#include "render/tracer.hpp"
#include "volume/volume.hpp"

namespace cumulet::viewer {

struct GridSettings {
  render::March march = render::March::tet;
  grid::RefineSettings refine;  // camera is filled from the viewer's
  bool camera_adaptive = false;
  std::int64_t page_texels = 0;  // 0: the driver's limit; tests make pages smaller
};

struct Medium {
  double density_scale = 1.0;
  glm::vec3 albedo{1.0F};
  float anisotropy = 0.0F;
  std::uint32_t max_bounces = 0;
};

struct Light {
  float sun_azimuth_degrees = 0.0F;
  float sun_elevation_degrees = 0.0F;
  glm::vec3 sun_irradiance{0.0F};
  glm::vec3 sky_radiance{0.0F};
};

struct Camera {
  glm::dvec3 eye{0.0};
  glm::dvec3 target{0.0};  // eye == target: fit the volume's bounds
  glm::dvec3 up{0.0, 1.0, 0.0};
  double fovy_degrees = 40.0;
};

struct Image {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t samples = 64;
  std::uint32_t seed = 0;
  render::View view = render::View::shaded;
};

struct BuildSeconds {
  double load = 0.0;
  double statistics = 0.0;
  double refine = 0.0;
  double records = 0.0;
  double upload = 0.0;
};

struct Bounds {
  glm::dvec3 min{0.0};
  glm::dvec3 max{0.0};
};

/// The facade behind the C ABI: settings in, picture out. Rebuilds what a change makes out of date, and nothing else.
/// Threads and GL state as cumulet.h says. Throws Error; a call that throws leaves the viewer as it was.
class Viewer {
 public:
  Viewer(void* (*get_proc)(void* user, const char* name), void* user, const Log& log);
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  void load_volume(const std::filesystem::path& file, const std::string& grid_name);
  void set_volume(volume::ScalarVolume volume);
  void set_grid(const GridSettings& settings);
  void set_medium(const Medium& medium);
  void set_light(const Light& light);
  void set_camera(const Camera& camera);
  void set_image(const Image& image);

  void build();
  /// Whether every pixel has its samples.
  bool render(double budget_ms, double& progress);
  void read(float* rgba, std::size_t count) const;

  [[nodiscard]] const BuildSeconds& build_seconds() const { return seconds_; }
  [[nodiscard]] double trace_seconds() const { return trace_seconds_; }
  [[nodiscard]] render::Totals totals() const;
  [[nodiscard]] std::uint64_t cells() const { return cells_; }
  [[nodiscard]] std::uint32_t levels() const { return levels_; }
  [[nodiscard]] std::uint64_t cell_bytes() const { return data_ ? data_->bytes() : 0; }
  [[nodiscard]] std::uint64_t active_voxels() const { return volume_ ? volume_->active_voxels : 0; }
  [[nodiscard]] Bounds bounds() const;
  [[nodiscard]] const gl::Functions& gl() const { return *gl_; }
  /// What the shaders were told of the picture under way.
  [[nodiscard]] const core::CmParameters& trace_parameters() const { return tracer_.parameters(); }

 private:
  [[nodiscard]] Camera placed_camera() const;
  [[nodiscard]] core::CmParameters parameters() const;
  [[nodiscard]] std::optional<grid::RefineCamera> refine_camera() const;
  void require_volume() const;

  Log log_;
  gl::FunctionsPtr gl_;
  gl::Limits limits_;

  GridSettings grid_;
  Medium medium_;
  Light light_;
  Camera camera_;
  Image image_;

  std::unique_ptr<const volume::ScalarVolume> volume_;
  std::unique_ptr<const grid::Statistics> statistics_;
  std::optional<render::MarchData> data_;
  render::Tracer tracer_;
  bool data_stale_ = true;
  bool picture_stale_ = true;

  std::uint64_t cells_ = 0;
  std::uint32_t levels_ = 0;
  BuildSeconds seconds_;
  double trace_seconds_ = 0.0;
  mutable render::Totals totals_;
};

}  // namespace cumulet::viewer
