#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <layers.hpp>
#include <span>
#include <string>

namespace cumulet::demo {

/// What an AOV is called in a file.
[[nodiscard]] image::LayerName layer_of(cumulet_aov aov);

/// A picture's pixels, 4 floats each.
struct WrittenPicture {
  std::span<const float> beauty;
  std::span<const float> denoised{};  ///< a layer beside it; empty: none
};

/// Writes an OpenEXR file of the picture that the viewer has, width x height, with a layer an AOV and with the
/// attributes. Infinite depths become image::no_depth. Throws std::runtime_error, one line, for what the viewer
/// refuses, and as image::write_exr.
void write_exr(cumulet_viewer* viewer, const std::string& path, std::uint32_t width, std::uint32_t height,
               const WrittenPicture& picture, std::span<const cumulet_aov> aovs,
               std::span<const image::Attribute> attributes);

}  // namespace cumulet::demo
