#include "viewer/viewer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/callback_scope.hpp"
#include "base/error.hpp"
#include "base/milliseconds.hpp"
#include "gl/state_guard.hpp"
#include "render/display.hpp"
#include "render/light_choice.hpp"
#include "viewer/stopwatch.hpp"

namespace cumulet::viewer {

namespace {

using glm::dvec3;
using Clock = std::chrono::steady_clock;

// Of a frame's budget.
constexpr double most_of_drawing = 0.5;

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

dvec3 to_sun(const Light& light) {
  const double azimuth = radians(light.sun_azimuth_degrees);
  const double elevation = radians(light.sun_elevation_degrees);
  return {std::sin(azimuth) * std::cos(elevation), std::sin(elevation), std::cos(azimuth) * std::cos(elevation)};
}

render::Deadline deadline_after(double milliseconds) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(
                            std::chrono::duration<double, std::milli>(std::clamp(milliseconds, 0.0, 1e9)));
}

render::PictureTextures textures_of(const render::Picture& picture, const render::Picture* before,
                                    const render::HostDepth& host) {
  render::PictureTextures textures;
  textures.sum = picture.sum();
  textures.background = picture.background();
  textures.counts = picture.counts();
  textures.size = picture.size();
  textures.holes = picture.has_holes();
  textures.volume_z = picture.volume_z();
  textures.picture = picture.begun();
  textures.revision = picture.revision();
  if (before != nullptr) {
    textures.sum_before = before->sum();
    textures.background_before = before->background();
    textures.counts_before = before->counts();
  }
  if (picture.layered() == render::Layered::beneath) {
    textures.beneath = &picture.layers();
    textures.host_z = host.texture();
    textures.host_layers = host.layers();
  }
  return textures;
}

// A framebuffer of one context, for one call.
class TransientFramebuffer {
 public:
  TransientFramebuffer(const gl::Functions& gl, GLuint colour, GLuint depth) : gl_(&gl) {
    gl_->CreateFramebuffers(1, &name_);
    gl::label(gl, gl::Object::Kind::framebuffer, name_, "framebuffer of the target");
    gl_->NamedFramebufferTexture(name_, GL_COLOR_ATTACHMENT0, colour, 0);
    if (depth != 0) gl_->NamedFramebufferTexture(name_, GL_DEPTH_ATTACHMENT, depth, 0);
    gl::check(gl, "making the target's framebuffer");
  }
  ~TransientFramebuffer() { gl_->DeleteFramebuffers(1, &name_); }
  TransientFramebuffer(const TransientFramebuffer&) = delete;
  TransientFramebuffer& operator=(const TransientFramebuffer&) = delete;
  [[nodiscard]] GLuint name() const { return name_; }

 private:
  const gl::Functions* gl_;
  GLuint name_ = 0;
};

}  // namespace

Viewer::Gl::Gl(gl::FunctionsPtr gl, gl::ProgramPool& pool)
    : functions(std::move(gl)),
      group(functions),
      programs(pool.of_current(*functions)),
      limits(gl::query_limits(*functions)),
      progressive(functions, programs),
      compositor(functions, programs),
      host_depth(functions, programs) {
  strings = {gl::string_of(*functions, GL_VENDOR), gl::string_of(*functions, GL_RENDERER),
             gl::string_of(*functions, GL_VERSION)};
  gl::check(*functions, "reading the context's limits");
}

Viewer::Viewer(Log log, std::function<void()> update, bool restore_state, Trace trace,
               std::shared_ptr<gl::ProgramPool> programs)
    : log_(log),
      trace_(trace),
      update_(std::move(update)),
      restore_state_(restore_state),
      programs_(programs ? std::move(programs) : std::make_shared<gl::ProgramPool>()),
      builder_(
          log, [this] { notify(); }, trace),
      surface_builder_(
          log, [this] { notify(); }, trace) {
  set_camera(std::make_shared<Camera>());
}

Viewer::~Viewer() {
  // Without a context nothing can be deleted, and in a stranger's the names are of other objects.
  if (gl_ && !gl_->group.is_current()) context_lost();
}

// ---- context ----

Viewer::Gl& Viewer::gl() const {
  if (!gl_) throw Error(ErrorCode::detached, "the viewer is attached to no GL context");
  return *gl_;
}

void Viewer::attach(GetProc get_proc, void* user) {
  if (gl_) throw Error(ErrorCode::invalid_argument, "the viewer is attached to a GL context already");
  auto functions = gl::load_functions(get_proc, user);
  gl::clear_errors(*functions);
  gl_ = std::make_unique<Gl>(std::move(functions), *programs_);
  ++generation_;
  notify();
}

void Viewer::detach() {
  if (!gl_) return;
  const gl::FunctionsPtr functions = gl_->functions;
  if (gl::was_reset(*functions)) {
    context_lost();
    return;
  }
  gl_->group.require();
  gl_.reset();
  gl::clear_errors(*functions);
}

