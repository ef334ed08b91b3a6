#include "viewer/context.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "base/milliseconds.hpp"
#include "gl/transient_framebuffer.hpp"
#include "light/light_table.hpp"

namespace cumulet::viewer {

namespace {

// Fractions of a frame's budget.
constexpr double max_of_drawing = 0.5;
constexpr double part_to_filter = 0.4;

}  // namespace

Context::Context(gl::FunctionsPtr gl, Commons commons)
    : functions_(std::move(gl)),
      group_(functions_),
      programs_(std::move(commons.programs)),
      limits_(gl::query_limits(*functions_)),
      memories_(std::move(commons.memories)),
      marches_(std::move(commons.marches)),
      scene_(functions_, programs_, limits_, memories_, marches_),
      progressive_(functions_, programs_),
      compositor_(functions_, programs_),
      upload_timer_(functions_),
      host_depth_timer_(functions_),
      display_timer_(functions_),
      host_depth_(functions_, programs_),
      transfers_(functions_, programs_, limits_, memories_) {
  strings_ = {gl::string_of(*functions_, GL_VENDOR), gl::string_of(*functions_, GL_RENDERER),
              gl::string_of(*functions_, GL_VERSION)};
  gl::check(*functions_, "reading the context's limits");
}

void Context::find_out_dispatches() {
  if (knows_dispatches_) return;
  gl::find_out_dispatches(functions_, *programs_);
  knows_dispatches_ = true;
}

bool Context::shares_cores() const {
  return functions_->dispatches_in_call && compositor_.drawn() && !gl::Fence(functions_).passed();
}

render::Deadline Context::deadline_of(const Frame& frame, render::Deadline begun, bool shares) const {
  const double keep = shares ? reserve_.of(frame.budget_ms) : 0.0;
  const double drawing =
      std::min(frame.target == Target::none ? compositor_.expected_filter_ms() : compositor_.expected_ms(),
               max_of_drawing * frame.budget_ms);
  return deadline_after(frame.budget_ms - keep - drawing + milliseconds_until(begun));
}

void Context::upload(const Shot& shot, const UploadLimits& limits, render::Deadline deadline) {
  if (std::exchange(tried_, shot.settings) != shot.settings) programs_->try_again();
  // In-flight dispatches of another context of the share group may read memory that is about to be written.
  progressive_.tracer().order();
  if (scene_.data() != nullptr && shot.scene->volumes.empty()) progressive_.reset();
  const bool raster = shot.sampling.options.preview || shot.surfaces.light == SurfaceLight::none;
  const std::uint64_t others = bytes() - scene_.data_bytes() - scene_.other_bytes() - read_bytes();
  const std::uint64_t room = limits.max_bytes - std::min(limits.max_bytes, others);
  const auto update = [&] { scene_.update(*shot.scene, {raster, shot.settings, limits.page_texels, room}, deadline); };
  if (scene_.uploading()) {
    upload_timer_.run(update);
  } else {
    update();
  }
}

render::TraceInputs Context::trace_inputs(const Shot& shot) {
  render::TraceInputs trace_inputs = scene_.trace_inputs(*shot.scene, shot.surfaces.light != SurfaceLight::none);
  if (host_depth_.texture() != 0) {
    trace_inputs.depth = host_depth_.texture();
    trace_inputs.layers = host_depth_.layers();
    trace_inputs.size = host_depth_.size();
  }
  return trace_inputs;
}

render::PictureParameters Context::parameters(const Shot& shot, const render::TraceInputs& trace_inputs) const {
  core::CmIntegrator integrator{};
  integrator.seed = shot.sampling.seed;
  integrator.first_sample = shot.sampling.first_sample;
  integrator.max_bounces = shot.max_bounces;
  integrator.sun_group = shot.sun_group;
  integrator.sky_group = shot.sky_group;
  integrator.blurred_roughness = shot.surfaces.indirect_roughness;
  integrator.light_among_surfaces = shot.surfaces.light == SurfaceLight::full ? 1U : 0U;
  return scene_.parameters(*shot.scene, trace_inputs, integrator, shot.size);
}

void Context::take_host_depth(const Shot& shot, const Frame& frame) {
  render::HostDepthInput input;
  input.source = frame.depth_source;
  input.name = frame.depth_name;
  input.viewport = frame.viewport;
  input.target_size = frame.size;
  input.flip_y = frame.depth_flip_y;
  input.orthographic = shot.view()->orthographic;
  input.depth_a = shot.depth_a;
  input.depth_b = shot.depth_b;
  input.unchanged = frame.depth_unchanged && shot.view_rests;
  const auto update = [&] {
    if (host_depth_.update(input)) host_depth_revision_.advance();
  };
  if (input.source == render::DepthSource::none) {
    update();
  } else {
    host_depth_timer_.run(update);
  }
}

scene::SequenceFrames Context::uploaded_frames() const {
  scene::SequenceFrames frames;
  for (const scene::Volume& volume : scene_.volumes()) {
    if (volume.frame && !scene::holds(frames, *volume.frame)) frames.push_back(*volume.frame);
  }
  return frames;
}

FramesInContext Context::frames() const {
  return {.shown = progressive_.shown_frames(),
          .uploaded = uploaded_frames(),
          .picture_pending = progressive_.has_pending_picture(),
          .uploading = scene_.uploading_volumes()};
}

render::PictureRequest Context::request(const Shot& shot, const Frame& frame, const render::TraceInputs& inputs) const {
  render::PictureRequest request;
  request.parameters = parameters(shot, inputs);
  request.content.viewpoint = shot.scene->view;
  request.content.previous = shot.scene->previous;
  request.content.view_ends = shot.scene->view_ends;
  request.content.lights = shot.scene->lights;
  request.content.surroundings = shot.scene->surroundings;
  request.content.analytic_lights = shot.scene->analytic_lights;
  request.content.ground = shot.scene->ground;
  request.content.volumes = shot.scene->volumes;
  for (scene::Volume& volume : request.content.volumes) {
    volume.source = nullptr;
    volume.frame.reset();
  }
  request.frames = uploaded_frames();
  request.content.data = scene_.data_revision();
  request.content.instances = scene_.instances_revision();
  request.content.model = scene_.model_revision();
  request.content.environment = scene_.environment_revision();
  request.content.host_depth = host_depth_revision_;
  request.content.programs = programs_->revision();
  request.content.integrator = request.parameters.integrator;
  request.content.size = shot.size;
  request.content.surfaces_traced = inputs.traced;
  request.content.options = shot.sampling.options;
  request.samples = std::max(1U, shot.sampling.samples);
  request.noise_target = shot.sampling.noise_target;
  request.content.stops_by_noise = shot.sampling.noise_target.has_value();
  if (!request.content.stops_by_noise) request.content.options.adaptive = false;
  request.depth = frame.write_depth;
  request.guides = shot.display.denoise;
  request.held = shot.held;
  return request;
}

void Context::trace(const Shot& shot, const Frame& frame, render::Deadline deadline) {
  if (!shot.view()) return;
  take_host_depth(shot, frame);
  if (scene_.data() == nullptr) return;
  const render::TraceInputs inputs = trace_inputs(shot);
  progressive_.advance(request(shot, frame, inputs), *scene_.data(), inputs, deadline, frame.budget_ms);
}

std::uint64_t Context::TargetKind::bytes() const {
  const std::uint64_t color = format == GL_RGBA32F ? 16 : (format == GL_RGBA16F ? 8 : 4);
  return std::uint64_t{size.x} * size.y * (color + (depth ? 4 : 0));
}

void Context::make_target_textures(const Shot& shot, const Frame& frame) {
  const TargetKind kind{frame.size, frame.format, frame.write_depth};
  TargetKind with_depth = kind;  // also usable without depth
  with_depth.depth = true;
  if (!target_.wants(kind, shot.settings) || (target_ && target_.of() == with_depth)) return;
  target_.make(kind, shot.settings, [&] {
    const int width = static_cast<int>(kind.size.x);
    const int height = static_cast<int>(kind.size.y);
    TargetTextures made;
    made.color = gl::make_texture_2d(functions_, kind.format, width, height, "creating the target texture");
    if (kind.depth) {
      made.depth = gl::make_texture_2d(functions_, GL_DEPTH_COMPONENT32F, width, height, "creating the target's depth");
    }
    return made;
  });
}

bool Context::draws(const Shot& shot, const Frame& frame) {
  return frame.target != Target::none && shot.size.x > 0 && shot.size.y > 0;
}

void Context::draw_surfaces_alone(const Shot& shot, const Frame& frame) {
  if (progressive_.shown() != nullptr || !draws(shot, frame)) return;
  render::Tracer& tracer = progressive_.tracer();
  const bool able = scene_.draws_surfaces() && shot.view() && alone_failed_ != shot.settings;
  if (!empty_.film().has(render::film_layers::radiance) || (!able && empty_.layered() != render::Layered::no))
    tracer.clear(empty_);
  tracer.set_background(empty_, scene_.lights(*shot.scene).sky_radiance);
  if (!able || frame.budget_ms < 0.0) return;
  alone_failed_ = shot.settings;  // reset on success
  tracer.draw_layers(empty_, trace_inputs(shot),
                     render::Progressive::quick_layers(tracer, shot.size, frame.budget_ms, shot.view_rests));
  alone_failed_.reset();
}

render::PictureGuides Context::guides_of(const render::Picture& picture) {
  const render::Film& film = picture.film();
  const core::CmParameters& parameters = picture.parameters();
  render::PictureGuides guides;
  guides.albedo = film.texture(render::film_layers::albedo);
  guides.normal = film.texture(render::film_layers::normal);
  guides.transmittance = film.texture(render::film_layers::transmittance);
  guides.surface_z = film.texture(render::film_layers::surface_z);
  guides.volume_z = film.texture(render::film_layers::volume_z);
  guides.emission = film.texture(render::film_layers::emission);
  guides.surfaces = picture.layered() != render::Layered::beneath;
  const float pixel = 2.0F * glm::length(parameters.view.up) / static_cast<float>(picture.size().y);
  guides.footprint = parameters.view.orthographic != 0U ? glm::vec2(pixel, 0.0F) : glm::vec2(0.0F, pixel);
  return guides;
}

render::PictureView Context::view_of(const render::Picture& picture) const {
  const core::CmView& view = picture.parameters().view;
  const core::CmSpace& space = picture.parameters().space;
  const glm::dmat3 to_world(space.from_cube_x, space.from_cube_y, space.from_cube_z);
  render::PictureView seen;
  seen.eye = to_world * glm::dvec3(view.eye) + glm::dvec3(space.cube_origin);
  seen.forward = view.forward;
  seen.right = view.right;
  seen.up = view.up;
  seen.orthographic = view.orthographic != 0U;
  if (&picture == progressive_.shown()) seen.scene = progressive_.shown_scene();  // else of the warm-up
  return seen;
}

render::PictureTextures Context::textures_of(const render::Picture& picture, const render::Picture* before) const {
  render::PictureTextures textures;
  const render::Film& film = picture.film();
  textures.sum = film.texture(render::film_layers::radiance);
  textures.background = film.texture(render::film_layers::background);
  textures.counts = film.texture(render::film_layers::counts);
  textures.size = picture.size();
  textures.box = picture.box();
  textures.holes = picture.has_holes();
  if (film.has(render::film_layers::depth)) textures.volume_z = film.texture(render::film_layers::depth);
  textures.picture = picture.begun();
  textures.request = &picture == progressive_.shown() ? progressive_.shown_request() : 0;
  textures.revision = picture.revision();
  textures.rows = picture.rows();
  textures.moments = film.texture(render::film_layers::moments);
  if (picture.view() == render::View::shaded && picture.has_features()) textures.guides = guides_of(picture);
  if (textures.guides && progressive_.previews()) textures.view = view_of(picture);
  if (before != nullptr) {
    textures.sum_before = before->film().texture(render::film_layers::radiance);
    textures.background_before = before->film().texture(render::film_layers::background);
    textures.counts_before = before->film().texture(render::film_layers::counts);
  }
  if (picture.layered() == render::Layered::beneath) {
    textures.beneath = &picture.layers();
    textures.host_z = host_depth_.texture();
    textures.host_layers = host_depth_.layers();
  }
  return textures;
}

render::PictureTextures Context::textures_to_draw(const render::Picture& picture) const {
  render::PictureTextures textures = textures_of(picture, &picture == &empty_ ? nullptr : progressive_.before());
  textures.may_lag = !picture.done();
  return textures;
}

render::Pass Context::display_pass(const char* name, const render::PictureTextures& picture,
                                   const render::Display& display) {
  using namespace render::film_layers;
  render::Pass pass{name, {radiance, background, counts}, {}, {}};
  if (display.denoise && picture.guides) {
    for (const render::FilmLayer& layer : {moments, albedo, normal, transmittance, surface_z, volume_z, emission}) {
      pass.reads.push_back(layer);
    }
  }
  return pass;
}

void Context::composite(render::Film& film, const render::PictureTextures& picture, const render::Display& display,
                        const render::FrameTarget& target) {
  render::Pass pass = display_pass("cumulet: compositing", picture, display);
  if (target.write_depth) pass.reads.push_back(render::film_layers::depth);
  pass.work = [&](const render::Film&, render::Deadline until) {
    render::FrameTarget within = target;
    within.filter_ms = std::max(0.0, milliseconds_until(until));
    compositor_.draw(picture, display, within);
    return true;
  };
  render::run(functions_, film, pass, deadline_after(target.filter_ms));
}

render::Display Context::display(const Shot& shot, const Frame& frame, const render::Picture& shown) {
  render::Display display = shot.display.shown(shown.view() != render::View::shaded);
  display.encoding = frame.encoding;
  return display;
}

render::FrameTarget Context::target(const Shot& shot, const Frame& frame, const render::Picture& shown) const {
  render::FrameTarget target;
  target.framebuffer = frame.framebuffer;
  target.viewport = frame.viewport;
  target.region = &shown == progressive_.shown() ? shown.region() : shot.sampling.options.region;
  target.flip_y = frame.flip_y;
  target.blend_over = frame.blend_over;
  if (frame.target == Target::framebuffer) {
    target.size = frame.size;
    target.needs_depth = frame.write_depth;
  }
  target.filter_ms = part_to_filter * std::max(0.0, frame.budget_ms);
  target.write_depth = frame.write_depth && shown.film().has(render::film_layers::depth);
  if (shot.view()) {
    target.orthographic = shot.view()->orthographic;
    target.depth_a = shot.depth_a;
    target.depth_b = shot.depth_b;
    target.reversed = target.orthographic ? shot.depth_b < 0.0 : shot.depth_b > 0.0;
  }
  return target;
}

void Context::draw(const Shot& shot, const Frame& frame, FrameResult& result) {
  render::Picture* shown = progressive_.shown();
  if (shown != nullptr) result.size = shown->size();
  if (!draws(shot, frame)) {
    if (shown != nullptr) {
      denoise_undrawn(shot, frame, *shown);
    } else {
      compositor_.rest();
    }
    return;
  }
  if (shown == nullptr) shown = &empty_;
  const render::Display display = Context::display(shot, frame, *shown);
  render::FrameTarget target = Context::target(shot, frame, *shown);
  const render::PictureTextures picture = textures_to_draw(*shown);
  if (frame.target == Target::framebuffer) {
    display_timer_.run([&] { composite(shown->film(), picture, display, target); });
    return;
  }
  make_target_textures(shot, frame);
  if (!target_) return;
  const glm::uvec2 size = target_.of().size;
  target.viewport = size == frame.size ? frame.viewport : glm::ivec4(0, 0, size);
  const bool depth = frame.write_depth && target_->depth;
  const gl::TransientFramebuffer framebuffer(functions_, target_->color.name(), depth ? target_->depth.name() : 0);
  constexpr std::array<float, 4> nothing{};
  functions_->ClearNamedFramebufferfv(framebuffer.name(), GL_COLOR, 0, nothing.data());
  if (depth) {
    const float far = target.reversed ? 0.0F : 1.0F;
    functions_->ClearNamedFramebufferfv(framebuffer.name(), GL_DEPTH, 0, &far);
    result.depth_texture = target_->depth.name();
  }
  target.framebuffer = framebuffer.name();
  target.blend_over = false;
  display_timer_.run([&] { composite(shown->film(), picture, display, target); });
  result.texture = target_->color.name();
}

void Context::denoise_undrawn(const Shot& shot, const Frame& frame, render::Picture& shown) {
  const render::PictureTextures picture = textures_to_draw(shown);
  const render::Display display = Context::display(shot, frame, shown);
  render::Pass pass = display_pass("cumulet: denoise", picture, display);
  pass.work = [&](const render::Film&, render::Deadline until) {
    compositor_.denoise(picture, display, std::max(0.0, milliseconds_until(until)));
    return !compositor_.denoising();
  };
  const double filter_ms = target(shot, frame, shown).filter_ms;
  display_timer_.run([&] { render::run(functions_, shown.film(), pass, deadline_after(filter_ms)); });
}

MapResult Context::update_map(const Shot& shot, const MapRequest& request, render::Deadline deadline) {
  using Kind = render::MapLight::Kind;
  render::MapRequest wanted{
      {}, std::min(request.size, static_cast<std::uint32_t>(limits_.texture_size_3d)), request.slices};
  if (request.light == MapLight::point) {
    wanted.light = {Kind::point, {}, request.position};
  } else {
    const glm::dvec3 sun(scene_.lights(*shot.scene).to_sun);
    wanted.light = {Kind::parallel, glm::normalize(request.light == MapLight::sun ? sun : request.towards), {}};
  }
  render::TransmittanceMap& map = maps_.try_emplace(request.slot, functions_, programs_).first->second;
  map.advance(wanted, *shot.scene, scene_, deadline);
  return {map.texture(), map.size(), map.slices(), !map.is_newest(), map.to_map(), map.range()};
}

void Context::report(const Shot& shot, const Frame& frame, FrameResult& result) {
  const bool drawing = draws(shot, frame);
  if (const render::Picture* shown = progressive_.shown()) {
    const DrawnAs now{shown->revision(), shown->done(), shown->has_holes(),
                      shown->film().has(render::film_layers::depth), compositor_.denoised()};
    if (drawing) drawn_ = compositor_.lags() ? std::nullopt : std::optional(now);
    result.undrawn = !drawing && drawn_ != now;
    result.denoised = compositor_.shows_denoised();
  }
  const bool lags = (drawing && compositor_.lags()) || compositor_.denoising();
  const bool pending = host_depth_.pending() || lags;
  const bool pictures = scene_.data() != nullptr && shot.view();
  result.loading = scene_.uploading();
  result.converged = pictures && !pending && !scene_.uploading() && progressive_.converged();
  result.more = scene_.uploading() || lags || (pictures && (pending || progressive_.more()));
  result.progress = progressive_.progress();
  result.preview = result.size != glm::uvec2(0U) && result.size != shot.size;
}

bool Context::is_news(const Shot& shot, const Error& failure) {
  if (failure.code() != ErrorCode::gl) return true;
  std::pair<std::uint64_t, std::string> now(shot.settings, failure.what());
  const bool news = reported_ != now;
  reported_ = std::move(now);
  return news;
}

render::PassSeconds Context::pass_seconds() const {
  render::PassSeconds seconds = progressive_.tracer().seconds();
  seconds.upload = upload_timer_.seconds();
  seconds.host_depth = host_depth_timer_.seconds();
  seconds.display = display_timer_.seconds();
  return seconds;
}

std::uint64_t Context::read_bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [number, read] : reads_) bytes += read.pending.bytes();
  return bytes;
}

std::uint64_t Context::bytes() const {
  const glm::u64vec2 depth_size = host_depth_.size();
  std::uint64_t maps = 0;
  for (const auto& [slot, map] : maps_) maps += map.bytes();
  return scene_.data_bytes() + scene_.other_bytes() + maps + read_bytes() + progressive_.bytes() + empty_.bytes() +
         compositor_.bytes() + transfers_.bytes() + memories_->bytes() + (target_ ? target_.of().bytes() : 0) +
         depth_size.x * depth_size.y * host_depth_.layers() * 4;
}

}  // namespace cumulet::viewer
