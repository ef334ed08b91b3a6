#include "viewer/viewer.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "base/error.hpp"
#include "gl/state_guard.hpp"

namespace cumulet::viewer {

namespace {

using glm::dvec3;

class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - start_).count();
    start_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

struct CameraFrame {
  dvec3 forward, right, up;
};

CameraFrame frame_of(const Camera& camera) {
  const dvec3 forward = glm::normalize(camera.target - camera.eye);
  dvec3 right = glm::cross(forward, camera.up);
  // Looking along up: any right will do.
  if (glm::length(right) < 1e-9)
    right = glm::cross(forward, std::abs(forward.x) < 0.9 ? dvec3(1, 0, 0) : dvec3(0, 0, 1));
  right = glm::normalize(right);
  return {forward, right, glm::cross(right, forward)};
}

}  // namespace

Viewer::Viewer(void* (*get_proc)(void* user, const char* name), void* user, const Log& log)
    : log_(log), gl_(gl::load_functions(get_proc, user)), limits_(gl::query_limits(*gl_)), tracer_(gl_) {
  gl::check(*gl_, "reading the context's limits");
}

Viewer::~Viewer() = default;

void Viewer::load_volume(const std::filesystem::path& file, const std::string& grid_name) {
  Stopwatch watch;
  set_volume(volume::import_volume(file, grid_name, log_));
  seconds_.load = watch.lap();
}

void Viewer::set_volume(volume::ScalarVolume volume) {
  grid::fit_cube(volume);  // refuses what no cube can hold, before anything is given up
  volume_ = std::make_unique<const volume::ScalarVolume>(std::move(volume));
  statistics_.reset();
  seconds_ = {};
  data_stale_ = true;
}

void Viewer::set_grid(const GridSettings& settings) {
  grid_ = settings;
  data_stale_ = true;
}

void Viewer::set_medium(const Medium& medium) {
  medium_ = medium;
  picture_stale_ = true;
}

void Viewer::set_light(const Light& light) {
  light_ = light;
  picture_stale_ = true;
}

void Viewer::set_camera(const Camera& camera) {
  camera_ = camera;
  picture_stale_ = true;
  data_stale_ = data_stale_ || grid_.camera_adaptive;
}

void Viewer::set_image(const Image& image) {
  if (image.width < 1 || image.height < 1 || image.width > 16384 || image.height > 16384 ||
      static_cast<int>(std::max(image.width, image.height)) > limits_.texture_size_2d) {
    throw Error(ErrorCode::invalid_argument,
                "an image of " + std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels: 1 to " +
                    std::to_string(std::min(16384, limits_.texture_size_2d)) + " each way are possible");
  }
  image_ = image;
  picture_stale_ = true;
  data_stale_ = data_stale_ || grid_.camera_adaptive;
}

void Viewer::require_volume() const {
  if (!volume_) throw Error(ErrorCode::invalid_argument, "no volume is loaded");
}

void Viewer::build() {
  require_volume();
  if (!data_stale_) return;
  gl::clear_errors(*gl_);
  Stopwatch watch;
  if (!statistics_) {
    statistics_ = std::make_unique<const grid::Statistics>(*volume_, grid::fit_cube(*volume_));
    seconds_.statistics = watch.lap();
  }
  std::optional<render::MarchData> data;
  std::uint64_t cells = 0;
  std::uint32_t levels = 0;
  BuildSeconds seconds = seconds_;
  seconds.refine = seconds.records = 0.0;
  const gl::StateGuard guard(*gl_);
  if (grid_.march == render::March::tet) {
    grid::RefineSettings refine = grid_.refine;
    if (grid_.camera_adaptive) refine.camera = refine_camera();
    const auto diamonds = std::make_unique<const grid::DiamondSet>(*statistics_, refine);
    auto builder = std::make_unique<grid::GridBuilder>(*statistics_, *diamonds);
    builder->bisect();
    seconds.refine = watch.lap();
    const grid::TetGrid grid = builder->records(refine.cells, volume_->max_value);
    builder.reset();
    seconds.records = watch.lap();
    if (grid.limited) {
      log_.info("max_cells (" + std::to_string(refine.max_cells) + ") ended the refinement before the threshold");
    }
    cells = grid.cells.size();
    levels = grid.levels;
    data = render::MarchData::upload_tet(gl_, limits_, grid, refine.cells == grid::CellKind::linear, grid_.page_texels);
  } else if (grid_.march == render::March::dense) {
    data = render::MarchData::upload_dense(gl_, limits_, *statistics_, *volume_);
  } else {
    data = render::MarchData::upload_brick(gl_, limits_, *statistics_, *volume_);
  }
  gl_->Finish();
  seconds.upload = watch.lap();
  data_ = std::move(data);
  cells_ = cells;
  levels_ = levels;
  seconds_ = seconds;
  data_stale_ = false;
  picture_stale_ = true;
}

Bounds Viewer::bounds() const {
  Bounds bounds;
  if (!volume_) return bounds;
  for (int corner = 0; corner < 8; ++corner) {
    dvec3 p(volume_->bounds_min);
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] = ((corner >> axis) & 1) != 0 ? volume_->bounds_max[axis] + 0.5 : volume_->bounds_min[axis] - 0.5;
    }
    const dvec3 world(volume_->index_to_world * glm::dvec4(p, 1.0));
    bounds.min = corner == 0 ? world : glm::min(bounds.min, world);
    bounds.max = corner == 0 ? world : glm::max(bounds.max, world);
  }
  return bounds;
}

