#include "status_line.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <progress.hpp>
#include <settings.hpp>

namespace cumulet::demo {
namespace {

template <class... Values>
std::string print(const char* format, Values... values) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), format, values...);  // NOLINT(cppcoreguidelines-pro-type-vararg)
  return text.data();
}

bool has_flag(const Status& status, unsigned flag) { return (status.frame.flags & flag) != 0; }

/// Returns the completed samples per pixel, of all or without a number to reach.
std::string samples_text(const Model& model) {
  const Status& status = model.status;
  const cumulet_sampling_desc& sampling = model.scene.sampling;
  const double part = std::clamp(status.frame.progress, 0.0, 1.0);
  const bool converged = has_flag(status, CUMULET_RENDER_CONVERGED);
  if (sampling.noise_target_percent > 0.0f && status.frame.width > 0) {
    // With a noise target, the number of samples is only a maximum.
    const double pixels = static_cast<double>(status.frame.width) * status.frame.height;
    const std::string samples = print("%.0f samples", std::floor(static_cast<double>(status.stats.samples) / pixels));
    return converged ? samples : samples + print(" (%.0f %%)", std::floor(100.0 * part));
  }
  if (converged) return print("%u samples", sampling.samples);
  return print("%.0f / %u", std::floor(part * sampling.samples), sampling.samples);
}

/// Returns the name of a debug view; "" for the shaded view.
std::string view_text(cumulet_view_mode shown) {
  for (const auto& view : settings::view_choices)
    if (view.value == shown && shown != CUMULET_VIEW_SHADED) return view.name;
  return "";
}

}  // namespace

std::optional<double> shown_noise(const Status& status) {
  constexpr double min_samples = 4.0;
  const double pixels = static_cast<double>(status.frame.width) * status.frame.height;
  if (static_cast<double>(status.stats.samples) < min_samples * pixels) return std::nullopt;
  return status.noise;
}

std::string status_text(const Model& model) {
  const Status& status = model.status;
  const std::string view = view_text(model.scene.sampling.view);
  std::string text = view.empty() ? samples_text(model) : view;
  // During a preview the image has no samples of its size.
  const bool preview = has_flag(status, CUMULET_RENDER_PREVIEW);
  if (preview) text = "Preview";
  const bool refines = has_flag(status, CUMULET_RENDER_INCOMPLETE);
  if (refines && model.seconds_left) text += ", " + format_duration(*model.seconds_left) + " left";
  const auto noise = shown_noise(status);
  // The first samples of an image are shown before they are denoised.
  const bool denoises = view.empty() && model.scene.display.denoise != CUMULET_DENOISE_OFF;
  if (denoises)
    text += preview || !has_flag(status, CUMULET_RENDER_DENOISED) ? "" : ", denoised";
  else if (noise)
    text += print(", noise %.2f %%", 100.0 * *noise);
  if (model.navigation.fly != 0) text += "   flying";
  if (!status.saving.empty())
    text += "   saving " + std::filesystem::path(status.saving).filename().string() + " when all pixels are sampled";
  if (status.frame.width > 0) text += print("   %ux%u", status.frame.width, status.frame.height);
  return text;
}

std::string file_of_work(const Model& model) {
  if (!model.status.loading.empty()) return model.status.loading;
  return model.scene.others.empty() ? model.scene.volume : std::string();
}

}  // namespace cumulet::demo
