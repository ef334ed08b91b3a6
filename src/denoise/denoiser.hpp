#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "denoise/network.hpp"
#include "denoise/plan.hpp"
#include "gl/objects.hpp"
#include "gl/programs.hpp"

namespace cumulet::denoise {

/// Textures of an image, with a texel per pixel.
struct Pictures {
  glm::uvec2 size{0U};
  GLuint color = 0;     ///< rgba: radiance, linear Rec. 709, any exposure; alpha is passed through
  GLuint albedo = 0;    ///< rgb, 0 to 1; only for networks with nine inputs
  GLuint normal = 0;    ///< xyz, -1 to 1; only for networks with nine inputs
  GLuint denoised = 0;  ///< GL_RGBA32F, written: denoised rgb and the alpha of `color`
};

/// Runs a network of Open Image Denoise in compute shaders: values are stored as halves and summed as floats. A
/// non-finite color pixel is passed through and does not affect other pixels. The result for the same images on the
/// same driver does not depend on tiles and steps. Calls need the context current and a StateGuard in scope.
class Denoiser {
 public:
  /// Uploads the weights. max_bytes: memory limit of its buffers; larger images are denoised in tiles. The minimum
  /// tile is 256x256; its memory (16 MiB) is allocated in any case. Throws Error(out_of_memory, gl).
  Denoiser(gl::FunctionsPtr gl, gl::ProgramsPtr programs, NetworkPtr network, std::uint64_t max_bytes);

  /// Begins to denoise; cancels denoising under way. Throws Error(out_of_memory, gl).
  void begin(const Pictures& pictures);
  /// Waits until the driver has compiled all required shaders. Throws Error(gl).
  void build() const;
  /// Runs one dispatch of at most that many multiply-adds, but at least one work group. Returns true if denoising is
  /// complete. Does nothing while the driver still compiles the shader. Throws Error(gl).
  bool step(double multiply_adds);
  /// Returns the completed fraction since begin(), 0 to 1.
  [[nodiscard]] double progress() const;
  /// Returns the total from begin() to completion.
  [[nodiscard]] double multiply_adds() const { return total_; }
  [[nodiscard]] std::uint64_t bytes() const { return weights_bytes_ + channels_bytes_ + bins_bytes_; }

 private:
  // The work groups of one program. Each step runs a range of them, in order.
  struct Stage {
    enum class Kind { bins, exposure, input, convolution };
    Kind kind;
    std::size_t tile;
    std::size_t convolution;
    std::uint32_t groups;
    double multiply_adds_each;
  };
  void add_stages();
  void set_input(GLuint program, const Tile& tile) const;
  void set_convolution(GLuint program, const Tile& tile, std::size_t index) const;
  [[nodiscard]] gl::ProgramKey key_of(const Stage& stage) const;
  void bind() const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  NetworkPtr network_;
  std::uint64_t max_bytes_;
  gl::Object weights_;
  std::uint64_t weights_bytes_ = 0;
  std::array<std::uint32_t, Network::convolution_count> weights_at_{};
  gl::Object channels_;
  std::uint64_t channels_bytes_ = 0;
  gl::Object bins_;
  std::uint64_t bins_bytes_ = 0;
  gl::Object sampler_;

  Pictures pictures_;
  glm::uvec2 bin_count_{0U};
  std::vector<Tile> tiles_;
  Memory memory_;
  std::vector<Stage> stages_;
  std::size_t stage_ = 0;    // index of the next stage
  std::uint32_t group_ = 0;  // next work group of this stage
  double done_ = 0.0;
  double total_ = 0.0;
};

}  // namespace cumulet::denoise
