#include "render/tracer.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "base/error.hpp"

namespace cumulet::render {

namespace {

constexpr std::uint32_t tile_edge = 512;
constexpr std::size_t lane_bytes = 8 * 16;
constexpr double dispatch_ms = 1000.0;  // well under any driver's watchdog, well over the cost of a dispatch
constexpr std::uint32_t longest_pass = 64;

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

// A step through n rows that meets each once and lands far from the last: near n times the golden section, coprime to
// n.
std::uint32_t row_step(std::uint32_t rows) {
  auto step = std::max(1U, static_cast<std::uint32_t>(0.618 * rows));
  while (std::gcd(step, rows) != 1) ++step;
  return step;
}

}  // namespace

void Tracer::begin(const MarchData& data, const core::CmParameters& parameters, View view) {
  const glm::uvec4 image = parameters.image;
  std::vector<std::string> key = data.defines();
  key.emplace_back(view == View::shaded ? "trace.comp" : "inspect.comp");
  if (key != program_key_) {
    program_ = gl::make_compute_program(gl_, key.back(), std::span(key).first(key.size() - 1));
    program_key_ = key;
    iterations_ = 16.0;
  }
  if (!sum_ || image.x != width() || image.y != height()) {
    gl::Object sum = gl::make_texture_2d(gl_, GL_RGBA32F, static_cast<int>(image.x), static_cast<int>(image.y),
                                         "creating the accumulation texture");
    counts_ = gl::make_texture_2d(gl_, GL_RG32UI, static_cast<int>(image.x), static_cast<int>(image.y),
                                  "creating the sample counts");
    sum_ = std::move(sum);
  }
  tile_size_ = glm::min(glm::uvec2(image.x, image.y), glm::uvec2(tile_edge));
  tiles_ = (glm::uvec2(image.x, image.y) + tile_size_ - 1U) / tile_size_;
  const std::size_t lanes = std::size_t{tile_size_.x} * tile_size_.y;
  if (lanes > paths_lanes_) {
    paths_ = gl::make_buffer(gl_, lanes * lane_bytes, nullptr, 0, "creating the path buffer");
    paths_lanes_ = lanes;
  }
  if (!counter_) {
    counter_ = gl::make_buffer(gl_, 4, nullptr, GL_DYNAMIC_STORAGE_BIT, "creating the counter");
    uniforms_ = gl::make_buffer(gl_, sizeof(core::CmParameters), nullptr, GL_DYNAMIC_STORAGE_BIT, "creating uniforms");
  }
  parameters_ = parameters;
  data.describe(parameters_);
  view_ = view;
  if (view != View::shaded) parameters_.march.y = static_cast<std::uint32_t>(view);
  tile_ = 0;
  pass_begin_ = 0;
  pass_target_ = std::min(1U, image.w);
  tile_begins_ = true;
  done_ = false;
  unfinished_ = 1.0;
  const glm::vec4 zero(0.0F);
  const glm::uvec2 none(0U);
  gl_->ClearTexImage(sum_.name(), 0, GL_RGBA, GL_FLOAT, &zero);
  gl_->ClearTexImage(counts_.name(), 0, GL_RG_INTEGER, GL_UNSIGNED_INT, &none);
  gl::check(*gl_, "clearing the accumulation");
}

void Tracer::next_tile() {
  tile_begins_ = true;
  unfinished_ = 1.0;
  if (++tile_ < tiles_.x * tiles_.y) return;
  tile_ = 0;
  pass_begin_ = pass_target_;
  if (pass_target_ >= parameters_.image.w || view_ != View::shaded) {
    done_ = true;
  } else {
    // Twice as many each time: the first picture comes at once, and waiting for slow pixels at a pass's end costs
    // little.
    pass_target_ = std::min(parameters_.image.w, pass_target_ + std::min(pass_target_, longest_pass));
  }
}

bool Tracer::trace(const MarchData& data, double budget_ms) {
  const auto start = std::chrono::steady_clock::now();
  gl_->UseProgram(program_.name());
  data.bind(*gl_);
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, 0, uniforms_.name());
  gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, paths_.name());
  gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, counter_.name());
  gl_->BindImageTexture(0, sum_.name(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
  gl_->BindImageTexture(1, counts_.name(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_RG32UI);
  while (!done_) {
    const glm::uvec2 corner = glm::uvec2(tile_ % tiles_.x, tile_ / tiles_.x) * tile_size_;
    const glm::uvec2 size = glm::min(tile_size_, glm::uvec2(width(), height()) - corner);
    core::CmParameters parameters = parameters_;
    parameters.tile = {corner, size};
    parameters.image.w = pass_target_;
    parameters.order.x = row_step((size.y + 7) / 8);
    parameters.march.x = static_cast<std::uint32_t>(iterations_);
    parameters.march.w = tile_begins_ ? 1 : 0;
    const std::uint32_t zero = 0;
    gl_->NamedBufferSubData(uniforms_.name(), 0, sizeof(parameters), &parameters);
    gl_->NamedBufferSubData(counter_.name(), 0, 4, &zero);
    const auto dispatched = std::chrono::steady_clock::now();
    gl_->DispatchCompute((size.x + 7) / 8, (size.y + 7) / 8, 1);
    gl_->MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                       GL_BUFFER_UPDATE_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
    std::uint32_t unfinished = 0;
    gl_->GetNamedBufferSubData(counter_.name(), 0, 4, &unfinished);
    gl::check(*gl_, "tracing");
    const double spent = std::max(0.01, milliseconds_since(dispatched));
    const double aim = std::clamp(budget_ms, 1.0, dispatch_ms);
    // As few lanes remain, each may run longer; never more than twice as long as the last time.
    iterations_ = std::clamp(iterations_ * std::clamp(aim / spent, 0.25, 2.0), 4.0, 65536.0);
    tile_begins_ = false;
    unfinished_ = static_cast<double>(unfinished) / (double(size.x) * size.y);
    if (unfinished == 0) next_tile();
    if (milliseconds_since(start) >= budget_ms) break;
  }
  return done_;
}

double Tracer::progress() const {
  if (done_) return 1.0;
  if (view_ != View::shaded || parameters_.image.w == 0) return 0.0;
  const double in_tile = tile_begins_ ? 0.0 : 1.0 - unfinished_;
  const double in_pass = (tile_ + in_tile) / (double(tiles_.x) * tiles_.y);
  return (pass_begin_ + (pass_target_ - pass_begin_) * in_pass) / parameters_.image.w;
}

void Tracer::read(float* rgba) const {
  const std::size_t pixels = std::size_t{width()} * height();
  std::vector<glm::uvec2> counts(pixels);
  gl_->GetTextureImage(sum_.name(), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(pixels * 16), rgba);
  gl_->GetTextureImage(counts_.name(), 0, GL_RG_INTEGER, GL_UNSIGNED_INT, static_cast<GLsizei>(pixels * 8),
                       counts.data());
  gl::check(*gl_, "reading the image back");
  for (std::size_t i = 0; i < pixels; ++i) {
    const float scale = counts[i].x > 0 ? 1.0F / static_cast<float>(counts[i].x) : 0.0F;
    for (std::size_t c = 0; c < 4; ++c) rgba[4 * i + c] *= scale;
  }
}

Totals Tracer::totals() const {
  if (!counts_) return {};
  const std::size_t pixels = std::size_t{width()} * height();
  std::vector<glm::uvec2> counts(pixels);
  gl_->GetTextureImage(counts_.name(), 0, GL_RG_INTEGER, GL_UNSIGNED_INT, static_cast<GLsizei>(pixels * 8),
                       counts.data());
  Totals totals;
  for (const glm::uvec2& c : counts) {
    totals.samples += c.x;
    totals.steps += c.y;
  }
  return totals;
}

}  // namespace cumulet::render
