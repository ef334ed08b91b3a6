#pragma once

// Private to volume/: metadata of OpenVDB files as text. Include it after vdb_compression.hpp.

#include <openvdb/MetaMap.h>

#include <vector>

#include "volume/volume.hpp"

namespace cumulet::volume::detail {

/// Returns metadata as text. Numbers are formatted as OpenVDB does in the classic locale, in any locale of the process.
/// Long values are truncated.
std::vector<Metadata> metadata_of(const openvdb::MetaMap& map);

}  // namespace cumulet::volume::detail
