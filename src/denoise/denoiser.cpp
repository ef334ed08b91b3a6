#include "denoise/denoiser.hpp"

#include <algorithm>
#include <glm/gtc/packing.hpp>
#include <string>
#include <utility>

#include "gl/bindings.hpp"
#include "shader_macros.hpp"

namespace cumulet::denoise {

namespace {

constexpr std::uint32_t quad_channels = 4;
constexpr std::uint32_t taps = 9;
constexpr std::uint32_t group_side = 16;       // pixels per side of a convolution work group
constexpr std::uint32_t input_group_side = 8;  // pixels per side of an input work group
constexpr std::uint32_t bin_side = 16;
constexpr std::uint32_t max_groups = 65535;  // the minimum that GL guarantees
// Approximate multiply-adds per pixel of the other kernels.
constexpr double bin_cost = 30.0;
constexpr double input_cost = 200.0;

/// Output channels of a work group, in units of four; the last convolution has only three channels.
std::uint32_t quads_of(std::size_t convolution) {
  return convolution + 1 == Network::convolution_count ? 1 : group_channels / quad_channels;
}

/// Converts a position in the padded image to the image.
glm::ivec2 in_picture(glm::uvec2 position) { return glm::ivec2(position) - static_cast<int>(rim); }

std::uint32_t groups_of(const Network& network, std::size_t convolution) {
  return divided_up(network.convolutions.at(convolution).outputs, quads_of(convolution) * quad_channels);
}

std::uint32_t blocks_of(const Network& network, const Source& source) {
  return source.convolution ? result_blocks(network.convolutions.at(*source.convolution)) : input_blocks(network);
}

std::uint32_t blocks_of(const Network& network, const Convolution& convolution) {
  std::uint32_t blocks = 0;
  for (const Source& source : convolution.sources) blocks += blocks_of(network, source);
  return blocks;
}

/// Packs the weights of a convolution in the order of denoise_convolution.comp; a uvec2 holds four halves.
class WeightPacker {
 public:
  explicit WeightPacker(const Network& network) : network_(network) {}

  std::uint32_t add(std::size_t index) {
    const auto at = static_cast<std::uint32_t>(words_.size());
    const Convolution& convolution = network_.convolutions.at(index);
    const std::uint32_t quads = quads_of(index);
    for (std::uint32_t group = 0; group < groups_of(network_, index); ++group) {
      const std::uint32_t first = group * quads * quad_channels;
      for (std::uint32_t quad = 0; quad < quads; ++quad) {
        add_quad([&](std::uint32_t k) { return at_or_zero(convolution.biases, first + quad * quad_channels + k); });
      }
      std::uint32_t input = 0;  // channels before this source
      for (const Source& source : convolution.sources) {
        const std::uint32_t inputs =
            source.convolution ? network_.convolutions.at(*source.convolution).outputs : network_.inputs;
        for (std::uint32_t channel = 0; channel < blocks_of(network_, source) * block_channels; ++channel) {
          for (std::uint32_t tap = 0; tap < taps * quads; ++tap) {
            const std::uint32_t output = first + tap % quads * quad_channels;
            add_quad([&](std::uint32_t k) {
              if (channel >= inputs || output + k >= convolution.outputs) return 0.0F;
              const std::size_t row = std::size_t{output + k} * convolution.inputs + input + channel;
              return convolution.weights.at(row * taps + tap / quads);
            });
          }
        }
        input += inputs;
      }
    }
    return at;
  }

  [[nodiscard]] const std::vector<glm::uvec2>& words() const { return words_; }

 private:
  static float at_or_zero(const std::vector<float>& values, std::uint32_t i) {
    return i < values.size() ? values[i] : 0.0F;
  }
  template <class Value>
  void add_quad(const Value& value) {
    words_.emplace_back(glm::packHalf2x16({value(0), value(1)}), glm::packHalf2x16({value(2), value(3)}));
  }

