#include "surface/specular_glossiness.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/shared_code.hpp"
#include "base/srgb.hpp"

namespace cumulet::core {
#include "display/display.glsl"
}  // namespace cumulet::core

namespace cumulet::surface::detail {

namespace {

constexpr float dielectric = 0.04F;
constexpr float tiny = 1e-6F;

float brightness(const glm::vec3& c) { return std::sqrt(0.299F * c.r * c.r + 0.587F * c.g * c.g + 0.114F * c.b * c.b); }

/// Returns the metallic value of the mixture that has both brightnesses.
float metallic_of(float diffuse, float specular, float rest) {
  if (specular < dielectric) return 0.0F;
  const float a = dielectric;
  const float b = diffuse * rest / (1.0F - dielectric) + specular - 2.0F * dielectric;
  const float c = dielectric - specular;
  const float root = std::sqrt(std::max(b * b - 4.0F * a * c, 0.0F));
  return std::clamp((root - b) / (2.0F * a), 0.0F, 1.0F);
}

std::uint8_t byte_of(float value) {
  return static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(value, 0.0F, 1.0F)));
}

/// An image's linear texels, resampled to another size.
class Texels {
 public:
  Texels(const std::optional<Image>& image, std::uint32_t width, std::uint32_t height)
      : image_(image ? &*image : nullptr), width_(width), height_(height) {}

  [[nodiscard]] glm::vec4 at(std::uint32_t x, std::uint32_t y) const {
    if (image_ == nullptr) return glm::vec4(1.0F);
    if (image_->width == width_ && image_->height == height_) return texel(x, y);
    const auto position = [](std::uint32_t i, std::uint32_t count, std::uint32_t of) {
      return std::clamp((static_cast<float>(i) + 0.5F) * static_cast<float>(of) / static_cast<float>(count) - 0.5F,
                        0.0F, static_cast<float>(of - 1));
    };
    const float u = position(x, width_, image_->width);
    const float v = position(y, height_, image_->height);
    const auto left = static_cast<std::uint32_t>(u);
    const auto top = static_cast<std::uint32_t>(v);
    const std::uint32_t right = std::min(left + 1, image_->width - 1);
    const std::uint32_t bottom = std::min(top + 1, image_->height - 1);
    const float across = u - static_cast<float>(left);
    const float down = v - static_cast<float>(top);
    return glm::mix(glm::mix(texel(left, top), texel(right, top), across),
                    glm::mix(texel(left, bottom), texel(right, bottom), across), down);
  }

 private:
  [[nodiscard]] glm::vec4 texel(std::uint32_t x, std::uint32_t y) const {
    const std::uint8_t* t = &image_->rgba[(std::size_t{y} * image_->width + x) * 4];
    return {linear_[t[0]], linear_[t[1]], linear_[t[2]], static_cast<float>(t[3]) / 255.0F};
  }

  const Image* image_;
  std::uint32_t width_;
  std::uint32_t height_;
  std::array<float, 256> linear_ = srgb_decoding();
};

}  // namespace

MetallicRoughness convert(const SpecularGlossiness& from) {
  const glm::vec3 diffuse(from.diffuse);
  const float rest = 1.0F - std::max({from.specular.r, from.specular.g, from.specular.b});
  const float metallic = metallic_of(brightness(diffuse), brightness(from.specular), rest);
  const glm::vec3 of_diffuse = diffuse * (rest / (1.0F - dielectric) / std::max(1.0F - metallic, tiny));
  const glm::vec3 of_specular = (from.specular - glm::vec3(dielectric * (1.0F - metallic))) / std::max(metallic, tiny);
  const glm::vec3 color = glm::clamp(glm::mix(of_diffuse, of_specular, metallic * metallic), 0.0F, 1.0F);
  return {glm::vec4(color, from.diffuse.a), metallic, 1.0F - from.glossiness};
}

ConvertedImages convert(const SpecularGlossiness& factors, const std::optional<Image>& diffuse,
                        const std::optional<Image>& specular_glossiness, Budget& budget) {
  ConvertedImages to;
  for (const auto& image : {&diffuse, &specular_glossiness}) {
    if (!image->has_value()) continue;
    to.base_color.width = std::max(to.base_color.width, (*image)->width);
    to.base_color.height = std::max(to.base_color.height, (*image)->height);
    if (to.base_color.name.empty()) to.base_color.name = (*image)->name;
  }
  const std::uint32_t width = to.base_color.width;
  const std::uint32_t height = to.base_color.height;
  to.metallic_roughness = to.base_color;
  const std::uint64_t pixels = std::uint64_t{width} * height;
  budget.take(pixels, 8, "images of KHR_materials_pbrSpecularGlossiness");
  to.base_color.rgba.reserve(4 * pixels);
  to.metallic_roughness.rgba.reserve(4 * pixels);
  const Texels diffuse_at(diffuse, width, height);
  const Texels specular_at(specular_glossiness, width, height);
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      budget.check(std::size_t{y} * width + x);
      const glm::vec4 reflected = specular_at.at(x, y);
      const MetallicRoughness made =
          convert({factors.diffuse * diffuse_at.at(x, y), factors.specular * glm::vec3(reflected),
                   factors.glossiness * reflected.a});
      for (int c = 0; c < 3; ++c) to.base_color.rgba.push_back(byte_of(core::cm_srgb_encode(made.base_color[c])));
      to.base_color.rgba.push_back(byte_of(made.base_color.a));
      to.metallic_roughness.rgba.insert(to.metallic_roughness.rgba.end(),
                                        {0, byte_of(made.roughness), byte_of(made.metallic), 255});
    }
  }
  return to;
}

}  // namespace cumulet::surface::detail
