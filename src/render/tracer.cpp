#include "render/tracer.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <numeric>

#include "base/error.hpp"
#include "base/luminance.hpp"
#include "base/milliseconds.hpp"
#include "gl/bindings.hpp"
#include "gl/state_guard.hpp"

namespace cumulet::render {

namespace {

constexpr std::uint32_t tile_edge = 1024;
constexpr std::uint32_t block_lanes = PathKernels::block_lanes;
// Maximum number of lanes. The megakernel has somewhat more than the largest GPU runs at once: with fewer lanes, more
// of them fetch another pixel when theirs is done. Wavefront stages have more, because each kernel processes only some
// of them. Drivers that run dispatches on the CPU have few enough for its caches.
constexpr std::uint32_t lanes_at_once = 128 * block_lanes;
constexpr std::uint32_t lanes_of_stages = PathKernels::max_lanes;
constexpr std::uint32_t lanes_in_call = 32 * block_lanes;
static_assert(tile_edge / Allotment::edge * (tile_edge / Allotment::edge) <= CM_MAX_SQUARES);
static_assert(CM_MAX_SQUARES <= InFlightDispatches::max_words, "the squares must fit into one read-back");
static_assert(CM_MAX_SQUARES <= 1U << CM_SQUARE_ROWS);
static_assert(tile_edge <= CM_BAND_ROWS * CM_BANDS);
constexpr double preview_rest = 0.03;  // fraction of a tile's pixels
static_assert(lanes_in_call > preview_rest * tile_edge * tile_edge,
              "the paths that have not started must exceed the remainder");
// llvmpipe silently ends a shader's loops after 65,535 iterations in total. These constants bound the iterations of a
// dispatch: a round takes some hundred iterations, and a ray some thousand. Cryptomatte rays take more than feature
// rays.
constexpr std::uint32_t max_rounds = 256;
constexpr std::uint32_t feature_rays_at_once = 2;
constexpr std::uint32_t matte_rays_at_once = 1;
constexpr int matte_slices = 16;  // as in cryptomatte.comp
static_assert(feature_rays % feature_rays_at_once == 0);
constexpr std::uint32_t longest_pass = 64;
constexpr std::uint32_t max_samples = 1U << 31U;
constexpr double nearly_done = 0.99;
constexpr std::uint32_t view_depth = 5;  // as in inspect.comp

using Clock = std::chrono::steady_clock;

// Returns a stride through n items that visits each once and jumps far from the last: near n times the golden ratio,
// coprime to n.
std::size_t far_step(std::size_t n) {
  auto step = std::max<std::size_t>(1, static_cast<std::size_t>(0.618 * static_cast<double>(n)));
  while (std::gcd(step, n) != 1) ++step;
  return step;
}

// Sets the parameters that may have changed since the picture was started: poses of surfaces, lights, and the host's
// depth.
void describe(const TraceInputs& trace_inputs, core::CmParameters& parameters) {
  parameters.host_depth = {trace_inputs.size, trace_inputs.depth != 0 ? trace_inputs.layers : 0};
  if (trace_inputs.scene != nullptr) parameters.surfaces = trace_inputs.scene->tables();
  parameters.analytic_lights.count = trace_inputs.analytic_light_count();
}

// Pixel transfer format of a layer.
struct Transfer {
  GLenum format;
  GLenum type;
};

Transfer transfer_of(const FilmLayer& layer) {
  if (layer.format == GL_RGBA32F) return {GL_RGBA, GL_FLOAT};
  if (layer.format == GL_RG32UI) return {GL_RG_INTEGER, GL_UNSIGNED_INT};
  if (layer.format == GL_RG32F) return {GL_RG, GL_FLOAT};
  return {GL_RED, GL_FLOAT};
}

constexpr const char* noise_kernel = "noise.comp";
constexpr const char* channels_macro = "CM_CHANNELS 1";
constexpr const char* environment_macro = "CM_ENVIRONMENT 1";
constexpr const char* equiangular_macro = "CM_EQUIANGULAR 1";
constexpr const char* extended_bsdf_macro = "CM_EXTENDED_BSDF 1";
constexpr const char* groups_macro = "CM_GROUPS 1";
constexpr const char* holdout_macro = "CM_HOLDOUT 1";

const char* surfaces_macro(unsigned traced) { return traced > 1 ? "CM_SURFACES 2" : "CM_SURFACES 1"; }

core::CmParameters assemble(const PictureParameters& picture, const TraceInputs& trace_inputs) {
  core::CmParameters parameters{};
  parameters.view = picture.view;
  parameters.space = picture.space;
  parameters.grid = picture.grid;
  parameters.emissive = picture.emissive;
  parameters.medium = picture.medium;
  parameters.lights = picture.lights;
  parameters.environment = picture.environment;
  parameters.ground = picture.ground;
  parameters.integrator = picture.integrator;
  parameters.shutter = picture.shutter;
  describe(trace_inputs, parameters);
  return parameters;
}

}  // namespace

double Picture::progress() const {
  if (done_) return 1.0;
  if (view_ != View::shaded) return box_.size.y > 0 ? double(view_row_) / box_.size.y : 0.0;
  const double wanted = expected_samples_ - static_cast<double>(samples_before_);
  const double part = wanted > 0.0 ? static_cast<double>(samples() - samples_before_) / wanted : 0.0;
  // It is not known when the noise will be low enough.
  return progress_before_ + (1.0 - progress_before_) * std::min(noise_target_ ? nearly_done : 1.0, part);
}

namespace {

// Returns the next number of samples per pixel at which a picture with a noise target is measured.
std::uint32_t look_after(std::uint32_t samples) {
  double count = Picture::first_measured;
  while (std::round(count) <= double(samples) && count < double(max_samples)) count *= std::numbers::sqrt2;
  return static_cast<std::uint32_t>(std::min(std::round(count), double(max_samples)));
}

}  // namespace

std::uint32_t Picture::pass_after(std::uint32_t samples) const {
  std::uint32_t next = samples;
  if (samples == 0 && previews_first_) {
    next = 1;  // the first image is shown at once
  } else if (!noise_target_) {
    // The pass size doubles, so that waiting for slow pixels at a pass's end costs little. If each pixel has a lane,
    // there is one pass: some lanes start their next samples while others are at their first.
    next = has_lanes_for_all() ? target_samples_ : samples + std::clamp(samples, 1U, longest_pass);
  } else if (samples < first_measured) {
    next = has_lanes_for_all() ? first_measured : std::max(1U, 2 * samples);
  } else {
    next = look_after(samples);
  }
  return std::min(next, target_samples_);
}

bool Picture::has_lanes_for_all() const {
  const glm::uvec2 squares = tile_squares();
  return tiles_ == glm::uvec2(1U) && lanes_ >= CM_SQUARE_PIXELS * squares.x * squares.y;
}

bool Picture::measures() const {
  // The last pass is measured, too. Whether more samples would have been enough must not depend on when they are
  // requested.
  return noise_target_ && pass_target_ >= first_measured && look_after(pass_target_ - 1) == pass_target_;
}

bool Picture::awaits_error() const {
  return !done_ && view_ == View::shaded && measures() && !tile_errors_ &&
         std::ranges::all_of(*blocks_, [](const Block& block) { return block.unfinished == 0; });
}

void Picture::change_all(std::uint64_t revision) {
  revision_ = revision;
  rows_->change_all(size_.y, revision);
}

void Picture::extend(std::uint32_t samples, std::optional<double> noise_target) {
  if (view_ != View::shaded) return;
  const bool more = samples > target_samples_;
  const bool retargeted = adaptive_ && noise_target != noise_target_;
  noise_target_ = noise_target;
  target_samples_ = std::max(target_samples_, samples);
  const bool reached = noise_target_ && noise_ && *noise_ <= *noise_target_;
  if (done_ ? reached || (pass_target_ >= target_samples_ && !retargeted) : !more && !retargeted) return;
  // The sampler's decisions were for another target.
  if (retargeted) allotment_.begin(box_.size);
  // Lanes that are finished start again. The current samples of others start again as well, with the same result.
  if (done_ || retargeted || (has_lanes_for_all() && !noise_target_)) {
    tile_ = 0;
    errors_.clear();
    if (done_ || !noise_target_) pass_target_ = pass_after(pass_target_);
    begin_tile();
  }
  progress_before_ = 0.0;
  samples_before_ = 0;
  expected_samples_ = allotment_.expected(target_samples_);
  done_ = false;
}

void Picture::go_on_from(const Accumulated& told, std::optional<std::uint32_t> pass) {
  tile_ = 0;
  errors_.clear();
  noise_.reset();
  samples_ = std::make_shared<SampleCount>(SampleCount{told.all});
  progress_before_ = 0.0;
  samples_before_ = 0;
  expected_samples_ = allotment_.expected(target_samples_);
  // Finds the pass in progress, because the noise is measured at its end: the first pass whose target is at least the
  // minimum sample count. If all pixels have exactly that many samples, its end may not have been measured.
  pass_target_ = pass.value_or(pass_after(0));
  const auto is_over = [&] {
    return !pass && (pass_target_ < told.least || (pass_target_ == told.least && told.most > told.least));
  };
  while (is_over() && pass_target_ < target_samples_) pass_target_ = pass_after(pass_target_);
  const bool whole = told.least > 0;
  pass_ = whole ? 2 : 0;
  complete_ = whole;
  holes_ = !whole;
  begin_tile();
}

void Picture::begin_tile() {
  // In-flight dispatches update the blocks that they were sent for, which are not read any more.
  blocks_ = std::make_shared<Blocks>();
  squares_.clear();
  tile_errors_.reset();
  block_ = 0;
  const glm::uvec2 squares = tile_squares();
  std::vector<std::uint32_t> pixels;  // of each sampled block
  for (std::uint32_t y = 0; y < squares.y; ++y) {
    for (std::uint32_t x = 0; x < squares.x; ++x) {
      const glm::uvec2 square = first_square() + glm::uvec2(x, y);
      const std::uint32_t live = allotment_.live(square);
      if (live == 0) continue;
      squares_.push_back((y * squares.x + x) | live << CM_SQUARE_ROWS);
      pixels.push_back(allotment_.live_pixels(square));
    }
  }
  constexpr std::size_t squares_a_block = block_lanes / CM_SQUARE_PIXELS;
  const std::size_t begun = std::min(squares_.size(), std::size_t{lanes_ / CM_SQUARE_PIXELS});
  const bool more = begun < squares_.size();  // than lanes: each lane starts with a pixel
  for (std::size_t first = 0; first < begun; first += squares_a_block) {
    const std::size_t end = std::min(begun, first + squares_a_block);
    const auto lanes = more ? static_cast<std::uint32_t>((end - first) * CM_SQUARE_PIXELS)
                            : std::accumulate(pixels.begin() + static_cast<std::ptrdiff_t>(first),
                                              pixels.begin() + static_cast<std::ptrdiff_t>(end), 0U);
    // If pixels may be unsampled, all are assumed to be, until the blocks report.
    blocks_->push_back({.unfinished = lanes, .empty = holes_ ? lanes : 0});
  }
}

// Ends the tile, the pass and the picture if the known results allow it.
void Picture::end_tile() {
  if (done_ || view_ != View::shaded) return;
  std::uint64_t unfinished = 0;
  std::uint64_t empty = 0;
  for (const Block& block : *blocks_) {
    unfinished += block.unfinished;
    empty += block.empty;
  }
  const glm::uvec2 extent = tile_extent();
  const auto rest = previews_first_ && !complete_ ? static_cast<std::uint64_t>(preview_rest * extent.x * extent.y) : 0;
  const bool all_begun = has_lanes_for_all();
  if (all_begun && empty <= rest) complete_ = true;
  holes_ = all_begun ? empty > 0 : previews_first_ && pass_ < 2;
  // With PictureSettings::previews_first, the first pass leaves its last few pixels to the second.
  const bool first_pass = pass_target_ == 1 && target_samples_ > 1;
  if (unfinished > (first_pass ? rest : 0)) return;
  if (measures()) {
    if (!tile_errors_ || tile_errors_->empty()) return;
    const glm::uvec2 squares = tile_squares();
    errors_.resize(allotment_.saved().size());
    for (std::uint32_t y = 0; y < squares.y; ++y) {
      const glm::uvec2 first = first_square() + glm::uvec2(0U, y);
      std::copy_n(tile_errors_->begin() + std::size_t{y} * squares.x, squares.x,
                  errors_.begin() + std::size_t{first.y} * allotment_.squares().x + first.x);
    }
  }
  if (++tile_ == tiles_.x * tiles_.y) end_pass();
  if (!done_) begin_tile();
}

void Picture::end_pass() {
  tile_ = 0;
  complete_ = true;
  ++pass_;
  ErrorSums error;
  for (const SquareError& square : errors_)
    error += {square.squared[0] + square.squared[1], square.brightness, square.pixels};
  // If a noise target was set within the pass, only some tiles have been measured.
  if (measures() && error.pixels == static_cast<double>(box_.area())) {
    noise_ = error.noise();
    progress_before_ = progress();
    samples_before_ = samples();
    // The noise falls with the root of the samples; 5 % are added because it is an estimate. If the noise is unknown,
    // no target is reached.
    const double ratio = noise_.value_or(std::numeric_limits<double>::infinity()) / *noise_target_;
    const double needed = 1.05 * ratio * ratio * pass_target_;
    const double each = needed < target_samples_ ? pass_after(static_cast<std::uint32_t>(needed)) : target_samples_;
    if (noise_ && *noise_ <= *noise_target_) {
      done_ = true;
    } else if (adaptive_) {
      allotment_.decide(errors_, *noise_target_, pass_target_);
    }
    expected_samples_ = adaptive_ ? allotment_.expected(target_samples_) : each * static_cast<double>(box_.area());
  }
  errors_.clear();
  if (pass_target_ >= target_samples_) {
    done_ = true;
  } else if (!done_) {
    pass_target_ = pass_after(pass_target_);
  }
}

const Tracer::Program& Tracer::program(std::vector<std::string> defines, const char* name,
                                       std::span<const std::string> more) {
  gl::ProgramKey key{name, std::move(defines)};
  key.defines.insert(key.defines.end(), more.begin(), more.end());
  const gl::Program& made = asked_ ? programs_->ask(key) : programs_->get(key);
  if (asked_) asked_ = *asked_ && made.usable();
  Program& program = used_[std::move(key)];
  program.object = &made;
  return program;
}

void Tracer::add_medium(const Picture& picture, std::vector<std::string>& defines) {
  if (picture.second_lobe_) defines.emplace_back("CM_SECOND_LOBE 1");
  if (picture.channels_) defines.emplace_back(channels_macro);
}

void Tracer::add_march(const Picture& picture, std::vector<std::string>& defines) {
  // To limit the number of variants, those for motion include holdouts.
  if (picture.volume_holdout_ || picture.motion_) defines.emplace_back(holdout_macro);
  add_groups(picture, defines);
}

void Tracer::add_groups(const Picture& picture, std::vector<std::string>& defines) {
  if (picture.light_groups_ > 0) defines.emplace_back(groups_macro);
}

const Tracer::Program& Tracer::trace_program(const Picture& picture, const MarchData& data) {
  if (picture.traced_ > 0) {
    std::vector<std::string> more{surfaces_macro(picture.traced_)};
    add_medium(picture, more);
    if (picture.environment_) more.emplace_back(environment_macro);
    if (picture.equiangular_) more.emplace_back(equiangular_macro);
    add_march(picture, more);
    return program(data.defines(picture.several_, picture.motion_), "trace_travel.comp", more);
  }
  // To limit the number of variants, those for light groups include layers and lights even if there are none.
  const bool groups = picture.light_groups_ > 0;
  std::vector<std::string> more;
  if (picture.layered_ != Layered::no || (groups && !picture.equiangular_)) more.emplace_back("CM_LAYERS 1");
  if (picture.volume_alone_) more.emplace_back("CM_AOVS 1");
  add_medium(picture, more);
  if (picture.environment_) more.emplace_back(environment_macro);
  if (picture.analytic_lights_ || groups) more.emplace_back("CM_ANALYTIC_LIGHTS 1");
  if (picture.equiangular_) more.emplace_back(equiangular_macro);
  add_march(picture, more);
  return program(data.defines(picture.several_, picture.motion_), "trace.comp", more);
}

StagePrograms Tracer::stage_programs(const Picture& picture, const MarchData& data) {
  std::vector<std::string> shade{surfaces_macro(picture.traced_)};
  if (picture.channels_) {
    shade.emplace_back(channels_macro);
    if (picture.several_) shade.emplace_back("CM_INSTANCES 1");
  }
  if (picture.environment_) shade.emplace_back(environment_macro);
  if (picture.equiangular_) shade.emplace_back(equiangular_macro);
  if (picture.model_holdout_) shade.emplace_back(holdout_macro);
  std::vector<std::string> intersect{"CM_SURFACES 1"};
  if (picture.extended_bsdf_) {
    shade.emplace_back(extended_bsdf_macro);
    intersect.emplace_back(extended_bsdf_macro);
  }
  std::vector<std::string> camera{"CM_SURFACES 1", "CM_DENSE 0"};
  if (picture.motion_) {
    for (auto* defines : {&shade, &intersect, &camera}) defines->emplace_back("CM_MOTION 1");
  }
  if (picture.volume_alone_) camera.emplace_back("CM_AOVS 1");
  if (picture.environment_) camera.emplace_back(environment_macro);
  for (std::vector<std::string>* defines : {&shade, &intersect, &camera}) add_groups(picture, *defines);
  std::vector<std::string> begin = camera;
  begin[1] = "CM_DENSE 1";
  StagePrograms programs;
  programs.begin = program(begin, "trace_camera.comp").object;
  programs.travel = trace_program(picture, data).object;
  programs.intersect = program(intersect, "trace_intersect.comp").object;
  programs.shade = program(shade, "trace_shade.comp").object;
  programs.camera = program(camera, "trace_camera.comp").object;
  return programs;
}

template <class Find>
bool Tracer::asked(Find&& find) {
  if (!programs_->parallel()) return true;
  asked_ = true;
  try {
    find();
  } catch (...) {
    asked_.reset();
    throw;
  }
  return *std::exchange(asked_, std::nullopt);
}

void Tracer::find_programs(const Picture& picture, const MarchData& data, const TraceInputs& trace_inputs) {
  if (picture.view_ == View::shaded && picture.traced_ > 0) {
    stage_programs(picture, data);
  } else if (picture.view_ == View::shaded) {
    trace_program(picture, data);
  } else {
    inspect_program(data, trace_inputs, "inspect.comp");
  }
  if (picture.noise_target_) program({}, noise_kernel);
}

unsigned Tracer::traced_of(const PictureParameters& parameters, const TraceInputs& trace_inputs,
                           const PictureSettings& settings) {
  // To appear at once, the volume of a preview is lit only by sun and sky, as its surfaces are. If there is no such
  // light, the scene lights it.
  const glm::vec3 distant = parameters.lights.sun_irradiance + parameters.lights.sky_radiance;
  const bool preview = settings.layered == Layered::beneath && distant != glm::vec3(0.0F);
  const ModelInstances* models = settings.view == View::shaded && !preview ? trace_inputs.traced_models() : nullptr;
  return models == nullptr ? 0 : (models->lights().triangles > 0 || models->tables().extended_bsdf != 0U ? 2 : 1);
}

void Tracer::classify(Picture& picture, const PictureParameters& parameters, const TraceInputs& trace_inputs,
                      const PictureSettings& settings) {
  const bool shaded = settings.view == View::shaded;
  picture.view_ = settings.view;
  picture.traced_ = traced_of(parameters, trace_inputs, settings);
  picture.extended_bsdf_ = picture.traced_ > 0 && trace_inputs.traced_models()->tables().extended_bsdf != 0U;
  picture.second_lobe_ = parameters.medium.second_weight > 0.0F;
  const core::CmMedium& medium = parameters.medium;
  picture.channels_ = medium.emits != 0U || medium.colored != 0U || medium.anisotropic != 0U;
  picture.environment_ = trace_inputs.environment != nullptr;
  picture.analytic_lights_ = trace_inputs.analytic_light_count() > 0;
  picture.several_ = trace_inputs.instances != nullptr;
  picture.volume_holdout_ = shaded && trace_inputs.volume_holdout;
  picture.model_holdout_ = shaded && picture.traced_ > 0 && trace_inputs.model_holdout;
  picture.motion_ = shaded && parameters.shutter.lasts != 0U;
  picture.layered_ = shaded && trace_inputs.raster != nullptr ? settings.layered : Layered::no;
  picture.volume_alone_ = shaded && settings.separate_volume_aov;
  picture.light_groups_ = shaded ? settings.light_groups : 0;
  if (picture.light_groups_ > 0 && picture.traced_ > 0) picture.traced_ = 2;
  // Equiangular sampling is off in these cases. The separate volume AOV depends on the first hit of a path, but such
  // light may lie before a surface. The color of a surface layer is stored in the same field as the light of such an
  // NEE sample. A holdout has no light.
  picture.equiangular_ = picture.analytic_lights_ && parameters.equiangular && !picture.volume_alone_ &&
                         !picture.extended_bsdf_ && !picture.volume_holdout_ && !picture.model_holdout_ &&
                         (picture.traced_ > 0 || picture.layered_ == Layered::no);
  picture.noise_target_ = shaded ? settings.noise_target : std::nullopt;
  picture.adaptive_ = picture.noise_target_ && settings.adaptive;
}

bool Tracer::able(const MarchData& data, const PictureParameters& parameters, const TraceInputs& trace_inputs,
                  const PictureSettings& settings) {
  Picture like;
  classify(like, parameters, trace_inputs, settings);
  return asked([&] { find_programs(like, data, trace_inputs); });
}

const Tracer::Program& Tracer::inspect_program(const MarchData& data, const TraceInputs& trace_inputs, const char* name,
                                               std::span<const char* const> macros) {
  std::vector<std::string> more;
  if (trace_inputs.scene != nullptr) more.emplace_back("CM_SURFACES 1");
  more.insert(more.end(), macros.begin(), macros.end());
  return program(data.defines(trace_inputs.instances != nullptr), name, more);
}

const Tracer::Program& Tracer::feature_program(const Picture& picture, const MarchData& data,
                                               const TraceInputs& trace_inputs, FeatureSet features) {
  constexpr std::array<const char*, 2> macros{channels_macro, "CM_VELOCITY 1"};
  const bool emits = picture.parameters_.medium.emits != 0U;
  const std::size_t used = features == FeatureSet::all ? 2 : (emits ? 1 : 0);
  return inspect_program(data, trace_inputs, "aovs.comp", std::span(macros).first(used));
}

const Tracer::Program& Tracer::matte_program(const Picture& picture, const MarchData& data,
                                             const TraceInputs& trace_inputs) {
  std::vector<std::string> more;
  if (trace_inputs.scene != nullptr) more.emplace_back("CM_SURFACES 1");
  const bool several = trace_inputs.instances != nullptr;
  return program(data.defines(several, several && picture.motion_), "cryptomatte.comp", more);
}

void Tracer::make_shared_objects() {
  if (!uniforms_)
    uniforms_ = gl::make_buffer(gl_, sizeof(core::CmParameters), nullptr, GL_DYNAMIC_STORAGE_BIT, "creating uniforms");
}

std::vector<FilmLayer> Tracer::accumulated(const Picture& picture) {
  std::vector<FilmLayer> layers{film_layers::radiance, film_layers::background, film_layers::moments,
                                film_layers::counts};
  if (picture.volume_alone_) layers.push_back(film_layers::volume);
  if (picture.light_groups_ > 0) layers.push_back(film_layers::light_groups(picture.light_groups_));
  return layers;
}

void Tracer::empty(Picture& picture, const glm::vec3& background, std::uint32_t samples) {
  const auto clear = [&](Film& film, Deadline) {
    const glm::vec4 zero(0.0F);
    const glm::vec4 behind(background, 0.0F);
    const glm::uvec2 count(samples, 0U);
    const glm::ivec2 first(picture.box_.first);
    const glm::ivec2 extent(picture.box_.size);
    const GLuint layer = film.texture(film_layers::background);
    gl_->ClearTexImage(film.texture(film_layers::radiance), 0, GL_RGBA, GL_FLOAT, &zero);
    gl_->ClearTexImage(layer, 0, GL_RGBA, GL_FLOAT, &zero);
    gl_->ClearTexSubImage(layer, 0, first.x, first.y, 0, extent.x, extent.y, 1, GL_RGBA, GL_FLOAT, &behind);
    gl_->ClearTexImage(film.texture(film_layers::moments), 0, GL_RED, GL_FLOAT, &zero);
    gl_->ClearTexImage(film.texture(film_layers::counts), 0, GL_RG_INTEGER, GL_UNSIGNED_INT, &count);
    if (picture.volume_alone_) gl_->ClearTexImage(film.texture(film_layers::volume), 0, GL_RGBA, GL_FLOAT, &zero);
    if (const FilmLayer groups = film_layers::light_groups(picture.light_groups_); picture.light_groups_ > 0)
      gl_->ClearTexImage(film.texture(groups), 0, GL_RGBA, GL_FLOAT, &zero);
    gl::check(*gl_, "clearing the accumulation");
    return true;
  };
  run(gl_, picture.film_, {"cumulet: begin image", {}, accumulated(picture), clear}, Deadline::max());
}

void Tracer::drop_unused_layers() {
  std::erase_if(drawn_layers_, [](const auto& drawn) { return drawn.use_count() == 1; });
}

std::uint64_t Tracer::bytes() const {
  std::uint64_t bytes = kernels_.bytes();
  for (const auto& drawn : drawn_layers_) bytes += drawn->layers.bytes();
  return bytes;
}

void Tracer::draw_layers(Picture& picture, const TraceInputs& trace_inputs, const PictureSettings& settings) {
  // The surface pass changes GL state; later code in the frame relies on the known state.
  struct Known {
    const gl::Functions& gl;
    explicit Known(const gl::Functions& functions) : gl(functions) {}
    ~Known() {
      if (gl.guard != nullptr) gl.guard->set_known();
    }
    Known(const Known&) = delete;
    Known& operator=(const Known&) = delete;
  };
  const Known known(*gl_);
  picture.layered_ = Layered::no;
  picture.layers_.reset();
  const glm::uvec2 size = settings.layer_size;
  const LayersOf wanted{trace_inputs.raster->content(), trace_inputs.view, trace_inputs.lighting, size,
                        settings.layers};
  const auto found = std::ranges::find_if(drawn_layers_, [&](const auto& drawn) { return drawn->of == wanted; });
  if (found != drawn_layers_.end()) {
    picture.layers_ = {*found, &(*found)->layers};
    picture.layered_ = settings.layered;
    return;
  }
  const auto spare = std::ranges::find_if(drawn_layers_, [](const auto& drawn) { return drawn.use_count() == 1; });
  const auto made = spare != drawn_layers_.end() ? *spare : std::make_shared<DrawnLayers>();
  made->of = {};
  std::erase(drawn_layers_, made);
  drop_unused_layers();
  collect();
  const bool measured = !rasters_.full();
  if (measured) rasters_.begin(InFlightDispatches::Kind::draws);
  try {
    trace_inputs.raster->draw(trace_inputs.view, trace_inputs.lighting, size, settings.layers, made->layers);
  } catch (...) {
    if (measured) rasters_.give_up();
    throw;
  }
  if (measured) {
    Dispatched what;
    what.lanes = double(size.x) * size.y * settings.layers;
    what.max_ms = what.lanes / raster_rate_;
    rasters_.end(std::move(what), 0, 0);
  }
  made->of = wanted;
  drawn_layers_.push_back(made);
  picture.layers_ = {made, &made->layers};
  picture.layered_ = settings.layered;
}

void Tracer::begin(Picture& picture, const MarchData& data, const PictureParameters& parameters, std::uint32_t samples,
                   const TraceInputs& trace_inputs, const PictureSettings& settings) {
  const glm::uvec2 size = parameters.view.size;
  const bool shaded = settings.view == View::shaded;
  make_shared_objects();
  const PixelBox box = settings.region.pixels(size, settings.margin);
  const glm::uvec2 tile = glm::min(box.size, glm::uvec2(tile_edge));
  const glm::uvec2 squares = (tile + Allotment::edge - 1U) / Allotment::edge;
  picture.complete_ = false;
  picture.size_ = size;
  picture.region_ = settings.region;
  picture.box_ = box;
  picture.film_.begin(size);
  classify(picture, parameters, trace_inputs, settings);
  if (picture.layered_ != Layered::no) {
    draw_layers(picture, trace_inputs, settings);
  } else {
    picture.layers_.reset();
    drop_unused_layers();
  }
  if (!picture.volume_alone_) picture.film_.drop(film_layers::volume);
  if (picture.light_groups_ == 0) picture.film_.drop(film_layers::light_groups(0));
  for (const FilmLayer& layer : accumulated(picture)) picture.film_.make(gl_, layer);
  const bool stages = picture.traced_ > 0;
  const std::uint32_t max_lanes = gl_->dispatches_in_call ? lanes_in_call : (stages ? lanes_of_stages : lanes_at_once);
  const std::uint32_t lanes = std::min(CM_SQUARE_PIXELS * squares.x * squares.y, max_lanes);
  if (shaded && !kernels_.reserve(lanes, stages, picture.several_, picture.extended_bsdf_, picture.light_groups_))
    paths_of_.reset();
  find_programs(picture, data, trace_inputs);
  picture.parameters_ = assemble(parameters, trace_inputs);
  picture.parameters_.integrator.groups = picture.light_groups_;
  picture.target_samples_ = samples;
  if (picture.layered_ != Layered::no) {
    const SurfaceLayers& layers = *picture.layers_;
    picture.parameters_.layers = {layers.layers, layers.blended ? 1U : 0U, layers.size,
                                  picture.layered_ == Layered::within ? 1U : 0U};
  }
  if (!shaded) picture.parameters_.dispatch.view = static_cast<std::uint32_t>(settings.view);
  picture.tile_size_ = tile;
  picture.tiles_ = (box.size + tile - 1U) / tile;
  picture.tile_ = 0;
  picture.lanes_ = lanes;
  picture.previews_first_ = settings.previews_first;
  picture.pass_ = 0;
  picture.holes_ = true;
  picture.pass_target_ = picture.pass_after(0);
  picture.allotment_.begin(box.size);
  picture.errors_.clear();
  picture.noise_.reset();
  picture.progress_before_ = 0.0;
  picture.samples_before_ = 0;
  picture.expected_samples_ = picture.allotment_.expected(samples);
  picture.samples_ = std::make_shared<SampleCount>();
  picture.view_row_ = 0;
  picture.complete_ = false;
  picture.done_ = false;
  picture.begin_tile();
  picture.rows_ = std::make_shared<RowRevisions>();
  picture.change_all(++revision_);
  picture.begun_ = picture.revision_;
  picture.depth_row_ = 0;
  picture.feature_row_ = picture.feature_rays_ = 0;
  picture.features_ = FeatureSet::guides;
  empty(picture, shaded ? parameters.lights.sky_radiance : glm::vec3(0.0F), 0);
}

void Tracer::clear(Picture& picture) {
  picture.size_ = glm::uvec2(1U);
  picture.region_ = {};
  picture.box_ = {glm::uvec2(0U), picture.size_};
  picture.film_.begin(picture.size_);
  picture.layered_ = Layered::no;
  picture.layers_.reset();
  drop_unused_layers();
  picture.parameters_ = {};
  picture.rows_ = std::make_shared<RowRevisions>();
  picture.change_all(++revision_);
  picture.begun_ = picture.revision_;
  picture.view_ = View::shaded;
  picture.depth_row_ = picture.feature_row_ = picture.feature_rays_ = 0;
  picture.features_ = FeatureSet::guides;
  picture.complete_ = picture.done_ = true;
  picture.holes_ = false;
  empty(picture, glm::vec3(0.0F), 1);
}

void Tracer::set_background(Picture& picture, const glm::vec3& radiance) {
  if (picture.parameters_.lights.sky_radiance == radiance) return;
  empty(picture, radiance, 1);
  picture.parameters_.lights.sky_radiance = radiance;
  picture.change_all(++revision_);
}

void Tracer::bind(const MarchData& data, const TraceInputs& trace_inputs) const {
  data.bind(*gl_);
  if (trace_inputs.depth != 0) gl_->BindTextureUnit(core::CM_UNIT_HOST_DEPTH, trace_inputs.depth);
  if (trace_inputs.scene != nullptr) trace_inputs.scene->bind(*gl_);
  if (trace_inputs.environment != nullptr) trace_inputs.environment->bind(*gl_);
  if (trace_inputs.analytic_lights != nullptr) trace_inputs.analytic_lights->bind(*gl_);
  if (trace_inputs.instances != nullptr) trace_inputs.instances->bind(*gl_);
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_PARAMETERS, uniforms_.name());
}

