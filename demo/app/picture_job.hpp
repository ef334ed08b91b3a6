#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <frames.hpp>
#include <optional>
#include <options.hpp>
#include <scene_file.hpp>
#include <string>
#include <vector>

namespace cumulet::demo {

enum class PictureFormat { png, exr, webp };

/// A picture file to write.
struct PictureFile {
  std::string path;  // has a placeholder for the frame number if a sequence is rendered
  PictureFormat format = PictureFormat::png;
  Denoise denoise = Denoise::off;  // for EXR, the denoised image is an additional layer
  std::vector<cumulet_aov> aovs;   // additional layers of an EXR
  bool cryptomatte = false;        // additional layers of an EXR

  bool operator==(const PictureFile&) const = default;
};

/// A picture, or the pictures of a sequence, to render in the background.
struct PictureJob {
  SceneOptions scene;  // with the size and the samples of the picture
  PictureFile file;
  std::optional<double> time_limit;  // seconds per picture, from its first sample
  struct Range {
    Frame first = 0;
    Frame last = 0;
    bool operator==(const Range&) const = default;
  };
  std::optional<Range> frames;  // of the scene's sequence; nullopt: one picture
};

/// The user's choices for a picture.
struct PictureSettings {
  std::uint32_t width = 1920;
  std::uint32_t height = 1080;
  std::uint32_t samples = 256;
  float noise_percent = 0.0f;  // 0: none
  float time_limit = 0.0f;     // seconds; 0: none
  PictureFile file;
  bool sequence = false;
  PictureJob::Range range;
};

/// Returns the file extension of a format, with the dot.
[[nodiscard]] const char* ending_of(PictureFormat format);
/// Returns the path with the format's extension, and for a sequence with a placeholder for the frame number.
[[nodiscard]] std::string path_for(const std::string& path, PictureFormat format, bool sequence);
/// Returns why a picture cannot be rendered with these settings; "" if it can.
[[nodiscard]] std::string problem_of(const PictureSettings& settings);
/// Returns the job that renders the scene with these settings.
[[nodiscard]] PictureJob job_of(const PictureSettings& settings, const SceneOptions& scene);

}  // namespace cumulet::demo
