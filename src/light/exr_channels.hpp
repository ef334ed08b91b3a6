#pragma once

#include <ImfChannelList.h>

#include <array>
#include <optional>
#include <string>

namespace cumulet::light {

/// The channels of an OpenEXR image that hold its colors.
struct ExrChannels {
  enum class Kind { rgb, xyz, luminance, luminance_chroma };

  Kind kind = Kind::rgb;
  std::string layer;                 ///< empty: channels without a layer
  std::array<std::string, 3> names;  ///< R, G, B; X, Y, Z; Y, RY, BY; or only Y, followed by two empty names

  [[nodiscard]] std::size_t count() const { return kind == Kind::luminance ? 1 : 3; }
};

/// Returns the color channels without a layer, else those of a layer named "Combined" or similar, else of the first RGB
/// layer. Returns nullopt if there are none.
std::optional<ExrChannels> find_colors(const Imf::ChannelList& channels);

/// Returns the first channel that is missing for an image, among the channels without a layer.
std::string missing_channel(const Imf::ChannelList& channels);

}  // namespace cumulet::light