void Tracer::collect() {
  while (const auto completed = dispatches_in_flight_.take_completed()) {
    const Dispatched& what = completed->what;
    const double ms = completed->ms.value_or(completed->at_most_ms);
    (completed->words.empty() ? seconds_.inspect : seconds_.trace) += 1e-3 * completed->ms.value_or(0.0);
    if (completed->words.empty()) {
      learn_rows(*completed);
      continue;
    }
    if (what.errors) {
      for (const glm::uvec4& square : completed->words) {
        const auto error = std::bit_cast<glm::vec4>(square);
        what.errors->push_back({{error.x, error.y}, error.z, error.w});
      }
      continue;
    }
    learn(what, completed->ms, completed->at_most_ms, completed->words[0].x);
    what.rows->change(what.first_row, completed->words[0].y, completed->words[0].z, what.revision);
    for (const std::uint32_t block : what.blocks) what.samples->finished += completed->words[1 + block].w;
    what.samples->not_finite += completed->words[0].w;
    if (log_ != nullptr) {
      const auto lanes = static_cast<std::uint32_t>(what.blocks.size()) * block_lanes;
      log_->push_back({what.aim_ms, ms, lanes, static_cast<std::uint32_t>(what.lanes), what.rounds, what.max_ms > 0.0});
    }
    for (const std::uint32_t index : what.blocks) {
      Block& block = (*what.tile)[index];
      block.unfinished = completed->words[1 + index].y;
      block.empty = completed->words[1 + index].z;
      --block.under_way;
    }
  }
  while (const auto completed = rasters_.take_completed()) {
    seconds_.surfaces += 1e-3 * completed->ms.value_or(0.0);
    const double rate = completed->what.lanes / std::max(1e-3, completed->ms.value_or(completed->at_most_ms));
    if (completed->ms || rate > raster_rate_) raster_rate_ += 0.3 * (rate - raster_rate_);
  }
}

