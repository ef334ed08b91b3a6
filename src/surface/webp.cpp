#include "surface/webp.hpp"

#include <webp/decode.h>

namespace cumulet::surface::detail {

WebpSize read_webp_size(Bytes bytes) {
  WebPBitstreamFeatures features{};
  const VP8StatusCode status = WebPGetFeatures(bytes.data(), bytes.size(), &features);
  if (status == VP8_STATUS_NOT_ENOUGH_DATA) malformed("is a truncated WebP");
  if (status != VP8_STATUS_OK) malformed("is a malformed WebP");
  if (features.has_animation != 0) malformed("is an animated WebP, which is not supported");
  return {static_cast<std::uint64_t>(features.width), static_cast<std::uint64_t>(features.height)};
}

Image decode_webp(Bytes bytes, const WebpSize& size) {
  Image result;
  result.width = static_cast<std::uint32_t>(size.width);
  result.height = static_cast<std::uint32_t>(size.height);
  result.rgba.resize(std::size_t{result.width} * result.height * 4);
  if (WebPDecodeRGBAInto(bytes.data(), bytes.size(), result.rgba.data(), result.rgba.size(),
                         static_cast<int>(4 * result.width)) == nullptr) {
    malformed("cannot be decoded");
  }
  return result;
}

}  // namespace cumulet::surface::detail
