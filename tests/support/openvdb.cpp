#include "support/openvdb.hpp"

CUMULET_OPENVDB_GRIDS()