bool Tracer::layers_ready(Deadline deadline) {
  if (!gl_->dispatches_in_call) return true;  // the device orders them
  for (collect(); !rasters_.empty(); collect()) {
    if (Clock::now() >= deadline) return false;
    pass_time();
  }
  return true;
}

void Tracer::settle(Picture& picture) {
  dispatches_in_flight_.finish();
  collect();
  picture.end_tile();
}

bool Tracer::trace(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
                   bool until_complete) {
  collect();
  picture.end_tile();
  if (picture.done_) return true;
  const std::vector<FilmLayer> layers = accumulated(picture);
  const auto work = [&](Film&, Deadline until) {
    return accumulate(picture, data, trace_inputs, until, until_complete);
  };
  return run(gl_, picture.film_, {"cumulet: samples", layers, layers, work}, deadline);
}

bool Tracer::accumulate(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
                        bool until_complete) {
  if (picture.layered_ != Layered::no && !layers_ready(deadline)) return false;
  const bool shaded = picture.view_ == View::shaded;
  const Program& program = shaded ? trace_program(picture, data) : inspect_program(data, trace_inputs, "inspect.comp");
  dispatches_in_flight_.order();
  program.object->use(*gl_);
  bind(data, trace_inputs);
  if (picture.layered_ != Layered::no) {
    gl_->BindTextureUnit(core::CM_UNIT_LAYER_COLOR, picture.layers_->color.name());
    gl_->BindTextureUnit(core::CM_UNIT_LAYER_Z, picture.layers_->z.name());
  }
  kernels_.bind();
  const Film& film = picture.film_;
  film.bind(*gl_, core::CM_IMAGE_SUM, film_layers::radiance, GL_READ_WRITE);
  film.bind(*gl_, core::CM_IMAGE_COUNTS, film_layers::counts, GL_READ_WRITE);
  film.bind(*gl_, core::CM_IMAGE_BACKGROUND, film_layers::background, GL_READ_WRITE);
  film.bind(*gl_, core::CM_IMAGE_MOMENTS, film_layers::moments, GL_READ_WRITE);
  // The image bound must match the format even if nothing writes it: inspect.comp has the depth there.
  film.bind(*gl_, core::CM_IMAGE_VOLUME_SUM, picture.volume_alone_ ? film_layers::volume : film_layers::depth,
            GL_READ_WRITE);
  if (picture.light_groups_ > 0)
    film.bind(*gl_, core::CM_IMAGE_GROUPS, film_layers::light_groups(picture.light_groups_), GL_READ_WRITE);
  if (!shaded) {
    core::CmParameters parameters = picture.parameters_;
    describe(trace_inputs, parameters);
    picture.change_all(++revision_);
    picture.done_ = picture.complete_ = inspect(picture.box_, parameters, program.cost, picture.view_row_, deadline);
    picture.holes_ = !picture.done_;
    picture.samples_->finished = std::uint64_t{picture.box_.size.x} * std::min(picture.view_row_, picture.box_.size.y);
    return picture.done_;
  }
  std::optional<StagePrograms> stages;
  if (picture.traced_ > 0) stages = stage_programs(picture, data);
  until_complete = until_complete && !picture.complete_;
  // Blocks whose paths were overwritten by another picture's start again.
  const auto begun = [](const Block& block) { return !block.begins; };
  if (paths_of_.lock() != picture.blocks_ && std::ranges::any_of(*picture.blocks_, begun)) picture.begin_tile();
  const double aim = std::clamp(0.7 * milliseconds_until(deadline), min_ms, dispatch_ms);
  const std::uint32_t rounds = stages ? PathKernels::max_rounds() : max_rounds;
  bool sent = false;
  while (!picture.done_ && !(until_complete && picture.complete_)) {
    const double left = part_of_rest * milliseconds_until(deadline) - dispatches_in_flight_.expected_ms();
    if (!dispatches_in_flight_.full() && picture.awaits_error()) {
      measure(picture, trace_inputs);
      (stages ? stages->travel : program.object)->use(*gl_);
      sent = true;
      collect();
      picture.end_tile();
      continue;
    }
    if (!dispatches_in_flight_.full()) {
      const Blocks& blocks = *picture.blocks_;
      auto what = choose(blocks, picture.block_, program.cost, std::clamp(left, 0.0, aim), rounds);
      if (!what && !sent && dispatches_in_flight_.empty())
        what = choose_minimum(blocks, picture.block_, program.cost, rounds);
      if (what) {
        dispatch(picture, trace_inputs, stages, std::move(*what));
        sent = true;
        collect();
        picture.end_tile();
        continue;
      }
    }
    // The dispatches in flight last until the deadline, or there is no time for more.
    if (dispatches_in_flight_.empty() || Clock::now() >= deadline || (sent && left <= 0.0)) break;
    pass_time();
    collect();
    picture.end_tile();
  }
  return picture.done_;
}

