#pragma once

// The table of AOVs: the names and channels that the programs and the library share.

#include <cumulet/cumulet.h>

#include <array>
#include <span>
#include <string_view>

namespace cumulet::settings {

/// How renders that were made in parts are merged (cumulet-merge).
enum class AovKind {
  mean,     ///< mean over the samples
  error,    ///< standard error of that mean
  feature,  ///< feature buffer: independent of the samples
  depth     ///< the same, and infinite where there is nothing
};

struct Aov {
  cumulet_aov value;
  std::string_view name;      ///< word of --aovs, and name of the layer in an OpenEXR file; empty: the picture itself
  std::string_view channels;  ///< of the layer, one letter each; cumulet_read_aov() reads as many floats per pixel
  AovKind kind = AovKind::feature;
};

/// In the order of cumulet_aov. docs/aovs.md describes the layers and the reasons for their names.
inline constexpr std::array aovs = {Aov{CUMULET_AOV_BEAUTY, "", "RGBA", AovKind::mean},
                                    Aov{CUMULET_AOV_VOLUME, "volume", "RGBA", AovKind::mean},
                                    Aov{CUMULET_AOV_TRANSMITTANCE, "transmittance", "Y"},
                                    Aov{CUMULET_AOV_SURFACE_DEPTH, "depth", "Z", AovKind::depth},
                                    Aov{CUMULET_AOV_VOLUME_DEPTH, "volume_depth", "Z", AovKind::depth},
                                    Aov{CUMULET_AOV_NORMAL, "normal", "XYZ"},
                                    Aov{CUMULET_AOV_ALBEDO, "albedo", "RGB"},
                                    Aov{CUMULET_AOV_ERROR, "error", "Y", AovKind::error},
                                    Aov{CUMULET_AOV_VELOCITY, "velocity", "XYZ"},
                                    Aov{CUMULET_AOV_MOTION, "backward", "uv"},
                                    Aov{CUMULET_AOV_VOLUME_MOTION, "volume_backward", "uv"}};
/// The AOVs beside the picture itself.
inline constexpr std::span<const Aov> named_aovs = std::span(aovs).subspan(1);

static_assert([] {
  for (std::size_t i = 0; i < aovs.size(); ++i) {
    if (aovs[i].value != static_cast<cumulet_aov>(i)) return false;
  }
  return true;
}());

}  // namespace cumulet::settings
