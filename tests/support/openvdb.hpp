#pragma once

// OpenVDB for tests that write files. Its grids are instantiated once in openvdb.cpp, because that takes half a minute
// per test otherwise.

#include <openvdb/openvdb.h>

#define CUMULET_OPENVDB_GRID(how, tree_type)                                                                         \
  how template class openvdb::tree::InternalNode<openvdb::tree_type::LeafNodeType, 4>;                               \
  how template class openvdb::tree::InternalNode<openvdb::tree_type::RootNodeType::ChildNodeType::ChildNodeType, 5>; \
  how template class openvdb::tree::Tree<openvdb::tree_type::RootNodeType>;                                          \
  how template class openvdb::Grid<openvdb::tree_type>;
#define CUMULET_OPENVDB_GRIDS(how)     \
  CUMULET_OPENVDB_GRID(how, FloatTree) \
  CUMULET_OPENVDB_GRID(how, Vec3STree) \
  CUMULET_OPENVDB_GRID(how, DoubleTree)

CUMULET_OPENVDB_GRIDS(extern)