void Tracer::measure(Picture& picture, const TraceInputs& trace_inputs) {
  core::CmParameters parameters = picture.parameters_;
  describe(trace_inputs, parameters);
  parameters.dispatch.tile_corner = picture.tile_corner();
  parameters.dispatch.tile_size = picture.tile_extent();
  gl_->NamedBufferSubData(uniforms_.name(), 0, sizeof(parameters), &parameters);
  program({}, noise_kernel).object->use(*gl_);
  if (!errors_)
    errors_ = gl::make_buffer(gl_, InFlightDispatches::max_words * sizeof(glm::vec4), nullptr, 0,
                              "creating the errors of adaptive-sampling blocks");
  gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_ERRORS, errors_.name());
  Dispatched what;
  what.errors = picture.tile_errors_ = std::make_shared<SquareErrors>();
  const glm::uvec2 squares = picture.tile_squares();
  dispatches_in_flight_.begin(InFlightDispatches::Kind::dispatch);
  gl_->DispatchCompute(squares.x, squares.y, 1);
  dispatches_in_flight_.end(std::move(what), errors_.name(), std::size_t{squares.x} * squares.y);
  kernels_.bind();
  gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  gl::check(*gl_, "measuring the noise");
}

void Tracer::dispatch(Picture& picture, const TraceInputs& trace_inputs, const std::optional<StagePrograms>& stages,
                      Dispatched what) {
  const glm::uvec2 extent = picture.tile_extent();
  core::CmParameters parameters = picture.parameters_;
  describe(trace_inputs, parameters);
  parameters.surfaces.extended_bsdf = picture.extended_bsdf_ ? 1U : 0U;  // as there is memory for in the paths
  parameters.dispatch.tile_corner = picture.tile_corner();
  parameters.dispatch.tile_size = extent;
  parameters.dispatch.rounds = what.rounds;
  parameters.dispatch.samples = picture.pass_target_;
  parameters.dispatch.lanes = picture.lanes_;
  parameters.dispatch.slots = static_cast<std::uint32_t>(CM_SQUARE_PIXELS * picture.squares_.size());
  // Blocks are permuted with a large stride. If a driver gives each core a run of work groups, each core gets a
  // fraction of the expensive ones.
  const std::size_t count = what.blocks.size();
  picture.block_ = (what.blocks.back() + 1) % picture.blocks_->size();
  std::vector<std::uint32_t> dealt(count);
  const std::size_t step = far_step(count);
  for (std::size_t i = 0; i < count; ++i) dealt[i] = what.blocks[i * step % count];
  what.blocks = std::move(dealt);
  std::uint32_t lanes_a_block = 0;
  std::vector<glm::uvec4> words(1 + picture.blocks_->size(), glm::uvec4(0U));
  for (std::size_t i = 0; i < count; ++i) {
    Block& block = (*picture.blocks_)[what.blocks[i]];
    words[1 + i].x = what.blocks[i] | block.list << CM_LIST_BIT | (block.begins ? PathKernels::begins_tile : 0U);
    lanes_a_block = std::max(lanes_a_block, block.begins ? block_lanes : block.unfinished);
    block.begins = false;
    block.list = (block.list + 1) % CM_LISTS;
    ++block.under_way;
  }
  picture.revision_ = ++revision_;
  what.tile = picture.blocks_;
  what.samples = picture.samples_;
  what.rows = picture.rows_;
  what.first_row = picture.tile_corner().y;
  what.revision = picture.revision_;
  what.rows->expect();
  gl_->NamedBufferSubData(uniforms_.name(), 0, sizeof(parameters), &parameters);
  kernels_.set_counters(words);
  if (paths_of_.lock() != picture.blocks_) {
    kernels_.set_squares(picture.squares_, picture.lanes_);
    paths_of_ = picture.blocks_;
  }
  dispatches_in_flight_.begin(InFlightDispatches::Kind::dispatch);
  if (stages) {
    kernels_.run_stages(*stages, picture.lanes_, count, what.rounds);
  } else {
    kernels_.run_one(std::min(picture.lanes_, lanes_a_block), count);
  }
  dispatches_in_flight_.end(std::move(what), kernels_.counters(), words.size());
  gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                               GL_BUFFER_UPDATE_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT |
                               GL_TEXTURE_FETCH_BARRIER_BIT);
  gl::check(*gl_, "tracing");
}

