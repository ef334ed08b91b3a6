#pragma once

// Private to volume/: functions that only the virtual tables of OpenVDB's trees need are taken from libopenvdb, which
// has them for each type that it registers. Instantiating them again is more than half of the time to compile such a
// tree.

#include <openvdb/openvdb.h>

#include <utility>

// NOLINTBEGIN(bugprone-macro-parentheses)
#define CUMULET_TREE_OF_LIBRARY(TreeT)                                            \
  extern template bool TreeT::evalLeafBoundingBox(CoordBBox&) const;              \
  extern template bool TreeT::evalActiveVoxelBoundingBox(CoordBBox&) const;       \
  extern template bool TreeT::evalActiveVoxelDim(Coord&) const;                   \
  extern template bool TreeT::evalLeafDim(Coord&) const;                          \
  extern template void TreeT::writeTopology(std::ostream&, bool) const;           \
  extern template void TreeT::readBuffers(std::istream&, const CoordBBox&, bool); \
  extern template void TreeT::readNonresidentBuffers() const;                     \
  extern template void TreeT::writeBuffers(std::ostream&, bool) const;            \
  extern template void TreeT::print(std::ostream&, int) const;                    \
  extern template NodeCounts TreeT::nodeCount() const;                            \
  extern template Index64 TreeT::activeLeafVoxelCount() const;                    \
  extern template Index64 TreeT::inactiveLeafVoxelCount() const;                  \
  extern template Index64 TreeT::activeVoxelCount() const;                        \
  extern template Index64 TreeT::inactiveVoxelCount() const;                      \
  extern template Index64 TreeT::activeTileCount() const;                         \
  extern template Index64 TreeT::memUsage() const;                                \
  extern template void TreeT::clipUnallocatedNodes();                             \
  extern template LeafCount TreeT::unallocatedLeafCount() const
// NOLINTEND(bugprone-macro-parentheses)

namespace openvdb::OPENVDB_VERSION_NAME::tree {

// 32-bit integers up to OpenVDB 11, 64-bit since 12.
using LeafCount = decltype(std::declval<const FloatTree&>().unallocatedLeafCount());
using NodeCounts = decltype(std::declval<const FloatTree&>().nodeCount());

CUMULET_TREE_OF_LIBRARY(Tree<FloatTree::RootNodeType>);
CUMULET_TREE_OF_LIBRARY(Tree<DoubleTree::RootNodeType>);
CUMULET_TREE_OF_LIBRARY(Tree<Int32Tree::RootNodeType>);
CUMULET_TREE_OF_LIBRARY(Tree<Int64Tree::RootNodeType>);
CUMULET_TREE_OF_LIBRARY(Tree<Vec3STree::RootNodeType>);
CUMULET_TREE_OF_LIBRARY(Tree<Vec3DTree::RootNodeType>);
CUMULET_TREE_OF_LIBRARY(Tree<Vec3ITree::RootNodeType>);

}  // namespace openvdb::OPENVDB_VERSION_NAME::tree

#undef CUMULET_TREE_OF_LIBRARY
