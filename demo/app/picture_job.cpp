#include "picture_job.hpp"

#include <algorithm>
#include <exception>
#include <file.hpp>
#include <filesystem>
#include <frame_pattern.hpp>

namespace cumulet::demo {
namespace {

constexpr std::uint32_t max_side = 16384;
constexpr std::uint32_t max_webp_side = 16383;  // of the file format

}  // namespace

const char* ending_of(PictureFormat format) {
  switch (format) {
    case PictureFormat::png:
      return ".png";
    case PictureFormat::exr:
      return ".exr";
    case PictureFormat::webp:
      return ".webp";
  }
  return "";
}

std::string path_for(const std::string& path, PictureFormat format, bool sequence) {
  std::filesystem::path file(path);
  const std::string ending = file.extension().string();
  for (const PictureFormat known : {PictureFormat::png, PictureFormat::exr, PictureFormat::webp})
    if (ending == ending_of(known)) file.replace_extension();
  std::string text = file.string();
  const std::string placeholder = "_####";
  if (sequence && text.find('#') == std::string::npos) text += placeholder;
  if (!sequence && text.ends_with(placeholder)) text.resize(text.size() - placeholder.size());
  return text + ending_of(format);
}

std::string problem_of(const PictureSettings& settings) {
  const std::uint32_t most = settings.file.format == PictureFormat::webp ? max_webp_side : max_side;
  const auto fits = [most](std::uint32_t side) { return side >= 1 && side <= most; };
  if (!fits(settings.width) || !fits(settings.height))
    return "Width and height must be from 1 to " + std::to_string(most);
  if (settings.samples == 0) return "The picture needs at least one sample";
  if (settings.sequence && settings.range.first > settings.range.last) return "The first frame is after the last one";
  try {
    const auto pattern = FramePattern::parse(settings.file.path);
    if (!settings.sequence)
      image::check_writable(settings.file.path);
    else if (pattern)
      image::check_writable(pattern->file(settings.range.first));
    else
      return "The file name needs #### for the number of the frame";
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

PictureJob job_of(const PictureSettings& settings, const SceneOptions& scene) {
  PictureJob job{scene, settings.file, {}, {}};
  job.scene.width = settings.width;
  job.scene.height = settings.height;
  job.scene.sampling.samples = settings.samples;
  job.scene.sampling.noise_target_percent = settings.noise_percent;
  job.scene.sampling.view = CUMULET_VIEW_SHADED;
  // The image is read without denoising, and denoised separately.
  job.scene.display.denoise = CUMULET_DENOISE_OFF;
  const bool layered = settings.file.format == PictureFormat::exr;
  if (!layered) {
    job.file.aovs.clear();
    job.file.cryptomatte = false;
  }
  const bool volume = std::ranges::find(job.file.aovs, CUMULET_AOV_VOLUME) != job.file.aovs.end();
  job.scene.sampling.separate_volume_aov = volume ? 1 : 0;
  if (layered) job.scene.sampling.light_groups = static_cast<std::uint32_t>(scene.light_groups.size());
  if (settings.time_limit > 0.0f) job.time_limit = static_cast<double>(settings.time_limit);
  if (settings.sequence) job.frames = settings.range;
  return job;
}

}  // namespace cumulet::demo