void Viewer::context_lost() {
  if (!gl_) return;
  gl_->functions->abandoned = true;
  const gl::ProgramsPtr programs = gl_->programs;
  gl_.reset();
  // Others may be attached to another context of the group.
  if (programs.use_count() == 1) programs->abandon();
}

template <class Body>
void Viewer::with_gl(Body&& body) {
  Gl& g = gl();
  const gl::FunctionsPtr functions = g.functions;
  try {
    gl::clear_errors(*functions);
    gl::check_reset(*functions);
    g.group.require();  // before anything is begun that could not be undone
    const gl::Programs::Turn turn(g.programs, log_);
    const gl::StateGuard guard(*functions, restore_state_);
    if (!g.knows_dispatches) {
      gl::find_out_dispatches(functions, *g.programs);
      g.knows_dispatches = true;
    }
    body(g);
  } catch (const Error& error) {
    // Whatever failed: in a lost context everything does.
    const bool lost = error.code() == ErrorCode::context_lost || gl::was_reset(*functions);
    if (lost) context_lost();
    if (lost && error.code() != ErrorCode::context_lost) throw Error(ErrorCode::context_lost, gl::reset_message);
    throw;
  }
  gl::clear_errors(*functions);
}

// ---- the host's callback ----

void Viewer::notify() {
  if (!update_ || update_pending_.exchange(true)) return;
  const CallbackScope inside;
  update_();
}

void Viewer::touch() {
  ++settings_revision_;
  notify();
}

// ---- volumes and building ----

void Viewer::sync() {
  if (auto loaded = builder_.take_loaded()) {
    volume_ = std::move(*loaded);
    built_view_.reset();
  }
  if (auto built = builder_.take_built()) {
    // A rebuild keeps what the load took.
    if (built->volume == built_.volume) {
      if (built->seconds.load == 0.0) built->seconds.load = built_.seconds.load;
      if (built->seconds.statistics == 0.0) built->seconds.statistics = built_.seconds.statistics;
    }
    built_ = std::move(*built);
  }
  if (auto surfaces = surface_builder_.take()) {
    if (surfaces->asset) surface_asset_ = std::move(surfaces->asset);
    surface_source_ = std::move(surfaces->source);
  }
}

std::optional<BuildSettings> Viewer::build_settings() const {
  BuildSettings settings = grid_.build;
  if (grid_.camera_adaptive) {
    if (!view_) return std::nullopt;  // the next frame asks
    settings.refine.camera = refine_camera();
  }
  return settings;
}

void Viewer::request_build() {
  const auto settings = grid_.camera_adaptive ? std::nullopt : build_settings();
  if (builder_.configure_load(settings)) return;
  sync();
  built_view_.reset();
  if (volume_ && settings) builder_.build(volume_, *settings);
}

void Viewer::load_volume(const VolumeFile& file) {
  sync();
  builder_.load(file, grid_.camera_adaptive ? std::nullopt : build_settings());
  touch();
}

void Viewer::set_volume(VolumePtr volume) {
  if (volume) {
    builder_.cancel_loads();  // builds go on: a host may set volumes faster than they build
  } else {
    builder_.cancel();
  }
  sync();
  volume_ = std::move(volume);
  built_view_.reset();
  if (!volume_) {
    built_ = {};
  } else if (!grid_.camera_adaptive) {
    builder_.build(volume_, grid_.build);
  }
  touch();
}

VolumePtr Viewer::volume() {
  sync();
  return volume_;
}

void Viewer::rebuild() {
  request_build();
  touch();
}

void Viewer::cancel() {
  builder_.cancel();
  surface_builder_.cancel();
}

void Viewer::load_surfaces(const std::string& path) {
  sync();
  surface_builder_.load(path, surface_settings_.choice);
  touch();
}

void Viewer::show_surfaces(SurfacePtr surfaces) {
  surface_builder_.cancel();
  sync();
  surface_asset_ = std::make_shared<const SurfaceAsset>(surfaces->scene, std::string());
  surface_source_ = std::move(surfaces);
  touch();
}

void Viewer::set_surfaces(SurfaceAssetPtr surfaces) {
  if (surfaces) {
    surface_builder_.cancel_loads();  // poses go on: a host may set surfaces faster than they are posed
  } else {
    surface_builder_.cancel();
  }
  sync();
  surface_asset_ = std::move(surfaces);
  if (surface_asset_) {
    surface_builder_.pose(surface_asset_, surface_settings_.choice);
  } else {
    surface_source_ = nullptr;
  }
  touch();
}

SurfaceAssetPtr Viewer::surfaces_asset() {
  sync();
  return surface_asset_;
}

void Viewer::set_surface_settings(const SurfaceSettings& settings) {
  if (settings.choice != surface_settings_.choice && !surface_builder_.configure_load(settings.choice)) {
    sync();
    if (surface_asset_) surface_builder_.pose(surface_asset_, settings.choice);
  }
  surface_settings_ = settings;
  touch();
}