  const Network& network_;
  std::vector<glm::uvec2> words_;
};

}  // namespace

Denoiser::Denoiser(gl::FunctionsPtr gl, gl::ProgramsPtr programs, NetworkPtr network, std::uint64_t max_bytes)
    : gl_(std::move(gl)), programs_(std::move(programs)), network_(std::move(network)), max_bytes_(max_bytes) {
  WeightPacker packer(*network_);
  for (std::size_t i = 0; i < Network::convolution_count; ++i) weights_at_.at(i) = packer.add(i);
  weights_bytes_ = packer.words().size() * sizeof(glm::uvec2);
  weights_ = gl::make_buffer(gl_, weights_bytes_, packer.words().data(), 0, "creating the denoiser's weights");
  sampler_ = gl::make_sampler(gl_);
}

void Denoiser::begin(const Pictures& pictures) {
  pictures_ = pictures;
  stages_.clear();
  stage_ = 0;
  group_ = 0;
  done_ = 0.0;
  total_ = 0.0;
  tiles_.clear();
  if (pictures.size.x == 0 || pictures.size.y == 0) return;

  bin_count_ = {divided_up(pictures.size.x, bin_side), divided_up(pictures.size.y, bin_side)};
  const std::uint64_t bins_bytes = (std::uint64_t{bin_count_.x} * bin_count_.y + 1) * sizeof(glm::vec2);
  if (bins_bytes > bins_bytes_) {
    bins_ = {};
    bins_bytes_ = 0;
    bins_ = gl::make_buffer(gl_, bins_bytes, nullptr, 0, "creating the denoiser's bins");
    bins_bytes_ = bins_bytes;
  }

  // Memory per pixel, measured on a tile large enough to be representative.
  constexpr std::uint32_t side = 1024;
  const double pixel_bytes = double(memory_of(*network_, glm::uvec2(side)).size) * sizeof(glm::uvec4) / (side * side);
  const std::uint64_t other_bytes = weights_bytes_ + bins_bytes_;
  const std::uint64_t room =
      std::min<std::uint64_t>(max_bytes_ - std::min(max_bytes_, other_bytes),
                              static_cast<std::uint64_t>(gl::query_limits(*gl_).storage_block_bytes));
  tiles_ = tiles_of(pictures.size + 2 * rim, static_cast<std::uint64_t>(static_cast<double>(room) / pixel_bytes));
  glm::uvec2 largest(0U);
  for (const Tile& tile : tiles_) largest = glm::max(largest, tile.size);
  memory_ = memory_of(*network_, largest);
  const std::uint64_t channels_bytes = std::uint64_t{memory_.size} * sizeof(glm::uvec4);
  if (channels_bytes > channels_bytes_) {
    channels_ = {};
    channels_bytes_ = 0;
    channels_ = gl::make_buffer(gl_, channels_bytes, nullptr, 0, "creating the denoiser's channels");
    channels_bytes_ = channels_bytes;
  }
  add_stages();
}

void Denoiser::add_stages() {
  using Kind = Stage::Kind;
  stages_.push_back({Kind::bins, 0, 0, bin_count_.x * bin_count_.y, bin_cost * bin_side * bin_side});
  stages_.push_back({Kind::exposure, 0, 0, 1, bin_cost * bin_count_.x * bin_count_.y});
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    const glm::uvec2 size = tiles_[t].size;
    const glm::uvec2 input_groups = size / input_group_side;
    stages_.push_back(
        {Kind::input, t, 0, input_groups.x * input_groups.y, input_cost * input_group_side * input_group_side});
    for (std::size_t i = 0; i < Network::convolution_count; ++i) {
      const Convolution& convolution = network_->convolutions.at(i);
      const glm::uvec2 at_level = size >> convolution.level;
      const std::uint32_t work_groups = divided_up(at_level.x, group_side) * divided_up(at_level.y, group_side);
      const double each = double(group_side * group_side * taps) * quads_of(i) * quad_channels *
                          blocks_of(*network_, convolution) * block_channels;
      stages_.push_back({Kind::convolution, t, i, work_groups * groups_of(*network_, i), each});
    }
  }
  for (const Stage& stage : stages_) total_ += stage.groups * stage.multiply_adds_each;
}

gl::ProgramKey Denoiser::key_of(const Stage& stage) const {
  switch (stage.kind) {
    case Stage::Kind::bins:
      return {"denoise_exposure.comp", {gl::macros::stage(0)}};
    case Stage::Kind::exposure:
      return {"denoise_exposure.comp", {gl::macros::stage(1)}};
    case Stage::Kind::input:
      return {"denoise_input.comp", {gl::macros::guides(network_->inputs > 3)}};
    case Stage::Kind::convolution:
      break;
  }
  if (stage.convolution + 1 == Network::convolution_count) return {"denoise_convolution.comp", {gl::macros::result(2)}};
  const bool pooled = network_->convolutions.at(stage.convolution).pooled;
  return {"denoise_convolution.comp", {gl::macros::result(pooled)}};
}

void Denoiser::build() const {
  for (const Stage& stage : stages_) programs_->get(key_of(stage));
}

