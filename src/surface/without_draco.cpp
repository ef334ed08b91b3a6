#include "base/missing_feature.hpp"
#include "surface/draco_mesh.hpp"

namespace cumulet::surface::detail {

std::unique_ptr<DracoMesh> decode_draco(Bytes /*bytes*/, const Owner& /*owner*/, const std::string& what,
                                        Budget& /*budget*/) {
  malformed(missing_feature(what + " is compressed by Draco", "CUMULET_DRACO"));
}

}  // namespace cumulet::surface::detail
