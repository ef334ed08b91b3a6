#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <functional>
#include <layers.hpp>
#include <span>
#include <string>

namespace cumulet::demo {

/// Returns the Cryptomatte name of an object, as cumulet_object_name_fn. "": the object is in no matte.
using ObjectName = std::function<std::string(cumulet_object_kind kind, std::uint64_t tag)>;

/// Pixels of a rendered image, 4 floats each. The spans cover the full image; pixels outside the render region are 0.
struct WrittenPicture {
  std::span<const float> beauty;
  std::span<const float> denoised{};  ///< written as a second layer; empty: none
  /// Names of the light groups, one layer each. The viewer must accumulate the same number of groups.
  std::span<const std::string> light_groups{};
  /// Names for Cryptomatte; empty: no Cryptomatte layers.
  ObjectName object_name{};
};

/// Returns the pixel rectangle of a render region (cumulet_region_pixels). Region and size must be valid.
[[nodiscard]] image::Windows windows_of(const float (&region)[4], std::uint32_t width, std::uint32_t height);
/// Sets the pixels outside the render region to 0 (transparent).
void clear_around(const image::Windows& windows, std::span<std::uint8_t> rgba);

/// Writes the viewer's image as an OpenEXR file: the picture, one layer per AOV, Cryptomatte and the attributes. The
/// data window is the render region. Infinite depths are written as image::no_depth. Throws std::runtime_error with one
/// line if the viewer refuses a read, and as image::write_exr.
void write_exr(cumulet_viewer* viewer, const std::string& path, const image::Windows& windows,
               const WrittenPicture& picture, std::span<const cumulet_aov> aovs,
               std::span<const image::Attribute> attributes);

}  // namespace cumulet::demo