void Denoiser::bind() const {
  const gl::Functions& gl = *gl_;
  const auto texture = [&](GLuint unit, GLuint name) {
    gl.BindTextureUnit(unit, name);
    gl.BindSampler(unit, sampler_.name());
  };
  texture(core::CM_UNIT_DENOISE_COLOR, pictures_.color);
  if (network_->inputs > 3) {
    texture(core::CM_UNIT_DENOISE_ALBEDO, pictures_.albedo);
    texture(core::CM_UNIT_DENOISE_NORMAL, pictures_.normal);
  }
  gl.BindImageTexture(core::CM_IMAGE_DENOISED, pictures_.denoised, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_DENOISE_BINS, bins_.name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_DENOISE_CHANNELS, channels_.name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_DENOISE_WEIGHTS, weights_.name());
}

void Denoiser::set_input(GLuint program, const Tile& tile) const {
  gl_->ProgramUniform1ui(program, 1, tile.size.x);
  gl_->ProgramUniform1ui(program, 2, tile.size.y);
  const glm::ivec2 begin = in_picture(tile.begin);
  gl_->ProgramUniform2i(program, 3, begin.x, begin.y);
  gl_->ProgramUniform1ui(program, 4, memory_.input);
}

void Denoiser::set_convolution(GLuint program, const Tile& tile, std::size_t index) const {
  const gl::Functions& gl = *gl_;
  const Convolution& convolution = network_->convolutions.at(index);
  gl.ProgramUniform1ui(program, 1, tile.size.x >> convolution.level);
  gl.ProgramUniform1ui(program, 2, tile.size.y >> convolution.level);
  gl.ProgramUniform1ui(program, 3, groups_of(*network_, index));
  gl.ProgramUniform1ui(program, 4, weights_at_.at(index));
  const auto offset_of = [&](const Source& source) {
    return source.convolution ? memory_.results.at(*source.convolution) : memory_.input;
  };
  const Source& first = convolution.sources.front();
  gl.ProgramUniform1ui(program, 6, offset_of(first));
  gl.ProgramUniform1ui(program, 7, blocks_of(*network_, first));
  if (index + 1 == Network::convolution_count) {
    const glm::ivec2 begin = in_picture(tile.begin);
    const glm::ivec2 keep_begin = glm::max(in_picture(tile.keep_begin), 0);
    const glm::ivec2 keep_end = glm::min(in_picture(tile.keep_end), glm::ivec2(pictures_.size));
    gl.ProgramUniform2i(program, 11, begin.x, begin.y);
    gl.ProgramUniform2i(program, 12, keep_begin.x, keep_begin.y);
    gl.ProgramUniform2i(program, 13, keep_end.x, keep_end.y);
  } else {
    gl.ProgramUniform1ui(program, 5, memory_.results.at(index));
  }
  const bool two = convolution.sources.size() > 1;
  gl.ProgramUniform1ui(program, 8, first.enlarged ? 1 : 0);
  gl.ProgramUniform1ui(program, 9, two ? offset_of(convolution.sources.back()) : 0);
  gl.ProgramUniform1ui(program, 10, two ? blocks_of(*network_, convolution.sources.back()) : 0);
}

bool Denoiser::step(double multiply_adds) {
  if (stage_ == stages_.size()) return true;
  const gl::DebugGroup group(*gl_, "cumulet: denoise network");
  const Stage& stage = stages_[stage_];
  const gl::Program& program = programs_->ask(key_of(stage));
  if (!program.usable()) return false;
  const double fit = std::clamp(multiply_adds / stage.multiply_adds_each, 1.0, double{max_groups});
  const std::uint32_t count = std::min(static_cast<std::uint32_t>(fit), stage.groups - group_);
  bind();
  const GLuint name = program.name();
  switch (stage.kind) {
    case Stage::Kind::bins:
    case Stage::Kind::exposure:
      gl_->ProgramUniform1ui(name, 1, bin_count_.x);
      gl_->ProgramUniform1ui(name, 2, bin_count_.y);
      break;
    case Stage::Kind::input:
      set_input(name, tiles_[stage.tile]);
      break;
    case Stage::Kind::convolution:
      set_convolution(name, tiles_[stage.tile], stage.convolution);
      break;
  }
  if (stage.kind != Stage::Kind::exposure) gl_->ProgramUniform1ui(name, 0, group_);
  program.use(*gl_);
  gl_->DispatchCompute(count, 1, 1);
  gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |
                               GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
  for (const GLint unit : {core::CM_UNIT_DENOISE_COLOR, core::CM_UNIT_DENOISE_ALBEDO, core::CM_UNIT_DENOISE_NORMAL}) {
    gl_->BindSampler(static_cast<GLuint>(unit), 0);
  }
  gl::check(*gl_, "denoising");
  done_ += count * stage.multiply_adds_each;
  group_ += count;
  if (group_ == stage.groups) {
    ++stage_;
    group_ = 0;
  }
  return stage_ == stages_.size();
}

double Denoiser::progress() const { return total_ > 0.0 ? done_ / total_ : 1.0; }

}  // namespace cumulet::denoise
