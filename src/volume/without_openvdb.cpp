#include "base/missing_feature.hpp"
#include "volume/import_detail.hpp"

namespace cumulet::volume {

void initialize_readers() {}

std::unique_ptr<detail::Reader> detail::open_vdb(std::unique_ptr<ByteSource> /*content*/, Progress* /*progress*/) {
  fail(missing_feature("is an OpenVDB file", "CUMULET_OPENVDB"));
}

}  // namespace cumulet::volume
