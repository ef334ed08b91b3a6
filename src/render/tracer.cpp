#include "render/tracer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>

#include "base/error.hpp"
#include "gl/state_guard.hpp"
#include "render/luminance.hpp"

namespace cumulet::render {

namespace {

constexpr std::uint32_t tile_edge = 512;
constexpr double hasty_rest = 0.03;     // of a tile's pixels
constexpr double dispatch_ms = 1000.0;  // well under any driver's watchdog, well over the cost of a dispatch
constexpr std::uint32_t longest_pass = 64;
constexpr std::uint32_t view_depth = 5;  // inspect.comp's
constexpr GLuint surface_unit = 11;
constexpr GLuint layer_colour_unit = 8;
constexpr GLuint layer_z_unit = 15;
constexpr double rays_of_facts = 16.0;  // aovs.comp's, a pixel

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// A step through n rows that meets each once and lands far from the last: near n times the golden section, coprime to
// n.
std::uint32_t row_step(std::uint32_t rows) {
  auto step = std::max(1U, static_cast<std::uint32_t>(0.618 * rows));
  while (std::gcd(step, rows) != 1) ++step;
  return step;
}

void describe(const Surfaces& surfaces, core::CmParameters& parameters) {
  parameters.surface = {surfaces.depth != 0 ? surfaces.layers : 0, surfaces.size, 0};
  if (surfaces.scene != nullptr) surfaces.scene->describe(parameters);
}

}  // namespace

double Picture::progress() const {
  if (done_) return 1.0;
  const double wanted = double(parameters_.image.w) * size_.x * size_.y;
  return view_ == View::shaded && wanted > 0.0 ? static_cast<double>(samples_) / wanted : 0.0;
}

void Picture::extend(std::uint32_t samples) {
  if (samples <= parameters_.image.w || view_ != View::shaded) return;
  // Lanes that are done for good begin again; so do the others' present samples, with the same result.
  if (done_ || tiles_ == glm::uvec2(1U)) {
    tile_ = 0;
    pass_target_ = tiles_ == glm::uvec2(1U)
                       ? samples
                       : std::min(samples, parameters_.image.w + std::clamp(parameters_.image.w, 1U, longest_pass));
    begin_tile();
  }
  parameters_.image.w = samples;
  done_ = false;
}

void Picture::begin_tile() {
  windows_.clear();
  window_ = 0;
  const glm::uvec2 extent = tile_extent();
  for (std::uint32_t row = 0; row < extent.y; row += window_rows_) {
    const std::uint32_t end = std::min(extent.y, row + window_rows_);
    windows_.push_back({row, end, (end - row) * extent.x, (end - row) * extent.x, true});
  }
}

// Whether the tile, the pass, the picture end with what the last dispatch did.
void Picture::end_dispatch() {
  std::uint64_t unfinished = 0;
  std::uint64_t empty = 0;
  bool begun = true;
  for (const Window& window : windows_) {
    begun = begun && !window.begins;
    unfinished += window.unfinished;
    empty += window.empty;
  }
  const glm::uvec2 extent = tile_extent();
  const auto rest = hasty_ && !complete_ && begun ? static_cast<std::uint64_t>(hasty_rest * extent.x * extent.y) : 0;
  const bool one_tile = tiles_ == glm::uvec2(1U);
  if (one_tile && empty <= rest) complete_ = true;
  holes_ = one_tile ? empty > 0 : hasty_ && pass_ < 2;
  // The last few of a hasty first pass are left to the next.
  const bool first_pass = pass_target_ == 1 && parameters_.image.w > 1;
  if (unfinished > (first_pass ? rest : 0)) {
    do window_ = (window_ + 1) % windows_.size();
    while (windows_[window_].unfinished == 0);
    return;
  }
  if (++tile_ == tiles_.x * tiles_.y) {
    tile_ = 0;
    complete_ = true;
    ++pass_;
    const std::uint32_t target = parameters_.image.w;
    if (pass_target_ >= target || view_ != View::shaded) {
      done_ = true;
    } else {
      // Twice as many each time: the first picture comes at once, and waiting for slow pixels at a pass's end costs
      // little.
      pass_target_ = std::min(target, pass_target_ + std::min(pass_target_, longest_pass));
    }
  }
  if (!done_) begin_tile();
}

std::uint64_t Picture::bytes() const {
  const std::uint64_t pixel =
      (sum_ ? 32U : 0U) + (volume_z_ ? 4U : 0U) + (volume_sum_ ? 16U : 0U) + (facts_ ? 36U : 0U);
  return std::uint64_t{size_.x} * size_.y * pixel + layers_.bytes();
}

GLuint Tracer::program(const MarchData& data, const char* name, std::span<const std::string> more) {
  std::vector<std::string> key = data.defines();
  key.insert(key.end(), more.begin(), more.end());
  key.emplace_back(name);
  auto found = programs_.find(key);
  if (found == programs_.end()) {
    gl::Object made = gl::make_compute_program(gl_, name, std::span(key).first(key.size() - 1));
    // Those of one march at most: a host that tries them all shall not collect them.
    if (programs_.size() >= 8) programs_.clear();
    found = programs_.emplace(std::move(key), std::move(made)).first;
    iterations_ = 16.0;
  }
  return found->second.name();
}

GLuint Tracer::trace_program(const Picture& picture, const MarchData& data) {
  std::vector<std::string> more;
  if (picture.traced_ > 0) more.emplace_back(picture.traced_ > 1 ? "CM_SURFACES 2" : "CM_SURFACES 1");
  if (picture.traced_ == 0 && picture.layered_ != Layered::no) more.emplace_back("CM_LAYERS 1");
  if (picture.volume_alone_) more.emplace_back("CM_AOVS 1");
  return program(data, "trace.comp", more);
}

GLuint Tracer::inspect_program(const MarchData& data, const Surfaces& surfaces, const char* name) {
  const std::array<std::string, 1> more{"CM_SURFACES 1"};
  return program(data, name, std::span(more).first(surfaces.scene != nullptr ? 1 : 0));
}

void Tracer::make_shared_objects() {
  if (!counter_)
    counter_ = gl::make_buffer(gl_, sizeof(glm::uvec3), nullptr, GL_DYNAMIC_STORAGE_BIT, "creating the counter");
  if (!uniforms_)
    uniforms_ = gl::make_buffer(gl_, sizeof(core::CmParameters), nullptr, GL_DYNAMIC_STORAGE_BIT, "creating uniforms");
}

void Tracer::allocate(Picture& picture, glm::uvec2 size) const {
  const int width = static_cast<int>(size.x);
  const int height = static_cast<int>(size.y);
  gl::Object sum = gl::make_texture_2d(gl_, GL_RGBA32F, width, height, "creating the accumulation texture");
  gl::Object counts = gl::make_texture_2d(gl_, GL_RGBA32UI, width, height, "creating the sample counts");
  picture.sum_ = std::move(sum);
  picture.counts_ = std::move(counts);
  picture.volume_z_ = {};
  picture.volume_sum_ = {};
  picture.facts_.reset();
  picture.size_ = size;
}

void Tracer::draw_layers(Picture& picture, const Surfaces& surfaces, const PictureSettings& settings) {
  // The surface pass leaves any state it likes; what comes after it in the frame counts on the known one.
  struct Known {
    const gl::Functions& gl;
    explicit Known(const gl::Functions& functions) : gl(functions) {}
    ~Known() { const gl::StateGuard known(gl, false); }
    Known(const Known&) = delete;
    Known& operator=(const Known&) = delete;
  };
  const Known known(*gl_);
  picture.layered_ = Layered::no;
  const auto start = Clock::now();
  const glm::uvec2 size = settings.layer_size;
  surfaces.raster->draw(surfaces.view, surfaces.lighting, size, settings.layers, picture.layers_);
  gl_->Finish();
  const double pixels = double(size.x) * size.y * settings.layers;
  raster_rate_ += 0.3 * (pixels / std::max(1e-3, milliseconds_since(start)) - raster_rate_);
  picture.layered_ = settings.layered;
}

void Tracer::begin(Picture& picture, const MarchData& data, const core::CmParameters& parameters,
                   const Surfaces& surfaces, const PictureSettings& settings) {
  const glm::uvec2 size(parameters.image);
  const bool shaded = settings.view == View::shaded;
  make_shared_objects();
  const glm::uvec2 tile = glm::min(size, glm::uvec2(tile_edge));
  const std::size_t lanes = std::size_t{tile.x} * tile.y;
  if (shaded && lanes > paths_lanes_) {
    paths_ = {};
    paths_lanes_ = 0;
    paths_ = gl::make_buffer(gl_, lanes * lane_bytes, nullptr, 0, "creating the path buffer");
    paths_lanes_ = lanes;
  }
  if (!picture.sum_ || size != picture.size_) allocate(picture, size);
  picture.complete_ = false;
  picture.facts_.reset();
  const SurfaceData* met = shaded ? surfaces.met() : nullptr;
  picture.traced_ = met == nullptr ? 0 : (met->emitters() ? 2 : 1);
  picture.layered_ = Layered::no;
  if (shaded && settings.layered != Layered::no && surfaces.raster != nullptr) {
    draw_layers(picture, surfaces, settings);
  } else {
    picture.layers_ = {};
  }
  picture.volume_alone_ = shaded && settings.volume_alone;
  if (!picture.volume_alone_) {
    picture.volume_sum_ = {};
  } else if (!picture.volume_sum_) {
    picture.volume_sum_ = gl::make_texture_2d(gl_, GL_RGBA32F, static_cast<int>(size.x), static_cast<int>(size.y),
                                              "creating the sum of the volume alone");
  }
  if (shaded) {
    trace_program(picture, data);
  } else {
    inspect_program(data, surfaces, "inspect.comp");
  }
  picture.parameters_ = parameters;
  data.describe(picture.parameters_);
  describe(surfaces, picture.parameters_);
  if (picture.layered_ != Layered::no) {
    const SurfaceLayers& layers = picture.layers_;
    picture.parameters_.layers = {layers.layers, layers.size,
                                  (layers.blended ? 1U : 0U) | (picture.layered_ == Layered::within ? 2U : 0U)};
  }
  picture.view_ = settings.view;
  if (!shaded) picture.parameters_.march.y = static_cast<std::uint32_t>(settings.view);
  picture.tile_size_ = tile;
  picture.tiles_ = (size + tile - 1U) / tile;
  // A window's shortest dispatch should fit the budget: its lanes each run some dozens of steps.
  const double lanes_in_budget = 0.5 * rate_ * settings.budget_ms;
  picture.window_rows_ =
      static_cast<std::uint32_t>(std::clamp(lanes_in_budget / tile.x, 8.0, double(tile_edge))) / 8U * 8U;
  picture.tile_ = 0;
  picture.hasty_ = settings.hasty;
  picture.pass_ = 0;
  picture.holes_ = true;
  picture.pass_target_ = picture.tiles_ == glm::uvec2(1U) ? picture.parameters_.image.w : 1U;
  picture.samples_ = 0;
  picture.complete_ = false;
  picture.done_ = false;
  picture.begin_tile();
  picture.depth_row_ = 0;
  picture.depth_done_ = false;
  const glm::vec4 zero(0.0F);
  const glm::uvec4 none(0U);
  gl_->ClearTexImage(picture.sum_.name(), 0, GL_RGBA, GL_FLOAT, &zero);
  gl_->ClearTexImage(picture.counts_.name(), 0, GL_RGBA_INTEGER, GL_UNSIGNED_INT, &none);
  if (picture.volume_sum_) gl_->ClearTexImage(picture.volume_sum_.name(), 0, GL_RGBA, GL_FLOAT, &zero);
  gl::check(*gl_, "clearing the accumulation");
}

void Tracer::clear(Picture& picture) {
  allocate(picture, glm::uvec2(1));
  picture.layered_ = Layered::no;
  picture.layers_ = {};
  picture.parameters_ = {};
  picture.view_ = View::shaded;
  picture.complete_ = picture.done_ = true;
  picture.holes_ = false;
  const glm::vec4 zero(0.0F);
  const glm::uvec4 one(1U, 0U, 0U, 0U);
  gl_->ClearTexImage(picture.sum_.name(), 0, GL_RGBA, GL_FLOAT, &zero);
  gl_->ClearTexImage(picture.counts_.name(), 0, GL_RGBA_INTEGER, GL_UNSIGNED_INT, &one);
  gl::check(*gl_, "making the empty picture");
}

void Tracer::bind(const MarchData& data, const Surfaces& surfaces) const {
  data.bind(*gl_);
  if (surfaces.depth != 0) gl_->BindTextureUnit(surface_unit, surfaces.depth);
  if (surfaces.scene != nullptr) surfaces.scene->bind(*gl_);
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, 0, uniforms_.name());
}