bool Tracer::inspect(const PixelBox& box, const core::CmParameters& parameters, const std::shared_ptr<RoundCost>& cost,
                     std::uint32_t& row, Deadline deadline) {
  core::CmParameters p = parameters;
  const glm::uvec2 size = box.size;
  p.dispatch.tile_corner = box.first;
  p.dispatch.tile_size = size;
  const auto send = [&](glm::uvec2 rows) {
    p.dispatch.rows = rows;
    gl_->NamedBufferSubData(uniforms_.name(), 0, sizeof(p), &p);
    gl_->DispatchCompute((size.x + 7) / 8, (rows.y - rows.x + 7) / 8, 1);
  };
  send_rows(dispatches_in_flight_, cost, size, row, deadline, send, [&] { collect(); });
  gl::memory_barrier(*gl_, GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT |
                               GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  gl::check(*gl_, "checking the pixels");
  return row >= size.y;
}

bool Tracer::look_along_rays(const PixelBox& box, core::CmParameters parameters, const Program& program,
                             std::uint32_t at_once, std::uint32_t& rays, std::uint32_t wanted, std::uint32_t& row,
                             Deadline deadline) {
  while (rays < wanted) {
    parameters.dispatch.rays_before = rays;
    parameters.dispatch.samples = rays + at_once;
    const auto& cost = rays < parameters.dispatch.rays_least ? program.cost : program.settled_cost;
    if (!inspect(box, parameters, cost, row, deadline)) return false;
    rays += at_once;
    row = 0;
    if (rays < wanted && Clock::now() >= deadline) return false;
  }
  return true;
}

void Tracer::empty_around(const Picture& picture, std::span<const FilmLayer> layers) const {
  if (picture.box_.size == picture.size_) return;
  for (const FilmLayer& layer : layers) {
    const Transfer transfer = transfer_of(layer);
    gl_->ClearTexImage(picture.film_.texture(layer), 0, transfer.format, transfer.type, nullptr);
  }
}

bool Tracer::trace_depth(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline) {
  if (picture.film_.has(film_layers::depth)) return true;
  if (!asked([&] { inspect_program(data, trace_inputs, "inspect.comp"); })) return false;
  const auto work = [&](const Film& film, Deadline until) {
    make_shared_objects();
    dispatches_in_flight_.order();
    const Program& program = inspect_program(data, trace_inputs, "inspect.comp");
    program.object->use(*gl_);
    bind(data, trace_inputs);
    film.bind(*gl_, core::CM_IMAGE_SUM, film_layers::radiance, GL_READ_WRITE);
    film.bind(*gl_, core::CM_IMAGE_COUNTS, film_layers::counts, GL_READ_WRITE);
    film.bind(*gl_, core::CM_IMAGE_VOLUME_Z, film_layers::depth, GL_WRITE_ONLY);
    core::CmParameters parameters = picture.parameters_;
    describe(trace_inputs, parameters);
    parameters.dispatch.view = view_depth;
    if (picture.depth_row_ == 0) empty_around(picture, std::array{film_layers::depth});
    return inspect(picture.box_, parameters, program.cost, picture.depth_row_, until);
  };
  return run(gl_, picture.film_, {"cumulet: depth", {}, {film_layers::depth}, work}, deadline);
}

bool Tracer::able_to_find(const Picture& picture, const MarchData& data, const TraceInputs& trace_inputs) {
  return asked([&] { feature_program(picture, data, trace_inputs, FeatureSet::guides); });
}

std::uint64_t Picture::samples_per_pixel() const { return samples() / std::max<std::uint64_t>(box_.area(), 1); }

bool Picture::has_features() const { return film_.has(film_layers::normal); }

bool Tracer::find_features(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
                           std::uint32_t rays, FeatureSet features) {
  using namespace film_layers;
  // A failed read may have requested more buffers.
  if (trace_inputs.motion == nullptr && !picture.film_.has(motion)) picture.features_ = FeatureSet::guides;
  if (picture.features_ < features) {
    picture.features_ = features;
    picture.feature_row_ = picture.feature_rays_ = 0;
  }
  if (picture.feature_rays_ >= rays && picture.film_.has(normal)) return true;
  // Motion vectors need TraceInputs::motion. Without it only guides are refined.
  const FeatureSet found = trace_inputs.motion != nullptr ? picture.features_ : FeatureSet::guides;
  std::vector<FilmLayer> written{normal, albedo, transmittance, surface_z, volume_z, emission};
  if (found == FeatureSet::all) written.insert(written.end(), {velocity, motion});
  const auto work = [&](const Film& film, Deadline until) {
    make_shared_objects();
    dispatches_in_flight_.order();
    const Program& program = feature_program(picture, data, trace_inputs, found);
    program.object->use(*gl_);
    bind(data, trace_inputs);
    film.bind(*gl_, core::CM_IMAGE_NORMAL, normal, GL_READ_WRITE);
    film.bind(*gl_, core::CM_IMAGE_ALBEDO, albedo, GL_READ_WRITE);
    film.bind(*gl_, core::CM_IMAGE_TRANSMITTANCE, transmittance, GL_READ_WRITE);
    film.bind(*gl_, core::CM_IMAGE_SURFACE_Z, surface_z, GL_WRITE_ONLY);
    film.bind(*gl_, core::CM_IMAGE_VOLUME_Z, volume_z, GL_READ_WRITE);
    film.bind(*gl_, core::CM_IMAGE_EMISSION, emission, GL_READ_WRITE);
    if (found == FeatureSet::all) {
      film.bind(*gl_, core::CM_IMAGE_VELOCITY, velocity, GL_READ_WRITE);
      film.bind(*gl_, core::CM_IMAGE_MOTION, motion, GL_READ_WRITE);
      upload_motion(*trace_inputs.motion);
      gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_MOTION, motion_.name());
    }
    core::CmParameters parameters = picture.parameters_;
    describe(trace_inputs, parameters);
    if (picture.feature_row_ == 0 && picture.feature_rays_ == 0) empty_around(picture, written);
    parameters.dispatch.rays_least = feature_rays;
    const std::uint32_t before = picture.feature_rays_;
    const bool done = look_along_rays(picture.box_, parameters, program, feature_rays_at_once, picture.feature_rays_,
                                      rays, picture.feature_row_, until);
    if (picture.feature_rays_ != before) picture.revision_ = ++revision_;
    return done;
  };
  return run(gl_, picture.film_, {"cumulet: feature buffers", {}, written, work}, deadline);
}

