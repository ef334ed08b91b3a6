#include "base/missing_feature.hpp"
#include "volume/array_file.hpp"

namespace cumulet::volume::detail {

std::unique_ptr<Reader> open_tiff(std::unique_ptr<ByteSource> /*content*/, Progress* /*progress*/) {
  fail(missing_feature("is a TIFF file", "CUMULET_TIFF"));
}

std::unique_ptr<Reader> open_tiff_slices(const std::vector<std::filesystem::path>& /*files*/, Progress* /*progress*/) {
  fail(missing_feature("is a folder of TIFF files", "CUMULET_TIFF"));
}

}  // namespace cumulet::volume::detail