void Viewer::use_surface_camera(std::size_t index) {
  sync();
  const std::size_t count = surface_source_ ? surface_source_->pose.cameras.size() : 0;
  if (index >= count) {
    throw Error(ErrorCode::invalid_argument,
                "there is no camera " + std::to_string(index) + ": the surfaces have " + std::to_string(count));
  }
  const surface::SceneCamera& seen = surface_source_->pose.cameras[index];
  const dvec3 eye(seen.to_world[3]);
  const dvec3 forward = -glm::normalize(dvec3(seen.to_world[2]));
  CameraPose pose = camera_->pose();
  pose.eye = eye;
  // What it looks at, to orbit about: as far as the middle of the scene.
  double distance = 1.0;
  if (const auto all = box()) {
    distance =
        std::max(glm::dot(0.5 * (all->min + all->max) - eye, forward), 1e-3 * glm::length(all->max - all->min) + 1e-12);
  }
  pose.target = eye + forward * distance;
  pose.up = glm::normalize(dvec3(seen.to_world[1]));
  pose.orthographic_height = seen.orthographic ? seen.height : 0.0;
  if (!seen.orthographic) pose.fovy_degrees = glm::degrees(seen.vertical_fov);
  pose.near_plane = seen.near_plane;
  pose.far_plane = seen.far_plane;
  camera_->set(pose);
}

void Viewer::wait(double timeout_ms) {
  std::optional<Clock::time_point> until;
  if (timeout_ms >= 0.0) until = deadline_after(timeout_ms);
  if (!builder_.wait(until) || !surface_builder_.wait(until)) throw Error(ErrorCode::timeout, "not ready in time");
  sync();
  if (const auto failure = surface_builder_.status().failure) throw Error(*failure);
  if (const auto failure = builder_.status().failure) throw Error(*failure);
}

Worker::Status Viewer::status() const {
  Worker::Status status = builder_.status();
  const double upload = upload_progress_.load(std::memory_order_relaxed);
  const Worker::Status surfaces = surface_builder_.status();
  if (!status.failure) status.failure = surfaces.failure;
  if (status.stage == Progress::Stage::idle) {
    status.stage = surfaces.stage;
    status.fraction = surfaces.fraction;
  }
  if (status.stage == Progress::Stage::idle && upload < 1.0) {
    status.stage = Progress::Stage::uploading;
    status.fraction = upload;
  }
  return status;
}

// ---- settings ----

void Viewer::set_grid(const GridSettings& settings) {
  grid_ = settings;
  request_build();
  touch();
}

void Viewer::set_medium(const Medium& medium) {
  medium_ = medium;
  touch();
}

void Viewer::set_light(const Light& light) {
  light_ = light;
  touch();
}

void Viewer::set_sampling(const Sampling& sampling) {
  sampling_ = sampling;
  touch();
}

void Viewer::set_display(const DisplaySettings& display) {
  display_ = display;
  touch();
}

void Viewer::set_camera(std::shared_ptr<Camera> camera) {
  camera_listener_.reset();
  camera_ = std::move(camera);
  camera_listener_ = camera_->listen([this] { notify(); });
  touch();
}

void Viewer::set_navigation(const NavigationSettings& settings) {
  navigation_.set(settings);
  touch();
}

bool Viewer::input(const InputEvent& event) {
  sync();
  const bool handled = navigation_.input(event, *camera_, frame_size_.x, frame_size_.y, subject());
  if (navigation_.moving()) notify();
  return handled;
}

void Viewer::frame_all() {
  static_cast<void>(bounds());  // there is something to fit
  camera_->fit(*subject(), frame_size_.y > 0 ? double(frame_size_.x) / frame_size_.y : 1.0);
}

std::optional<Bounds> Viewer::box() const {
  std::optional<Bounds> box;
  if (volume_ && !volume_->volume().empty()) box = volume_->bounds();
  if (surface_source_ && surface_source_->scene->triangle_count() > 0) {
    const surface::Pose& pose = surface_source_->pose;
    box = box ? Bounds{glm::min(box->min, pose.low), glm::max(box->max, pose.high)} : Bounds{pose.low, pose.high};
  }
  return box;
}

std::optional<Subject> Viewer::subject() const {
  const auto all = box();
  if (!all) return std::nullopt;
  Subject subject(*all);
  subject.reach = [this](const dvec3& direction, std::span<const dvec3> normals) {
    return seen_reach(direction, normals);
  };
  return subject;
}

std::vector<double> Viewer::seen_reach(const dvec3& direction, std::span<const dvec3> normals) const {
  std::vector<double> reach;
  const auto add = [&](const dvec3& p) {
    reach.resize(normals.size(), std::numeric_limits<double>::lowest());
    for (std::size_t i = 0; i < normals.size(); ++i) reach[i] = std::max(reach[i], glm::dot(p, normals[i]));
  };
  if (volume_) {
    for (const dvec3& p : volume_->coarse().visible(direction, medium_.density_scale)) add(p);
  }
  if (surface_source_) {
    for (const surface::PosedVertex& vertex : surface_source_->pose.vertices) add(vertex.position);
  }
  return reach;
}