Camera Viewer::placed_camera() const {
  if (camera_.eye != camera_.target) return camera_;
  // As near as keeps all eight corners of the bounds in the picture, seen from +Z and a little above.
  const Bounds box = bounds();
  Camera camera = camera_;
  camera.target = 0.5 * (box.min + box.max);
  const dvec3 back = glm::normalize(dvec3(0.0, 0.2, 1.0));
  camera.eye = camera.target + back;
  const CameraFrame frame = frame_of(camera);
  const double tan_y = std::tan(0.5 * radians(camera.fovy_degrees));
  const double tan_x = image_.height > 0 ? tan_y * image_.width / image_.height : tan_y;
  double distance = 1e-30;
  for (int corner = 0; corner < 8; ++corner) {
    const dvec3 p((corner & 1) != 0 ? box.max.x : box.min.x, (corner & 2) != 0 ? box.max.y : box.min.y,
                  (corner & 4) != 0 ? box.max.z : box.min.z);
    const dvec3 q = p - camera.target;
    const double wide = std::max(std::abs(glm::dot(q, frame.right)) / tan_x, std::abs(glm::dot(q, frame.up)) / tan_y);
    distance = std::max(distance, glm::dot(q, back) + wide);
  }
  camera.eye = camera.target + back * distance;
  return camera;
}

std::optional<grid::RefineCamera> Viewer::refine_camera() const {
  if (image_.width == 0)
    throw Error(ErrorCode::invalid_argument, "a camera-adaptive grid needs the image's size first");
  const Camera camera = placed_camera();
  const CameraFrame frame = frame_of(camera);
  grid::RefineCamera refine;
  refine.eye = camera.eye;
  refine.forward = frame.forward;
  refine.right = frame.right;
  refine.up = frame.up;
  refine.tan_half_y = std::tan(0.5 * radians(camera.fovy_degrees));
  refine.tan_half_x = refine.tan_half_y * image_.width / image_.height;
  refine.pixels_per_radian = image_.height / (2.0 * refine.tan_half_y);
  return refine;
}

core::CmParameters Viewer::parameters() const {
  const Camera camera = placed_camera();
  const CameraFrame frame = frame_of(camera);
  const glm::dmat4 to_cube = glm::inverse(statistics_->cube().to_world);
  const glm::dmat3 linear(to_cube);
  const double tan_y = std::tan(0.5 * radians(camera.fovy_degrees));
  const double tan_x = tan_y * image_.width / image_.height;
  const auto direction = [](const dvec3& v) { return glm::vec4(glm::vec3(v), 0.0F); };
  core::CmParameters p{};
  p.eye = glm::vec4(glm::vec3(to_cube * glm::dvec4(camera.eye, 1.0)), 1.0F);
  p.forward = direction(frame.forward);
  p.right = direction(frame.right * tan_x);
  p.up = direction(frame.up * tan_y);
  p.to_cube_x = direction(linear[0]);
  p.to_cube_y = direction(linear[1]);
  p.to_cube_z = direction(linear[2]);
  const double azimuth = radians(light_.sun_azimuth_degrees);
  const double elevation = radians(light_.sun_elevation_degrees);
  const dvec3 sun(std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                  std::cos(azimuth) * std::cos(elevation));
  p.sun_world = direction(sun);
  p.sun_cube = direction(linear * sun);
  p.sun_irradiance = glm::vec4(light_.sun_irradiance, 0.0F);
  p.sky_radiance = glm::vec4(light_.sky_radiance, 0.0F);
  p.albedo = glm::vec4(medium_.albedo, 1.0F);
  // Half of the sky's share of the light: its escaping paths sample it as well.
  const auto luminance = [](const glm::vec3& c) { return 0.2126F * c.x + 0.7152F * c.y + 0.0722F * c.z; };
  const float sun_power = luminance(light_.sun_irradiance);
  const float sky_power = 4.0F * std::numbers::pi_v<float> * luminance(light_.sky_radiance);
  const float to_sky = sun_power > 0.0F ? 0.5F * sky_power / (sky_power + sun_power) : (sky_power > 0.0F ? 1.0F : 0.0F);
  p.medium = {static_cast<float>(std::min(1e30, medium_.density_scale * std::max(volume_->max_value, 1e-30F))),
              medium_.anisotropy, to_sky, sun_power + sky_power > 0.0F ? 1.0F : 0.0F};
  p.image = {image_.width, image_.height, image_.seed, std::max(1U, image_.samples)};
  p.march = {0U, medium_.max_bounces, 0U, 0U};
  return p;
}

bool Viewer::render(double budget_ms, double& progress) {
  build();
  if (image_.width == 0) throw Error(ErrorCode::invalid_argument, "no image size is set");
  gl::clear_errors(*gl_);
  const gl::StateGuard guard(*gl_);
  Stopwatch watch;
  if (picture_stale_) {
    tracer_.begin(*data_, parameters(), image_.view);
    picture_stale_ = false;
    trace_seconds_ = 0.0;
    watch.lap();  // compiling and clearing is not tracing
  }
  const bool done = tracer_.trace(*data_, budget_ms);
  trace_seconds_ += watch.lap();
  progress = tracer_.progress();
  return done;
}

void Viewer::read(float* rgba, std::size_t count) const {
  if (tracer_.width() == 0) throw Error(ErrorCode::invalid_argument, "nothing has been rendered yet");
  const std::size_t needed = std::size_t{tracer_.width()} * tracer_.height() * 4;
  if (rgba == nullptr || count < needed) {
    throw Error(ErrorCode::invalid_argument, "the picture needs " + std::to_string(needed) + " floats");
  }
  gl::clear_errors(*gl_);
  const gl::StateGuard guard(*gl_);
  tracer_.read(rgba);
  totals_ = tracer_.totals();
}

render::Totals Viewer::totals() const { return totals_; }

}  // namespace cumulet::viewer
