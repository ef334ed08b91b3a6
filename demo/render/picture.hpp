#pragma once

#include <string>
#include <vector>

#include "denoised.hpp"
#include "instances.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "render_viewer.hpp"

namespace cumulet::demo {

/// Returns an empty vector if denoising is off or fails. A failure is logged only: a noisy image is better than none
/// after hours of rendering.
[[nodiscard]] std::vector<float> denoise(const Viewer& viewer, const RenderOptions& options, const Denoiser& denoiser,
                                         Progress& progress);
/// Writes the output file. denoised: from denoise().
void write_picture(const Viewer& viewer, const RenderOptions& options, const Instances& others,
                   const std::vector<float>& denoised, Progress& progress);

}  // namespace cumulet::demo
