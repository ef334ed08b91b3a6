#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <functional>
#include <layers.hpp>
#include <span>
#include <string>

namespace cumulet::demo {

/// What an AOV is called in a file.
[[nodiscard]] image::LayerName layer_of(cumulet_aov aov);

/// The name of what a viewer shows, of what a cumulet_object_name_fn is told; "": it is in no matte.
using ObjectName = std::function<std::string(cumulet_object_kind kind, std::uint64_t tag)>;

/// A picture's pixels, 4 floats each; of a region as of the whole, which has the others as 0.
struct WrittenPicture {
  std::span<const float> beauty;
  std::span<const float> denoised{};  ///< a layer beside it; empty: none
  /// Names of groups of lights, a layer each; the viewer gathers as many.
  std::span<const std::string> light_groups{};
  /// Mattes, by these names; empty: none.
  ObjectName object_name{};
};

/// The pixels of a region (cumulet_region_pixels) of a picture, whose sizes and region are good.
[[nodiscard]] image::Windows windows_of(const float (&region)[4], std::uint32_t width, std::uint32_t height);
/// What is not of the region is made transparent.
void clear_around(const image::Windows& windows, std::span<std::uint8_t> rgba);

/// Writes an OpenEXR file of the picture that the viewer has, with a layer an AOV, Cryptomatte's layers and what these
/// are of, and with the attributes; its data window is the region. Infinite depths become image::no_depth. Throws
/// std::runtime_error, one line, for what the viewer refuses, and as image::write_exr.
void write_exr(cumulet_viewer* viewer, const std::string& path, const image::Windows& windows,
               const WrittenPicture& picture, std::span<const cumulet_aov> aovs,
               std::span<const image::Attribute> attributes);

}  // namespace cumulet::demo
