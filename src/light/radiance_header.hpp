#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "light/primaries.hpp"

namespace cumulet::light {

/// The text header of a Radiance image.
struct RadianceHeader {
  glm::dvec3 exposure{1.0};  ///< factor that was applied to the pixels: EXPOSURE and COLORCORR
  bool xyz = false;
  std::optional<Primaries> primaries;
  std::vector<std::string> remarks;

  std::uint32_t width = 0;
  std::uint32_t height = 0;
  bool in_columns = false;  ///< a line of the file is a column of the image
  bool upwards = false;     ///< +Y: the first row is the lowest
  bool leftwards = false;   ///< -X: the first column is the rightmost

  std::size_t size = 0;  ///< bytes before the first pixel

  [[nodiscard]] std::uint32_t lines() const { return in_columns ? width : height; }
  [[nodiscard]] std::uint32_t line_length() const { return in_columns ? height : width; }
};

/// Parses the header. Throws Error(file), one line with the name and the cause.
RadianceHeader read_radiance_header(std::span<const std::uint8_t> bytes, const std::string& name);

}  // namespace cumulet::light