Bounds Viewer::bounds() {
  sync();
  const auto all = box();
  if (!all) throw Error(ErrorCode::invalid_argument, "the viewer has nothing to show: no volume, no surfaces");
  return *all;
}

// ---- frames ----

grid::RefineCamera Viewer::refine_camera() const {
  const ViewFrame& view = *view_;
  grid::RefineCamera refine;
  refine.right = glm::normalize(view.right);
  refine.up = glm::normalize(view.up);
  refine.forward = glm::normalize(glm::cross(refine.up, refine.right));
  // Off axis: the frustum about the axis that holds the picture's.
  refine.tan_half_x = glm::length(view.right) + std::abs(glm::dot(view.forward, refine.right));
  refine.tan_half_y = glm::length(view.up) + std::abs(glm::dot(view.forward, refine.up));
  refine.eye = view.eye;
  refine.pixels_per_radian = frame_size_.y / (2.0 * glm::length(view.up));
  if (view.orthographic) {
    // A pinhole so far back that its rays are as good as parallel.
    const double back = 1e4 * glm::length(view.up);
    refine.eye -= back * refine.forward;
    refine.tan_half_x /= back;
    refine.tan_half_y /= back;
    refine.pixels_per_radian *= back;
  }
  return refine;
}

render::PictureParameters Viewer::parameters() const {
  const ViewFrame& view = *view_;
  const scene::MarchSource& source = *gl_->data.of();
  const bool full = surface_settings_.light == SurfaceLight::full;
  render::PictureParameters p;
  p.view.eye = glm::vec3(glm::inverse(source.cube.to_world) * glm::dvec4(view.eye, 1.0));
  p.view.orthographic = view.orthographic ? 1U : 0U;
  p.view.forward = glm::vec3(view.forward);
  p.view.right = glm::vec3(view.right);
  p.view.up = glm::vec3(view.up);
  p.view.size = frame_size_;
  p.medium.albedo = medium_.albedo;
  p.medium.extinction = static_cast<float>(std::min(1e30, medium_.density_scale * std::max(source.max_value, 1e-30F)));
  p.medium.source = medium_.emission;
  p.medium.anisotropy = medium_.anisotropy;
  p.lights = render::light_parameters({to_sun(light_), light_.sun_irradiance, light_.sky_radiance}, surfaces().met(),
                                      full && medium_.emission != glm::vec3(0.0F));
  p.integrator.seed = sampling_.seed;
  p.integrator.max_bounces = medium_.max_bounces;
  p.integrator.blurred_roughness = surface_settings_.indirect_roughness;
  p.integrator.light_among_surfaces = full ? 1U : 0U;
  return p;
}

void Viewer::prepare(const Frame& frame, render::Deadline deadline) {
  Gl& g = gl();
  sync();
  const auto now = Clock::now();
  const double since = std::chrono::duration<double>(now - last_frame_time_).count();
  last_frame_time_ = now;
  const auto box = this->box();
  navigation_.advance(std::min(since, 0.25), *camera_, box);

  // Where nothing is left, the last picture goes as well. What has no triangles is still a scene: of sky alone.
  const bool scene = volume_ || surface_source_;
  if (!scene) built_ = {};
  // Surfaces alone are surfaces in an empty volume.
  if (!volume_ && scene && !built_.source && !builder_.busy()) builder_.build(empty_volume(), grid_.build);

  frame_size_ = {static_cast<unsigned>(frame.viewport[2]), static_cast<unsigned>(frame.viewport[3])};
  view_.reset();
  // Without a scene the camera may wait for its bounds.
  if (frame_size_.x > 0 && frame_size_.y > 0 && scene)
    view_ = camera_->view(double(frame_size_.x) / frame_size_.y, subject());
  if (frame.budget_ms < 0.0) return;

  last_view_ = std::exchange(traced_view_, view_);
  if (grid_.camera_adaptive && view_ && volume_ && (view_ != built_view_ || frame_size_ != built_size_)) {
    const bool rests = !sampling_.preview || !built_view_ || view_ == last_view_;
    if (rests) {
      builder_.build(volume_, *build_settings());
      built_view_ = view_;
      built_size_ = frame_size_;
    }
  }
  upload_surfaces(g);
  upload(g, deadline);
  upload_raster(g);
}

void Viewer::upload_raster(Gl& g) {
  const bool wanted = sampling_.preview || surface_settings_.light == SurfaceLight::none;
  if (!wanted || !surface_source_) {
    g.raster.clear();
    return;
  }
  if (!g.raster.wants(surface_source_, settings_revision_)) return;
  // Paths that met triangles for want of it end at it from now on.
  if (!g.raster) ++surface_generation_;
  const bool same_scene = g.raster && g.raster.of()->scene == surface_source_->scene;
  std::optional<render::SurfaceRaster> last = g.raster.take();  // where this fails rays meet the triangles
  if (!same_scene) last.reset();
  g.raster.make(surface_source_, settings_revision_, [&] {
    render::SurfaceRaster raster = last ? *std::move(last) : render::SurfaceRaster(g.functions, g.programs);
    if (!same_scene) raster.set_scene(surface_source_->scene);
    raster.set_pose(surface_source_->pose);
    return raster;
  });
}

