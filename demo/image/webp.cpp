#include <memory>
#include <stdexcept>
#include <string_view>

#include "checks.hpp"
#include "file.hpp"
#include "image.hpp"

#if CUMULET_HAS_WEBP
#include <webp/encode.h>
#endif

namespace cumulet::image {

void write_webp(const std::string& path, std::uint32_t width, std::uint32_t height,
                std::span<const std::uint8_t> rgba) {
  check_size(path, width, height);
  if (rgba.size() != std::size_t{4} * width * height)
    throw std::logic_error(path + ": an image's size and its pixels disagree");
#if CUMULET_HAS_WEBP
  if (width > WEBP_MAX_DIMENSION || height > WEBP_MAX_DIMENSION)
    fail(path, "WebP images have at most " + std::to_string(WEBP_MAX_DIMENSION) + " pixels per side");
  std::uint8_t* encoded = nullptr;
  const std::size_t size = WebPEncodeLosslessRGBA(rgba.data(), static_cast<int>(width), static_cast<int>(height),
                                                  static_cast<int>(4 * width), &encoded);
  const std::unique_ptr<std::uint8_t, void (*)(void*)> owner(encoded, WebPFree);
  if (size == 0) fail(path, "cannot be encoded as WebP");
  replace_file(path, std::string_view(reinterpret_cast<const char*>(encoded), size));
#else
  fail(path, "this program was built without WebP");
#endif
}

}  // namespace cumulet::image
