#include "base/missing_feature.hpp"
#include "volume/import_detail.hpp"

namespace cumulet::volume {

std::unique_ptr<detail::Reader> detail::open_nanovdb(std::unique_ptr<ByteSource> /*content*/, Progress* /*progress*/) {
  fail(missing_feature("is a NanoVDB file", "CUMULET_NANOVDB"));
}

}  // namespace cumulet::volume
