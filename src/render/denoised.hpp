#pragma once

#include "denoise/network.hpp"
#include "gl/programs.hpp"
#include "render/tracer.hpp"

namespace cumulet::render {

/// What is denoised of a picture, and by what.
struct Denoising {
  denoise::NetworkPtr network;
  bool with_background = true;    ///< all radiance; else what is in front of the background
  glm::vec3 medium_albedo{1.0F};  ///< a guide where the volume is
  /// Whether facts may have light exactly: of surfaces, or that media give off. It is taken off before the network, and
  /// put back, so that no detail of it is lost; which takes the network twice.
  bool known_light = false;
  std::uint64_t most_bytes = 0;  ///< of denoise::Denoiser's buffers
};

/// Its radiance denoised, and its alpha as it is: GL_RGBA32F, of the size of its box, row 0 the top. The picture has
/// its facts (Tracer::find_facts). Waits for the driver's compiler, never for the device. Needs the context current and
/// a StateGuard around. Throws Error(out_of_memory, gl).
gl::Object denoised(const gl::FunctionsPtr& gl, const gl::ProgramsPtr& programs, const Picture& picture,
                    const Denoising& denoising);

}  // namespace cumulet::render