void Viewer::upload_surfaces(Gl& g) {
  if (!surface_source_) {
    if (!g.surfaces.empty()) ++surface_generation_;
    g.surfaces.clear();
    return;
  }
  if (!g.surfaces.wants(surface_source_, settings_revision_)) return;
  ++surface_generation_;
  std::optional<render::SurfaceData> last = g.surfaces.take();
  g.surfaces.make(surface_source_, settings_revision_, [&] {
    return render::SurfaceData(g.functions, g.limits, *surface_source_, last ? &*last : nullptr);
  });
}

void Viewer::upload(Gl& g, render::Deadline deadline) {
  if (!built_.source) {
    if (g.data) {
      g.progressive.reset();
      ++generation_;
    }
    g.data.clear();
    g.upload.reset();
  }
  // What is under way goes on to its end, though there may be something newer by now: that is next. Begun anew with
  // each, an upload that takes longer than a build would never end.
  while (g.upload || (built_.source && g.data.wants(built_.source, settings_revision_))) {
    Stopwatch watch;
    if (!g.upload) {
      g.upload = Upload{built_.source, settings_revision_, nullptr};
      built_.seconds.upload = 0.0;
    }
    const MarchSourcePtr of = g.upload->of;
    try {
      if (!g.upload->work)
        g.upload->work = std::make_unique<render::MarchUpload>(g.functions, g.limits, of, page_texels_);
      const bool done = g.upload->work->advance(deadline);
      if (of == built_.source) built_.seconds.upload += watch.lap();
      if (!done) break;
      g.data.put(of, g.upload->work->take());
      g.upload.reset();
      ++generation_;
    } catch (const Error&) {
      g.data.fail(of, g.upload->settings);
      g.upload.reset();
      throw;
    }
  }
  upload_progress_ = g.upload ? g.upload->work->progress() : 1.0;
}

VolumePtr Viewer::empty_volume() {
  if (!empty_volume_) {
    volume::ScalarVolume empty;
    empty.name = "nothing";
    empty.bounds_max = glm::ivec3(0);
    const dvec3 middle = 0.5 * (surface_source_->pose.low + surface_source_->pose.high);
    empty.index_to_world[3] = glm::dvec4(middle, 1.0);
    empty_volume_ = std::make_shared<const VolumeAsset>(std::move(empty));
  }
  return empty_volume_;
}

render::Surfaces Viewer::surfaces() const {
  const render::HostDepth& depth = gl_->host_depth;
  render::Surfaces surfaces;
  if (depth.texture() != 0) {
    surfaces.depth = depth.texture();
    surfaces.layers = depth.layers();
    surfaces.size = depth.size();
  }
  surfaces.scene = gl_->surfaces.get();
  surfaces.raster = gl_->raster.get();
  surfaces.traced = surface_settings_.light != SurfaceLight::none || surfaces.raster == nullptr;
  if (view_) surfaces.view = {view_->eye, view_->forward, view_->right, view_->up, view_->orthographic};
  surfaces.lighting = {glm::vec3(to_sun(light_)), light_.sun_irradiance, light_.sky_radiance};
  return surfaces;
}

void Viewer::trace(const Frame& frame, render::Deadline deadline) {
  Gl& g = gl();
  if (!view_) return;
  render::HostDepthInput input;
  input.source = frame.depth_source;
  input.name = frame.depth_name;
  input.viewport = frame.viewport;
  input.target_size = frame.size;
  input.flip_y = frame.depth_flip_y;
  input.orthographic = view_->orthographic;
  input.depth_a = view_->depth_a;
  input.depth_b = view_->depth_b;
  input.unchanged = frame.depth_unchanged && view_ == last_view_;
  if (g.host_depth.update(input)) ++surface_generation_;
  if (!g.data) return;
  render::PictureWish wish;
  const render::Surfaces met = surfaces();
  wish.content.parameters = parameters();
  wish.content.view = sampling_.view;
  wish.content.generation = generation_;
  wish.content.surface_generation = surface_generation_;
  wish.content.surfaces_traced = met.traced;
  wish.content.preview = sampling_.preview;
  wish.content.volume_alone = sampling_.volume_alone;
  wish.samples = std::max(1U, sampling_.samples);
  wish.depth = frame.write_depth;
  wish.held = navigation_.dragging();
  g.progressive.advance(wish, *g.data, met, deadline, frame.budget_ms);
}

std::uint64_t Viewer::TargetKind::bytes() const {
  const std::uint64_t colour = format == GL_RGBA32F ? 16 : (format == GL_RGBA16F ? 8 : 4);
  return std::uint64_t{size.x} * size.y * (colour + (depth ? 4 : 0));
}

