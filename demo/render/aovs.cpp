#include "aovs.hpp"

#include <cmath>
#include <stdexcept>
#include <vector>

namespace cumulet::demo {

image::LayerName layer_of(cumulet_aov aov) {
  switch (aov) {
    case CUMULET_AOV_VOLUME:
      return image::layers::volume;
    case CUMULET_AOV_TRANSMITTANCE:
      return image::layers::transmittance;
    case CUMULET_AOV_SURFACE_DEPTH:
      return image::layers::depth;
    case CUMULET_AOV_VOLUME_DEPTH:
      return image::layers::volume_depth;
    case CUMULET_AOV_NORMAL:
      return image::layers::normal;
    case CUMULET_AOV_ALBEDO:
      return image::layers::albedo;
    case CUMULET_AOV_ERROR:
      return image::layers::error;
    case CUMULET_AOV_VELOCITY:
      return image::layers::velocity;
    case CUMULET_AOV_BEAUTY:
      break;
  }
  return image::layers::beauty;
}

void write_exr(cumulet_viewer* viewer, const std::string& path, std::uint32_t width, std::uint32_t height,
               const WrittenPicture& picture, std::span<const cumulet_aov> aovs,
               std::span<const image::Attribute> attributes) {
  std::vector<std::vector<float>> values;
  std::vector<image::Layer> layers{{image::layers::beauty, picture.beauty}};
  if (!picture.denoised.empty()) layers.push_back({image::layers::denoised, picture.denoised});
  values.reserve(aovs.size());
  for (const cumulet_aov aov : aovs) {
    const image::LayerName name = layer_of(aov);
    std::vector<float>& pixels = values.emplace_back(std::size_t{width} * height * name.channels.size());
    if (cumulet_read_aov(viewer, aov, pixels.data(), pixels.size()) != CUMULET_OK) {
      throw std::runtime_error(path + ": " + cumulet_last_error(viewer));
    }
    if (aov == CUMULET_AOV_SURFACE_DEPTH || aov == CUMULET_AOV_VOLUME_DEPTH) {
      for (float& z : pixels) z = std::isfinite(z) ? z : image::no_depth;
    }
    layers.push_back({name, pixels});
  }
  image::write_exr(path, width, height, layers, attributes);
}

}  // namespace cumulet::demo