void Tracer::upload_motion(const scene::MotionTable& motion) {
  std::vector<std::byte> bytes(sizeof motion.frame + motion.maps.size() * sizeof(core::CmMotion));
  std::memcpy(bytes.data(), &motion.frame, sizeof motion.frame);
  std::memcpy(bytes.data() + sizeof motion.frame, motion.maps.data(), bytes.size() - sizeof motion.frame);
  motion_ = gl::make_buffer(gl_, bytes.size(), bytes.data(), 0, "creating the motion table");
}

void Tracer::read_feature(const Picture& picture, FeatureBuffer feature, float* values) const {
  const std::array layers{film_layers::transmittance, film_layers::surface_z, film_layers::volume_z,
                          film_layers::normal,        film_layers::albedo,    film_layers::velocity,
                          film_layers::motion,        film_layers::motion};
  const FilmLayer& layer = layers.at(static_cast<std::size_t>(feature));
  if (layer == film_layers::motion) {
    for (const glm::vec4& both : texels<glm::vec4>(picture, layer, GL_RGBA, GL_FLOAT)) {
      *values++ = feature == FeatureBuffer::motion ? both.x : both.z;
      *values++ = feature == FeatureBuffer::motion ? both.y : both.w;
    }
    return;
  }
  const std::size_t channels = channels_of(feature);
  const std::size_t floats = std::size_t{picture.size_.x} * picture.size_.y * channels;
  gl_->GetTextureImage(picture.film_.texture(layer), 0, channels == 1 ? GL_RED : GL_RGB, GL_FLOAT,
                       static_cast<GLsizei>(floats * sizeof(float)), values);
  gl::check(*gl_, "reading the feature buffers");
}