void Viewer::make_target_textures(Gl& g, const Frame& frame) const {
  const TargetKind kind{frame.size, frame.format, frame.write_depth};
  TargetKind with_depth = kind;  // serves those without as well
  with_depth.depth = true;
  if (!g.target.wants(kind, settings_revision_) || (g.target && g.target.of() == with_depth)) return;
  g.target.make(kind, settings_revision_, [&] {
    const int width = static_cast<int>(kind.size.x);
    const int height = static_cast<int>(kind.size.y);
    TargetTextures made;
    made.colour = gl::make_texture_2d(g.functions, kind.format, width, height, "creating the target texture");
    if (kind.depth) {
      made.depth =
          gl::make_texture_2d(g.functions, GL_DEPTH_COMPONENT32F, width, height, "creating the target's depth");
    }
    return made;
  });
}

bool Viewer::draws(const Frame& frame) const {
  return frame.target != Target::none && frame_size_.x > 0 && frame_size_.y > 0;
}

// The surfaces need not wait for the volume.
void Viewer::draw_surfaces_alone(const Frame& frame) {
  Gl& g = gl();
  if (g.progressive.shown() != nullptr || !draws(frame)) return;
  render::Tracer& tracer = g.progressive.tracer();
  const bool able = g.raster && view_ && g.alone_failed != settings_revision_;
  if (g.empty.sum() == 0 || (!able && g.empty.layered() != render::Layered::no)) tracer.clear(g.empty);
  tracer.set_background(g.empty, light_.sky_radiance);
  if (!able || frame.budget_ms < 0.0) return;
  g.alone_failed = settings_revision_;  // unless it succeeds
  tracer.draw_layers(g.empty, surfaces(),
                     render::Progressive::quick_layers(tracer, frame_size_, frame.budget_ms, view_ == last_view_));
  g.alone_failed.reset();
}

void Viewer::draw(const Frame& frame, FrameResult& result) {
  Gl& g = gl();
  const render::Picture* shown = g.progressive.shown();
  if (shown != nullptr) result.size = shown->size();
  if (!draws(frame)) return;
  if (shown == nullptr) shown = &g.empty;
  const bool legend = shown->view() != render::View::shaded;
  render::Display display;
  display.exposure_stops = display_.exposure_stops;
  display.tone_map = display_.tone_map;
  display.legend = legend;
  display.transparent = display_.transparent;
  display.encoding = frame.encoding;
  render::FrameTarget target;
  target.framebuffer = frame.framebuffer;
  target.viewport = frame.viewport;
  target.flip_y = frame.flip_y;
  target.blend_over = frame.blend_over;
  target.write_depth = frame.write_depth && shown->volume_z() != 0;
  if (view_) {
    target.orthographic = view_->orthographic;
    target.depth_a = view_->depth_a;
    target.depth_b = view_->depth_b;
    target.reversed = view_->orthographic ? view_->depth_b < 0.0 : view_->depth_b > 0.0;
  }
  render::PictureTextures picture =
      textures_of(*shown, shown == &g.empty ? nullptr : g.progressive.before(), g.host_depth);
  picture.may_lag = !shown->done();
  if (frame.target == Target::framebuffer) {
    g.compositor.draw(picture, display, target);
    return;
  }
  make_target_textures(g, frame);
  if (!g.target) return;
  const glm::uvec2 size = g.target.of().size;
  target.viewport = size == frame.size ? frame.viewport : glm::ivec4(0, 0, size);
  const bool depth = frame.write_depth && g.target->depth;
  const TransientFramebuffer framebuffer(*g.functions, g.target->colour.name(), depth ? g.target->depth.name() : 0);
  constexpr std::array<float, 4> nothing{};
  g.functions->ClearNamedFramebufferfv(framebuffer.name(), GL_COLOR, 0, nothing.data());
  if (depth) {
    const float far = target.reversed ? 0.0F : 1.0F;
    g.functions->ClearNamedFramebufferfv(framebuffer.name(), GL_DEPTH, 0, &far);
    result.depth_texture = g.target->depth.name();
  }
  target.framebuffer = framebuffer.name();
  target.blend_over = false;
  g.compositor.draw(picture, display, target);
  result.texture = g.target->colour.name();
}

bool Viewer::shares_cores(const Gl& g) {
  return g.functions->dispatches_in_call && g.compositor.drawn() && !gl::Fence(g.functions).passed();
}

render::Deadline Viewer::deadline_of(const Gl& g, const Frame& frame, bool shares) {
  const double keep = shares ? g.reserve.of(frame.budget_ms) : 0.0;
  const double drawing =
      frame.target == Target::none ? 0.0 : std::min(g.compositor.expected_ms(), most_of_drawing * frame.budget_ms);
  return deadline_after(frame.budget_ms - keep - drawing);
}

