#pragma once

#include <headless.hpp>

#include "options.hpp"

namespace cumulet::bench {

/// How good pictures of few samples are, raw and denoised, what raw ones would take to be as good, how much they
/// flicker, and what each pass takes: tables in Markdown, plots and pictures into Options::out.
void measure_denoise(headless::Context& context, const Options& options);

/// How far what is drawn is from the converged picture as a function of the time since a change, as a host sees it:
/// likewise.
void measure_settle(headless::Context& context, const Options& options);

}  // namespace cumulet::bench
