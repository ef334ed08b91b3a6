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

/// Textures of a picture, a texel a pixel.
struct Pictures {
  glm::uvec2 size{0U};
  GLuint colour = 0;    ///< rgba: radiance, linear Rec. 709, of any exposure, and whatever goes with it
  GLuint albedo = 0;    ///< rgb, 0 to 1, and...
  GLuint normal = 0;    ///< ...xyz, -1 to 1; both of networks of nine inputs alone
  GLuint denoised = 0;  ///< GL_RGBA32F, written: colour's rgb denoised, and its alpha as it is
};

/// A network of Open Image Denoise by compute shaders: halves are stored, floats are added. A pixel of colour that is
/// not finite stays as it is, and nothing else sees it. The same pictures on the same driver give the same result, in
/// whatever tiles and steps. Calls need the context current and a StateGuard around.
class Denoiser {
 public:
  /// Uploads the weights. most_bytes: what its buffers may take; pictures that need more are denoised in tiles. Those
  /// of 256x256 are the smallest: what these take (16 MiB) is taken in any case. Throws Error(out_of_memory, gl).
  Denoiser(gl::FunctionsPtr gl, gl::ProgramsPtr programs, NetworkPtr network, std::uint64_t most_bytes);

  /// Begins to denoise; what was under way is given up. Throws Error(out_of_memory, gl).
  void begin(const Pictures& pictures);
  /// Waits until the driver has compiled all that it takes. Throws Error(gl).
  void build() const;
  /// One dispatch of about so many multiplications and additions, no more unless one work group has more. Returns
  /// whether there is none left: the result is there. While the driver still compiles a shader it does nothing. Throws
  /// Error(gl).
  bool step(double multiply_adds);
  /// Part of what was begun that is done, 0 to 1.
  [[nodiscard]] double progress() const;
  /// Of begin() to its end.
  [[nodiscard]] double multiply_adds() const { return total_; }
  [[nodiscard]] std::uint64_t bytes() const { return weights_bytes_ + channels_bytes_ + bins_bytes_; }

 private:
  // What a step takes a part of: work groups of one program, one after the other.
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
  std::uint64_t most_bytes_;
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
  std::size_t stage_ = 0;    // the next
  std::uint32_t group_ = 0;  // the next of it
  double done_ = 0.0;
  double total_ = 0.0;
};

}  // namespace cumulet::denoise
