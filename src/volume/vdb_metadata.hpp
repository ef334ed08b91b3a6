#pragma once

// Private to volume/: metadata of OpenVDB's files as text. After vdb_compression.hpp.

#include <openvdb/MetaMap.h>

#include <vector>

#include "volume/volume.hpp"

namespace cumulet::volume::detail {

/// Numbers as OpenVDB prints them in the classic locale, in every locale of the process. Long values are cut.
std::vector<Metadata> metadata_of(const openvdb::MetaMap& map);

}  // namespace cumulet::volume::detail
