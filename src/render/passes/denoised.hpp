#pragma once

#include "denoise/network.hpp"
#include "denoise/oidn_library.hpp"
#include "gl/programs.hpp"
#include "render/film/picture.hpp"

namespace cumulet::render {

/// Settings of the neural denoiser. It is a network in shaders or a library.
struct Denoising {
  denoise::NetworkPtr network;      ///< may be null with a library
  denoise::OidnLibraryPtr library;  ///< used in place of the network; null: none
  bool with_background = true;      ///< denoises all radiance; else only radiance in front of the background
  glm::vec3 medium_albedo{1.0F};    ///< albedo guide for the volume
  /// True if the feature buffers may contain a noise-free component: light of surfaces, or emission of media. It is
  /// subtracted before the network and added back after it, so that its detail is kept. The network then runs twice.
  bool known_light = false;
  std::uint64_t max_bytes = 0;  ///< limit for the buffers of denoise::Denoiser
};

/// Returns a GL_RGBA32F texture of the picture's box, row 0 at the top: denoised radiance and unchanged alpha. The
/// picture must have its feature buffers (FeaturePass::find). Waits for the driver's compiler, never for the
/// device, unless a library denoises, which needs the pixels in main memory. Needs a current context and an active
/// StateGuard. Throws Error(out_of_memory, gl), and OidnError if the library fails.
gl::Object denoised(const gl::FunctionsPtr& gl, const gl::ProgramsPtr& programs, const Picture& picture,
                    const Denoising& denoising);

}  // namespace cumulet::render
