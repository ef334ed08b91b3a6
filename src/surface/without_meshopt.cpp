#include "base/missing_feature.hpp"
#include "surface/meshopt.hpp"

namespace cumulet::surface::detail {

std::vector<std::uint8_t> decode_meshopt(const tinygltf::Value& /*extension*/, std::span<const std::uint8_t> /*from*/,
                                         const std::shared_ptr<const void>& /*owner*/, const std::string& what,
                                         Budget& /*budget*/) {
  malformed(missing_feature(what + " is compressed by meshoptimizer", "CUMULET_MESHOPT"));
}

}  // namespace cumulet::surface::detail