void Tracer::read_mattes(const Picture& picture, const MarchData& data, const TraceInputs& trace_inputs,
                         const MatteIds& ids, std::uint32_t ranks, float* values) {
  const gl::DebugGroup group(*gl_, "cumulet: Cryptomatte");
  std::vector<std::uint32_t> table{ids.ground};
  table.insert(table.end(), ids.volumes.begin(), ids.volumes.end());
  if (trace_inputs.scene != nullptr) {
    for (const scene::ModelPart& part : trace_inputs.scene->table().parts) table.push_back(ids.models.at(part.model));
  }
  const gl::Object buffer =
      gl::make_buffer(gl_, table.size() * sizeof(std::uint32_t), table.data(), 0, "creating the Cryptomatte table");
  make_shared_objects();
  dispatches_in_flight_.order();
  const Program& program = matte_program(picture, data, trace_inputs);
  core::CmParameters parameters = picture.parameters_;
  describe(trace_inputs, parameters);
  parameters.dispatch.rays_least = matte_rays;
  std::fill_n(values, std::size_t{2} * ranks * picture.size_.x * picture.size_.y, 0.0F);
  const PixelBox& box = picture.box_;
  if (box.area() == 0) return;
  // Each pixel holds more ranks than are requested, so a few rows are processed at a time.
  constexpr std::uint32_t rows_at_once = 64;
  const glm::uvec2 size(box.size.x, std::min(box.size.y, rows_at_once));
  const gl::Object mattes =
      gl::make_texture_2d_array(gl_, GL_RGBA32F, static_cast<int>(size.x), static_cast<int>(size.y), matte_slices,
                                "creating the Cryptomatte texture");
  const std::size_t slices = (ranks + 1) / 2;
  std::vector<glm::vec2> pairs(size.x * size.y * 2 * slices);
  for (std::uint32_t from = 0; from < box.size.y; from += size.y) {
    const PixelBox part{box.first + glm::uvec2(0, from), glm::uvec2(size.x, std::min(size.y, box.size.y - from))};
    std::uint32_t row = 0;
    std::uint32_t rays = 0;
    program.object->use(*gl_);
    bind(data, trace_inputs);
    gl_->BindImageTexture(core::CM_IMAGE_MATTES, mattes.name(), 0, GL_TRUE, 0, GL_READ_WRITE, GL_RGBA32F);
    gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_MATTES, buffer.name());
    while (!look_along_rays(part, parameters, program, matte_rays_at_once, rays, matte_rays, row,
                            deadline_after(1000.0))) {
    }
    gl_->GetTextureSubImage(mattes.name(), 0, 0, 0, 0, static_cast<GLsizei>(size.x), static_cast<GLsizei>(size.y),
                            static_cast<GLsizei>(slices), GL_RGBA, GL_FLOAT,
                            static_cast<GLsizei>(pairs.size() * sizeof(glm::vec2)), pairs.data());
    gl::check(*gl_, "reading Cryptomatte");
    for (std::uint32_t y = 0; y < part.size.y; ++y) {
      for (std::uint32_t x = 0; x < part.size.x; ++x) {
        const std::size_t pixel = std::size_t{part.first.y + y} * picture.size_.x + part.first.x + x;
        for (std::uint32_t rank = 0; rank < ranks; ++rank) {
          const glm::vec2& pair = pairs[((rank / 2 * size.y + y) * size.x + x) * 2 + rank % 2];
          if (!(pair.y > 0.0F)) break;
          std::memcpy(values + 2 * (pixel * ranks + rank), &pair, sizeof pair);
        }
      }
    }
  }
}

Tracer::Picked Tracer::pick(const MarchData& data, const PictureParameters& parameters, const TraceInputs& trace_inputs,
                            glm::uvec2 pixel) {
  make_shared_objects();
  dispatches_in_flight_.order();
  if (!pick_) pick_ = gl::make_texture_2d(gl_, GL_R32F, 1, 1, "creating the pick texture");
  if (!pick_object_) pick_object_ = gl::make_texture_2d(gl_, GL_RG32UI, 1, 1, "creating the pick result");
  core::CmParameters p = assemble(parameters, trace_inputs);
  p.dispatch.tile_corner = pixel;
  p.dispatch.tile_size = glm::uvec2(1U);
  p.dispatch.view = view_depth;
  p.dispatch.picks = 1;
  p.dispatch.rows = {0U, 1U};
  inspect_program(data, trace_inputs, "inspect.comp").object->use(*gl_);
  bind(data, trace_inputs);
  gl_->BindImageTexture(core::CM_IMAGE_SUM, 0, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  gl_->BindImageTexture(core::CM_IMAGE_COUNTS, pick_object_.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RG32UI);
  gl_->BindImageTexture(core::CM_IMAGE_VOLUME_Z, pick_.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_R32F);
  gl_->NamedBufferSubData(uniforms_.name(), 0, sizeof(p), &p);
  gl_->DispatchCompute(1, 1, 1);
  gl::memory_barrier(*gl_, GL_TEXTURE_UPDATE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  Picked picked;
  glm::uvec2 object(0U);
  gl_->GetTextureImage(pick_.name(), 0, GL_RED, GL_FLOAT, sizeof(picked.z), &picked.z);
  gl_->GetTextureImage(pick_object_.name(), 0, GL_RG_INTEGER, GL_UNSIGNED_INT, sizeof(object), &object);
  gl::check(*gl_, "picking");
  if (object.x == 1U) picked.volume = object.y;
  if (object.x == 2U) picked.triangle = object.y;
  return picked;
}

template <class Texel>
std::vector<Texel> Tracer::texels(const Picture& picture, const FilmLayer& layer, GLenum format, GLenum type) const {
  std::vector<Texel> texels(std::size_t{picture.size_.x} * picture.size_.y);
  gl_->GetTextureImage(picture.film_.texture(layer), 0, format, type,
                       static_cast<GLsizei>(texels.size() * sizeof(Texel)), texels.data());
  gl::check(*gl_, "reading back the image");
  return texels;
}

void Tracer::read(const Picture& picture, bool with_background, float* rgba) const {
  read_means(picture, film_layers::radiance, rgba);
  if (!with_background) return;
  const auto background = texels<glm::vec3>(picture, film_layers::background, GL_RGB, GL_FLOAT);
  for (std::size_t i = 0; i < background.size(); ++i) {
    for (int c = 0; c < 3; ++c) rgba[4 * i + static_cast<std::size_t>(c)] += background[i][c];
  }
}

std::vector<glm::uvec2> Tracer::read_counts(const Picture& picture) const {
  return texels<glm::uvec2>(picture, film_layers::counts, GL_RG_INTEGER, GL_UNSIGNED_INT);
}

void Tracer::read_means(const Picture& picture, const FilmLayer& sum, float* rgba) const {
  const std::vector<glm::uvec2> counts = read_counts(picture);
  gl_->GetTextureImage(picture.film_.texture(sum), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(counts.size() * 16),
                       rgba);
  gl::check(*gl_, "reading back the image");
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const float scale = counts[i].x > 0 ? 1.0F / static_cast<float>(counts[i].x) : 0.0F;
    for (std::size_t c = 0; c < 4; ++c) rgba[4 * i + c] *= scale;
  }
}

void Tracer::read_light_group(const Picture& picture, std::uint32_t group, bool with_background, float* rgb) const {
  const std::vector<glm::uvec2> counts = read_counts(picture);
  const glm::ivec2 size(picture.size_);
  const std::uint32_t groups = picture.light_groups_;
  const GLuint layer = picture.film_.texture(film_layers::light_groups(groups));
  std::vector<glm::vec3> sums(counts.size(), glm::vec3(0.0F));
  std::vector<glm::vec3> slice(counts.size());
  const auto add = [&](std::uint32_t number) {
    gl_->GetTextureSubImage(layer, 0, 0, 0, static_cast<GLint>(number), size.x, size.y, 1, GL_RGB, GL_FLOAT,
                            static_cast<GLsizei>(slice.size() * sizeof(glm::vec3)), slice.data());
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += slice[i];
  };
  add(group);
  const core::CmIntegrator& integrator = picture.parameters_.integrator;
  const auto is_of = [&](std::uint32_t other) { return group == (other < groups ? other : 0); };
  if (with_background && is_of(integrator.sky_group)) add(groups);
  if (with_background && is_of(integrator.sun_group)) add(groups + 1);
  gl::check(*gl_, "reading back a light group");
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const glm::vec3 mean = sums[i] / static_cast<float>(std::max(1U, counts[i].x));
    std::memcpy(rgb + 3 * i, &mean, sizeof mean);
  }
}

