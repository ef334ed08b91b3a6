#pragma once

#include <ImfChannelList.h>

#include <array>
#include <optional>
#include <string>

namespace cumulet::light {

/// Which channels of an OpenEXR picture hold its colors.
struct ExrChannels {
  enum class Kind { rgb, xyz, luminance, luminance_chroma };

  Kind kind = Kind::rgb;
  std::string layer;                 ///< empty: channels without a layer
  std::array<std::string, 3> names;  ///< R, G, B; X, Y, Z; Y, RY, BY; or Y alone, and two empty ones

  [[nodiscard]] std::size_t count() const { return kind == Kind::luminance ? 1 : 3; }
};

/// The colors without a layer, else those of a layer called "Combined" or the like, else of the first layer that has
/// R, G and B. Nothing if there are none.
std::optional<ExrChannels> find_colors(const Imf::ChannelList& channels);

/// The first channel that a picture would need beside those that it has without a layer.
std::string missing_channel(const Imf::ChannelList& channels);

}  // namespace cumulet::light