FrameResult Viewer::render(const Frame& frame) {
  const Trace::Span frame_span(trace_, "frame");
  FrameResult result;
  std::optional<Error> failure;
  // Before anything new is seen, so that what comes later is told again.
  update_pending_ = false;
  with_gl([&](Gl& g) {
    // Each part does what it can: a failure is told once, after what there was has been drawn.
    const auto attempt = [&](const char* name, auto&& part) {
      const gl::DebugGroup group(*g.functions, name);
      const Trace::Span span(trace_, name);
      try {
        part();
      } catch (const Error& error) {
        if (error.code() == ErrorCode::context_lost) throw;
        gl::check_reset(*g.functions);
        if (!failure) failure = error;
        gl::clear_errors(*g.functions);
      }
    };
    const auto begun = Clock::now();
    const bool shares = shares_cores(g);
    const render::Deadline deadline = deadline_of(g, frame, shares);
    attempt("cumulet: upload", [&] { prepare(frame, deadline); });
    if (frame.budget_ms >= 0.0) attempt("cumulet: trace", [&] { trace(frame, deadline); });
    attempt("cumulet: surfaces alone", [&] { draw_surfaces_alone(frame); });
    attempt("cumulet: draw", [&] { draw(frame, result); });
    if (const render::Picture* shown = g.progressive.shown()) {
      const DrawnAs now{shown->revision(), shown->done(), shown->has_holes(), shown->volume_z()};
      if (draws(frame)) g.drawn = g.compositor.lags() ? std::nullopt : std::optional(now);
      result.undrawn = !draws(frame) && g.drawn != now;
    }
    if (shares && frame.budget_ms > 0.0) g.reserve.learn(frame.budget_ms, milliseconds(Clock::now() - begun));
    result.loading = builder_.busy() || surface_builder_.busy() || g.upload;
    const auto failed = [](const Worker::Status& status) {
      return status.failure && status.failure->code() != ErrorCode::cancelled;
    };
    result.failed = failed(builder_.status()) || failed(surface_builder_.status());
    const bool pending = g.host_depth.pending() || (draws(frame) && g.compositor.lags());
    result.converged = !result.loading && g.data && view_ && !pending && g.progressive.converged();
    const bool waits_to_build = grid_.camera_adaptive && view_ && view_ != built_view_;
    result.more =
        navigation_.moving() || g.upload || waits_to_build || (g.data && view_ && (pending || g.progressive.more()));
    result.progress = g.progressive.progress();
    result.preview = result.size != glm::uvec2(0U) && result.size != frame_size_;
  });
  if (failure) throw Error(*failure);
  return result;
}

Pick Viewer::pick(double x, double y) {
  Pick pick;
  with_gl([&](Gl& g) {
    if (!g.data || !view_ || !(x >= 0.0 && y >= 0.0 && x < frame_size_.x && y < frame_size_.y)) return;
    const glm::uvec2 pixel(static_cast<unsigned>(x), static_cast<unsigned>(y));
    const float z = g.progressive.tracer().pick(*g.data, parameters(), surfaces(), pixel);
    if (!(z > 0.0F)) return;
    const double right = 2.0 * (pixel.x + 0.5) / frame_size_.x - 1.0;
    const double up = 1.0 - 2.0 * (pixel.y + 0.5) / frame_size_.y;
    const dvec3 aside = right * view_->right + up * view_->up;
    const dvec3 origin = view_->orthographic ? view_->eye + aside : view_->eye;
    const dvec3 ray = view_->orthographic ? view_->forward : view_->forward + aside;
    pick = {true, origin + double(z) * ray, double(z) * glm::length(ray)};
  });
  return pick;
}

render::Picture& Viewer::readable() {
  gl().progressive.settle();
  render::Picture* picture = gl().progressive.newest();
  if (picture == nullptr) throw Error(ErrorCode::invalid_argument, "nothing has been rendered yet");
  return *picture;
}

// Mean radiance, with the background's or without, and alpha, with the surfaces that lie beneath a preview.
void Viewer::read_means(Gl& g, const render::Picture& picture, bool with_background, float* rgba) {
  if (picture.layered() != render::Layered::beneath) {
    g.progressive.tracer().read(picture, with_background, rgba);
    return;
  }
  std::vector<float> opaque;
  if (with_background) {
    opaque.resize(std::size_t{picture.size().x} * picture.size().y * 4);
    read_composite(g, picture, false, opaque.data());
  }
  read_composite(g, picture, true, rgba);
  for (std::size_t i = 0; i < opaque.size(); ++i) {
    if (i % 4 != 3) rgba[i] = opaque[i];
  }
}

void Viewer::read_composite(Gl& g, const render::Picture& picture, bool transparent, float* rgba) {
  const glm::ivec2 size(picture.size());
  const gl::Object flat = gl::make_texture_2d(g.functions, GL_RGBA32F, size.x, size.y, "creating the texture to read");
  const TransientFramebuffer framebuffer(*g.functions, flat.name(), 0);
  render::Display display;
  display.transparent = transparent;
  display.encoding = render::ColourEncoding::hdr;
  render::FrameTarget target;
  target.framebuffer = framebuffer.name();
  target.viewport = {0, 0, size};
  target.flip_y = true;  // the first row is the top
  target.blend_over = false;
  g.compositor.draw(textures_of(picture, nullptr, g.host_depth), display, target);
  g.functions->GetTextureImage(flat.name(), 0, GL_RGBA, GL_FLOAT, size.x * size.y * 16, rgba);
  gl::check(*g.functions, "reading the picture back");
}