void Tracer::read_volume(const Picture& picture, float* rgba) const { read_means(picture, film_layers::volume, rgba); }

namespace {

/// Header in front of the saved layers.
struct SavedHeader {
  std::uint32_t what = 0x41434d43;  // "CMCA"
  std::uint32_t format = 2;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t layers = 0;
  std::array<std::uint16_t, 4> box{};  // x, y, width and height of the region's pixels
  std::uint32_t spare = 0;
  bool operator==(const SavedHeader&) const = default;
};
static_assert(sizeof(SavedHeader) == 32);

/// Follows the layers of an adaptive picture, in front of Allotment::saved().
struct SavedPass {
  std::uint32_t target = 0;
};

/// Throws Error(invalid_argument) if the pass does not fit a picture with that many samples.
std::uint32_t saved_pass(std::span<const std::byte> saved, std::uint32_t target_samples) {
  SavedPass pass;
  std::memcpy(&pass, saved.data(), sizeof pass);
  if (pass.target < 1 || pass.target > target_samples)
    throw Error(ErrorCode::invalid_argument, "the accumulation was saved with another number of samples");
  return pass.target;
}

template <class SamplesOf>
Accumulated accumulated_of(glm::uvec2 size, SamplesOf&& samples_of) {
  Accumulated told;
  for (std::uint32_t y = 0; y < size.y; ++y) {
    for (std::uint32_t x = 0; x < size.x; ++x) {
      const std::uint32_t count = samples_of(glm::uvec2(x, y));
      told.least = std::min(told.least, count);
      told.most = std::max(told.most, count);
      told.all += count;
    }
  }
  return told;
}

SavedHeader header_of(const Picture& picture, std::size_t layers) {
  const glm::u16vec2 first(picture.box().first);
  const glm::u16vec2 extent(picture.box().size);
  SavedHeader header;
  header.width = picture.size().x;
  header.height = picture.size().y;
  header.layers = static_cast<std::uint32_t>(layers);
  header.box = {first.x, first.y, extent.x, extent.y};
  return header;
}

}  // namespace

template <class Visit>
void Tracer::for_each_saved(const Picture& picture, Visit&& visit) {
  std::size_t at = sizeof(SavedHeader);
  for (const FilmLayer& layer : accumulated(picture)) {
    const std::size_t size = std::size_t{picture.size_.x} * picture.size_.y * layer.pixel_bytes;
    visit(layer, at, size);
    at += size;
  }
}

std::size_t Tracer::saved_bytes(const Picture& picture) {
  std::size_t bytes = sizeof(SavedHeader);
  for_each_saved(picture, [&](const FilmLayer&, std::size_t, std::size_t size) { bytes += size; });
  return bytes + (picture.adaptive_ ? sizeof(SavedPass) + picture.allotment_.saved().size() : 0);
}

void Tracer::save(const Picture& picture, std::span<std::byte> bytes) const {
  const SavedHeader header = header_of(picture, accumulated(picture).size());
  std::memcpy(bytes.data(), &header, sizeof header);
  for_each_saved(picture, [&](const FilmLayer& layer, std::size_t at, std::size_t size) {
    const Transfer transfer = transfer_of(layer);
    gl_->GetTextureImage(picture.film_.texture(layer), 0, transfer.format, transfer.type, static_cast<GLsizei>(size),
                         bytes.data() + at);
  });
  if (picture.adaptive_) {
    const SavedPass pass{picture.pass_target_};
    const auto live = std::as_bytes(picture.allotment_.saved());
    std::ranges::copy(live, bytes.last(live.size()).begin());
    std::memcpy(bytes.last(live.size() + sizeof pass).data(), &pass, sizeof pass);
  }
  gl::check(*gl_, "reading the accumulation");
}

void Tracer::restore(Picture& picture, std::span<const std::byte> saved) {
  const SavedHeader wanted = header_of(picture, accumulated(picture).size());
  SavedHeader header;
  if (saved.size() >= sizeof header) std::memcpy(&header, saved.data(), sizeof header);
  if (saved.size() != saved_bytes(picture) || header != wanted)
    throw Error(ErrorCode::invalid_argument,
                "the data is not an accumulation of an image with this size, region and layers");
  std::vector<glm::uvec2> counts(std::size_t{picture.size_.x} * picture.size_.y);
  for_each_saved(picture, [&](const FilmLayer& layer, std::size_t at, std::size_t size) {
    if (layer == film_layers::counts) std::memcpy(counts.data(), saved.data() + at, size);
  });
  const auto samples_of = [&](glm::uvec2 pixel) {
    const glm::uvec2 at = picture.box_.first + pixel;
    return counts[std::size_t{at.y} * picture.size_.x + at.x].x;
  };
  const Accumulated told = accumulated_of(picture.box_.size, samples_of);
  const std::size_t squares = picture.allotment_.saved().size();
  std::optional<std::uint32_t> pass;
  if (picture.adaptive_) pass = saved_pass(saved.last(squares + sizeof(SavedPass)), picture.target_samples_);
  if (pass && std::ranges::any_of(saved.last(squares), [](std::byte live) { return live > std::byte{3}; }))
    throw Error(ErrorCode::invalid_argument, "the accumulation is corrupt: adaptive-sampling mask");
  if (told.most > picture.target_samples_) {
    throw Error(ErrorCode::invalid_argument, "the accumulation has pixels with " + std::to_string(told.most) +
                                                 " samples, but the image is limited to " +
                                                 std::to_string(picture.target_samples_));
  }
  if (picture.done_) return;
  for_each_saved(picture, [&](const FilmLayer& layer, std::size_t at, std::size_t) {
    const Transfer transfer = transfer_of(layer);
    const GLuint texture = picture.film_.texture(layer);
    const glm::ivec2 size(picture.size_);
    const std::byte* bytes = saved.data() + at;
    if (layer.slices > 0) {
      gl_->TextureSubImage3D(texture, 0, 0, 0, 0, size.x, size.y, static_cast<GLsizei>(layer.slices), transfer.format,
                             transfer.type, bytes);
    } else {
      gl_->TextureSubImage2D(texture, 0, 0, 0, size.x, size.y, transfer.format, transfer.type, bytes);
    }
  });
  gl::check(*gl_, "restoring the accumulation");
  picture.change_all(++revision_);
  if (pass) {
    std::vector<std::uint8_t> live(squares);
    std::memcpy(live.data(), saved.last(squares).data(), squares);
    picture.allotment_.restore(live, samples_of);
  }
  picture.go_on_from(told, pass);
}

template <class Visit>
void Tracer::for_each_error(const Picture& picture, Visit&& visit) const {
  const std::vector<glm::uvec2> counts = read_counts(picture);
  const auto background = texels<glm::vec3>(picture, film_layers::background, GL_RGB, GL_FLOAT);
  const auto squares = texels<float>(picture, film_layers::moments, GL_RED, GL_FLOAT);
  const auto sums = texels<glm::vec4>(picture, film_layers::radiance, GL_RGBA, GL_FLOAT);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    PixelError error;
    error.samples = counts[i].x;
    error.steps = counts[i].y;
    const double n = counts[i].x;
    if (n >= 2.0) {
      error.mean = luminance(glm::dvec3(sums[i]) / n + glm::dvec3(background[i]));
      error.squared = std::max(0.0, double(squares[i]) - error.mean * error.mean) / (n - 1.0);
    }
    visit(error);
  }
}

void Tracer::read_error(const Picture& picture, float* errors) const {
  for_each_error(picture, [&](const PixelError& error) {
    const bool known = error.samples >= 2;
    *errors++ = known ? static_cast<float>(std::sqrt(error.squared)) : std::numeric_limits<float>::infinity();
  });
}

Totals Tracer::totals(const Picture& picture) const {
  if (!picture.film_.has(film_layers::counts)) return {};
  Totals totals;
  ErrorSums sums;
  for_each_error(picture, [&](const PixelError& pixel) {
    totals.samples += pixel.samples;
    totals.steps += pixel.steps;
    if (pixel.samples < 2) return;
    sums += {pixel.squared, pixel.mean, 1.0};
  });
  totals.noise = sums.noise();
  return totals;
}

}  // namespace cumulet::render
