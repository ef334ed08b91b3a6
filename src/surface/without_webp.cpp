#include "base/missing_feature.hpp"
#include "surface/webp.hpp"

namespace cumulet::surface::detail {

namespace {

[[noreturn]] void refuse() { malformed(missing_feature("is a WebP image", "CUMULET_WEBP")); }

}  // namespace

WebpSize read_webp_size(Bytes /*bytes*/) { refuse(); }
Image decode_webp(Bytes /*bytes*/, const WebpSize& /*size*/) { refuse(); }

}  // namespace cumulet::surface::detail