void Viewer::read_aov(Aov aov, float* values, std::size_t count) {
  using render::PixelFact;
  with_gl([&](Gl& g) {
    render::Picture& picture = readable();
    if (picture.view() != render::View::shaded) {
      throw Error(ErrorCode::invalid_argument, "the picture is a debug view: there are AOVs of shaded ones alone");
    }
    const std::size_t pixels = std::size_t{picture.size().x} * picture.size().y;
    const bool colour = aov == Aov::beauty || aov == Aov::volume;
    const std::array<PixelFact, 7> facts{{{},
                                          {},
                                          PixelFact::transmittance,
                                          PixelFact::surface_z,
                                          PixelFact::volume_z,
                                          PixelFact::normal,
                                          PixelFact::albedo}};
    const PixelFact fact = facts.at(static_cast<std::size_t>(aov));
    const std::size_t floats = pixels * (colour ? 4 : render::channels_of(fact));
    if (values == nullptr || count < floats) {
      throw Error(ErrorCode::invalid_argument, "the picture needs " + std::to_string(floats) + " floats");
    }
    if (aov == Aov::beauty) {
      read_means(g, picture, false, values);
    } else if (aov == Aov::volume) {
      if (!picture.volume_alone()) {
        throw Error(
            ErrorCode::invalid_argument,
            "the volume alone was not gathered: set volume_alone of cumulet_sampling_desc, and wait for the full "
            "resolution");
      }
      g.progressive.tracer().read_volume(picture, values);
    } else {
      if (!g.data || !g.progressive.newest_is_of(generation_)) {
        throw Error(ErrorCode::invalid_argument,
                    "the picture is of what was shown before: render until there is a newer");
      }
      g.progressive.tracer().read_fact(picture, *g.data, surfaces(), fact, values);
    }
  });
}

void Viewer::read_linear(float* rgba, std::size_t count) {
  with_gl([&](Gl& g) {
    const render::Picture& picture = readable();
    const std::size_t pixels = std::size_t{picture.size().x} * picture.size().y;
    if (rgba == nullptr || count < pixels * 4)
      throw Error(ErrorCode::invalid_argument, "the picture needs " + std::to_string(pixels * 4) + " floats");
    read_means(g, picture, !display_.transparent, rgba);
    totals_ = g.progressive.tracer().totals(picture);
  });
}

void Viewer::read_display(std::uint8_t* rgba, std::size_t count) {
  std::size_t pixels = 0;
  bool legend = false;
  with_gl([&](Gl&) {
    const render::Picture& picture = readable();
    pixels = std::size_t{picture.size().x} * picture.size().y;
    legend = picture.view() != render::View::shaded;
  });
  if (rgba == nullptr || count < pixels * 4)
    throw Error(ErrorCode::invalid_argument, "the picture needs " + std::to_string(pixels * 4) + " bytes");
  std::vector<float> linear(pixels * 4);
  read_linear(linear.data(), linear.size());
  render::Display display;
  display.exposure_stops = display_.exposure_stops;
  display.tone_map = display_.tone_map;
  display.legend = legend;
  display.transparent = display_.transparent;
  render::to_display(linear, display, {rgba, pixels * 4});
}

double Viewer::measure_noise() {
  with_gl([&](Gl& g) { totals_ = g.progressive.tracer().totals(readable()); });
  return totals_.noise;
}

Stats Viewer::stats() {
  sync();
  Stats s;
  s.cells = built_.cells;
  s.levels = built_.levels;
  s.limited = built_.limited;
  s.active_voxels = volume_ ? volume_->volume().active_voxels : 0;
  s.build_seconds = built_.seconds;
  s.steps = totals_.steps;
  if (gl_) {
    s.cell_bytes = gl_->data ? gl_->data->bytes() : 0;
    const glm::u64vec2 depth_size = gl_->host_depth.size();
    s.gl_bytes = s.cell_bytes + gl_->progressive.bytes() + (gl_->target ? gl_->target.of().bytes() : 0) +
                 depth_size.x * depth_size.y * gl_->host_depth.layers() * 4 + gl_->empty.bytes() +
                 (gl_->surfaces ? gl_->surfaces->bytes() : 0) + (gl_->raster ? gl_->raster->bytes() : 0);
    s.strings = gl_->strings;
    s.trace_seconds = gl_->progressive.trace_seconds();
    const render::Picture* picture = gl_->progressive.newest();
    s.samples = picture != nullptr ? picture->samples() : 0;
  }
  return s;
}

const core::CmParameters& Viewer::trace_parameters() { return readable().parameters(); }

}  // namespace cumulet::viewer