bool Tracer::trace(Picture& picture, const MarchData& data, const Surfaces& surfaces, Deadline deadline,
                   bool until_complete) {
  if (picture.done_) return true;
  const auto start = Clock::now();
  const double budget_ms = std::max(0.0, std::chrono::duration<double, std::milli>(deadline - start).count());
  const std::uint64_t samples_before = picture.samples_;
  gl_->UseProgram(picture.view_ == View::shaded ? trace_program(picture, data)
                                                : inspect_program(data, surfaces, "inspect.comp"));
  bind(data, surfaces);
  if (picture.layered_ != Layered::no) {
    gl_->BindTextureUnit(layer_colour_unit, picture.layers_.colour.name());
    gl_->BindTextureUnit(layer_z_unit, picture.layers_.z.name());
  }
  if (paths_) gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, paths_.name());
  gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, counter_.name());
  gl_->BindImageTexture(0, picture.sum_.name(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
  gl_->BindImageTexture(1, picture.counts_.name(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32UI);
  // What is bound shall fit the format, though this view does not write it.
  gl_->BindImageTexture(2, picture.volume_sum_.name(), 0, GL_FALSE, 0, GL_READ_WRITE,
                        picture.volume_sum_ ? GL_RGBA32F : GL_R32F);
  const double aim = std::clamp(0.5 * budget_ms, 1.0, dispatch_ms);
  while (!picture.done_ && !(until_complete && picture.complete_)) {
    dispatch(picture, surfaces, aim);
    if (Clock::now() >= deadline) break;
  }
  if (picture.view_ == View::shaded) {
    const auto samples = static_cast<double>(picture.samples_ - samples_before);
    const double spent = milliseconds_since(start);
    if (spent > 0.5) rate_ = std::max(1.0, rate_ + 0.1 * (samples / spent - rate_));
  }
  return picture.done_;
}

void Tracer::dispatch(Picture& picture, const Surfaces& surfaces, double aim_ms) {
  const glm::uvec2 extent = picture.tile_extent();
  Picture::Window& window = picture.windows_[picture.window_];
  const bool shaded = picture.view_ == View::shaded;
  core::CmParameters parameters = picture.parameters_;
  describe(surfaces, parameters);
  parameters.tile = {picture.tile_corner(), extent};
  parameters.image.w = picture.pass_target_;
  const std::uint32_t groups = (window.end - window.first + 7) / 8;
  parameters.order = {row_step(groups), 0U, window.first, window.end};
  parameters.march.x = static_cast<std::uint32_t>(iterations_);
  parameters.march.w = window.begins ? 1 : 0;
  glm::uvec3 counter(0U);
  gl_->NamedBufferSubData(uniforms_.name(), 0, sizeof(parameters), &parameters);
  gl_->NamedBufferSubData(counter_.name(), 0, sizeof(counter), &counter);
  const auto dispatched = Clock::now();
  gl_->DispatchCompute((extent.x + 7) / 8, groups, 1);
  gl_->MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT |
                     GL_TEXTURE_UPDATE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
  gl_->GetNamedBufferSubData(counter_.name(), 0, sizeof(counter), &counter);
  gl::check(*gl_, "tracing");
  window.begins = false;
  window.unfinished = counter.x;
  window.empty = counter.y;
  picture.samples_ += shaded ? counter.z : extent.x * (window.end - window.first);
  if (shaded) {
    // As few lanes remain, each may run longer; never more than twice as long as the last time.
    const double spent = std::max(0.01, milliseconds_since(dispatched));
    iterations_ = std::clamp(iterations_ * std::clamp(aim_ms / spent, 0.25, 2.0), 4.0, 65536.0);
  }
  picture.end_dispatch();
}

bool Tracer::inspect(const Picture& picture, const core::CmParameters& parameters, double rays, std::uint32_t& row,
                     Deadline deadline) {
  core::CmParameters p = parameters;
  // Rows that a camera ray a pixel takes about a millisecond for.
  const double in_a_millisecond = rate_ / (rays * picture.size_.x);
  const auto rows = static_cast<std::uint32_t>(std::clamp(in_a_millisecond, 8.0, 512.0)) / 8U * 8U;
  while (row < picture.size_.y) {
    const std::uint32_t height = std::min(rows, picture.size_.y - row);
    p.tile = {0U, 0U, picture.size_};
    p.order = {0U, 0U, row, row + height};
    gl_->NamedBufferSubData(uniforms_.name(), 0, sizeof(p), &p);
    gl_->DispatchCompute((picture.size_.x + 7) / 8, (height + 7) / 8, 1);
    gl_->MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    gl_->Finish();
    gl::check(*gl_, "looking at the pixels");
    row += height;
    if (Clock::now() >= deadline) break;
  }
  return row >= picture.size_.y;
}

bool Tracer::trace_depth(Picture& picture, const MarchData& data, const Surfaces& surfaces, Deadline deadline) {
  if (picture.depth_done_) return true;
  if (!picture.volume_z_) {
    picture.volume_z_ = gl::make_texture_2d(gl_, GL_R32F, static_cast<int>(picture.size_.x),
                                            static_cast<int>(picture.size_.y), "creating the depth texture");
  }
  make_shared_objects();
  gl_->UseProgram(inspect_program(data, surfaces, "inspect.comp"));
  bind(data, surfaces);
  gl_->BindImageTexture(0, picture.sum_.name(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
  gl_->BindImageTexture(1, picture.counts_.name(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32UI);
  gl_->BindImageTexture(2, picture.volume_z_.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_R32F);
  core::CmParameters parameters = picture.parameters_;
  describe(surfaces, parameters);
  parameters.march.y = view_depth;
  picture.depth_done_ = inspect(picture, parameters, 1.0, picture.depth_row_, deadline);
  return picture.depth_done_;
}

void Tracer::find_facts(Picture& picture, const MarchData& data, const Surfaces& surfaces) {
  if (picture.facts_) return;
  const int width = static_cast<int>(picture.size_.x);
  const int height = static_cast<int>(picture.size_.y);
  constexpr const char* what = "creating the textures of what is known of pixels";
  Picture::Facts facts{gl::make_texture_2d(gl_, GL_RGBA32F, width, height, what),
                       gl::make_texture_2d(gl_, GL_RGBA32UI, width, height, what),
                       gl::make_texture_2d(gl_, GL_R32F, width, height, what)};
  make_shared_objects();
  gl_->UseProgram(inspect_program(data, surfaces, "aovs.comp"));
  bind(data, surfaces);
  gl_->BindImageTexture(0, facts.normal.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  gl_->BindImageTexture(1, facts.albedo.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32UI);
  gl_->BindImageTexture(2, facts.volume_z.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_R32F);
  core::CmParameters parameters = picture.parameters_;
  describe(surfaces, parameters);
  std::uint32_t row = 0;
  inspect(picture, parameters, rays_of_facts, row, Deadline::max());
  picture.facts_ = std::move(facts);
}

void Tracer::read_fact(Picture& picture, const MarchData& data, const Surfaces& surfaces, PixelFact fact,
                       float* values) {
  find_facts(picture, data, surfaces);
  const std::size_t pixels = std::size_t{picture.size_.x} * picture.size_.y;
  if (fact == PixelFact::volume_z) {
    gl_->GetTextureImage(picture.facts_->volume_z.name(), 0, GL_RED, GL_FLOAT, static_cast<GLsizei>(pixels * 4),
                         values);
    gl::check(*gl_, "reading what is known of pixels");
    return;
  }
  std::vector<glm::vec4> texels(pixels);
  const auto bytes = static_cast<GLsizei>(pixels * sizeof(glm::vec4));
  if (fact == PixelFact::normal || fact == PixelFact::transmittance) {
    gl_->GetTextureImage(picture.facts_->normal.name(), 0, GL_RGBA, GL_FLOAT, bytes, texels.data());
  } else {
    gl_->GetTextureImage(picture.facts_->albedo.name(), 0, GL_RGBA_INTEGER, GL_UNSIGNED_INT, bytes, texels.data());
  }
  gl::check(*gl_, "reading what is known of pixels");
  const std::size_t channels = channels_of(fact);
  for (std::size_t i = 0; i < pixels; ++i) {
    if (channels == 1) {
      values[i] = texels[i].w;
    } else {
      for (int c = 0; c < 3; ++c) values[3 * i + static_cast<std::size_t>(c)] = texels[i][c];
    }
  }
}

float Tracer::pick(const MarchData& data, const core::CmParameters& parameters, const Surfaces& surfaces,
                   glm::uvec2 pixel) {
  make_shared_objects();
  if (!pick_) pick_ = gl::make_texture_2d(gl_, GL_R32F, 1, 1, "creating the texture to pick by");
  core::CmParameters p = parameters;
  data.describe(p);
  describe(surfaces, p);
  p.march.y = view_depth;
  p.tile = {pixel, 1U, 1U};
  p.order = {0U, 1U, 0U, 1U};  // into the texture's one pixel
  gl_->UseProgram(inspect_program(data, surfaces, "inspect.comp"));
  bind(data, surfaces);
  gl_->BindImageTexture(0, 0, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  gl_->BindImageTexture(1, 0, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32UI);
  gl_->BindImageTexture(2, pick_.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_R32F);
  gl_->NamedBufferSubData(uniforms_.name(), 0, sizeof(p), &p);
  gl_->DispatchCompute(1, 1, 1);
  gl_->MemoryBarrier(GL_TEXTURE_UPDATE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  float z = 0.0F;
  gl_->GetTextureImage(pick_.name(), 0, GL_RED, GL_FLOAT, sizeof(z), &z);
  gl::check(*gl_, "picking");
  return z;
}

void Tracer::read(const Picture& picture, float* rgba) const { read_means(picture, picture.sum_.name(), rgba); }

void Tracer::read_means(const Picture& picture, GLuint sum, float* rgba) const {
  const std::size_t pixels = std::size_t{picture.size_.x} * picture.size_.y;
  std::vector<glm::uvec4> counts(pixels);
  gl_->GetTextureImage(sum, 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(pixels * 16), rgba);
  gl_->GetTextureImage(picture.counts_.name(), 0, GL_RGBA_INTEGER, GL_UNSIGNED_INT, static_cast<GLsizei>(pixels * 16),
                       counts.data());
  gl::check(*gl_, "reading the picture back");
  for (std::size_t i = 0; i < pixels; ++i) {
    const float scale = counts[i].x > 0 ? 1.0F / static_cast<float>(counts[i].x) : 0.0F;
    for (std::size_t c = 0; c < 4; ++c) rgba[4 * i + c] *= scale;
  }
}

void Tracer::read_volume(const Picture& picture, float* rgba) const {
  read_means(picture, picture.volume_sum_.name(), rgba);
}

Totals Tracer::totals(const Picture& picture) const {
  if (!picture.counts_) return {};
  const std::size_t pixels = std::size_t{picture.size_.x} * picture.size_.y;
  std::vector<glm::uvec4> counts(pixels);
  std::vector<glm::vec4> sums(pixels);
  gl_->GetTextureImage(picture.sum_.name(), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(pixels * 16), sums.data());
  gl_->GetTextureImage(picture.counts_.name(), 0, GL_RGBA_INTEGER, GL_UNSIGNED_INT, static_cast<GLsizei>(pixels * 16),
                       counts.data());
  gl::check(*gl_, "reading the sample counts back");
  Totals totals;
  const double sky = luminance(glm::dvec3(picture.parameters_.sky_radiance));
  double error = 0.0;
  double brightness = 0.0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const double n = counts[i].x;
    totals.samples += counts[i].x;
    totals.steps += counts[i].y;
    if (n < 2.0) continue;
    float square = 0.0F;
    std::memcpy(&square, &counts[i].z, sizeof(square));
    const double mean = (luminance(glm::dvec3(sums[i])) + (n - double(sums[i].w)) * sky) / n;
    error += std::max(0.0, double(square) / n - mean * mean) / (n - 1.0);
    brightness += mean;
  }
  if (brightness > 0.0) totals.noise = std::sqrt(error / double(pixels)) / (brightness / double(pixels));
  return totals;
}

}  // namespace cumulet::render
