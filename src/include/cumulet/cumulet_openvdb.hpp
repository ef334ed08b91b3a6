/**
 * @file
 * Creates Cumulet volumes from OpenVDB grids in the host's memory.
 *
 * It is header-only, built on cumulet_volume_from_sparse, and compiled with the host's own OpenVDB, which may have
 * another version or ABI than the one inside Cumulet. It needs C++17. Link OpenVDB and TBB, as every user of OpenVDB
 * does.
 */
#ifndef CUMULET_CUMULET_OPENVDB_HPP
#define CUMULET_CUMULET_OPENVDB_HPP

#include <cumulet/cumulet.h>
#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

namespace cumulet {
namespace openvdb_detail {

/* The arrays of a cumulet_sparse_desc. */
struct Flat {
  std::vector<int32_t> origins;
  std::unique_ptr<float[]> values; /* not a vector, which would zero it first */
  std::unique_ptr<uint64_t[]> active;
  std::vector<cumulet_tile> tiles;
  float background = 0.0F;
};

template <class TreeT>
void flatten(const TreeT& tree, Flat& flat) {
  using LeafT = typename TreeT::LeafNodeType;
  static_assert(LeafT::DIM == 8, "a brick must have the size of an OpenVDB leaf node");
  flat.background = static_cast<float>(tree.background());

  std::vector<const LeafT*> leaves;
  tree.getNodes(leaves);
  flat.origins.resize(3 * leaves.size());
  flat.values.reset(new float[512 * leaves.size()]);
  flat.active.reset(new uint64_t[8 * leaves.size()]);
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
    const LeafT& leaf = *leaves[i];
    for (int axis = 0; axis < 3; ++axis) flat.origins[3 * i + static_cast<std::size_t>(axis)] = leaf.origin()[axis];
    for (openvdb::Index x = 0; x < 8; ++x) flat.active[8 * i + x] = leaf.valueMask().template getWord<uint64_t>(x);
    const auto* values = leaf.buffer().data(); /* loads it now if it was delay-loaded */
    for (std::size_t n = 0; n < 512; ++n) flat.values[512 * i + n] = static_cast<float>(values[n]);
  });

  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(TreeT::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    const auto value = static_cast<float>(*tile);
    if (!tile.isValueOn() && value == flat.background) continue;
    openvdb::CoordBBox box;
    tile.getBoundingBox(box);
    cumulet_tile out{};
    for (int axis = 0; axis < 3; ++axis) {
      out.min[axis] = box.min()[axis];
      out.max[axis] = box.max()[axis];
    }
    out.value = value;
    out.active = tile.isValueOn() ? 1 : 0;
    flat.tiles.push_back(out);
  }
}

template <class TreeT>
bool flatten_if(const openvdb::TreeBase& tree, Flat& flat) {
  if (tree.type() != TreeT::treeType()) return false;
  flatten(static_cast<const TreeT&>(tree), flat);
  return true;
}

/* A grid in the form of cumulet.h. */
struct Sparse {
  std::string name = "openvdb";
  Flat flat;
  cumulet_sparse_desc desc{}; /* points into `name` and `flat` */
};

/* Returns "" or why the grid is refused, and its status. Throws the exceptions of OpenVDB. */
inline std::string flatten_grid(const openvdb::GridBase::ConstPtr& grid, Sparse& sparse, cumulet_status& status) {
  status = CUMULET_ERROR_INVALID_ARGUMENT;
  if (!grid) return "grid is NULL";
  status = CUMULET_ERROR_FILE;
  if (!grid->getName().empty()) sparse.name = grid->getName();
  const openvdb::GridClass grid_class = grid->getGridClass();
  if (grid_class != openvdb::GRID_FOG_VOLUME && grid_class != openvdb::GRID_UNKNOWN)
    return "is a " + openvdb::GridBase::gridClassToString(grid_class) + ", not a fog volume";
  if (!grid->transform().isLinear()) return "has a frustum transform, which is not affine";
  const openvdb::TreeBase& tree = grid->constBaseTree();
  Flat& flat = sparse.flat;
  using HalfTree = openvdb::tree::Tree4<openvdb::math::half, 5, 4, 3>::Type;
  if (!flatten_if<openvdb::FloatTree>(tree, flat) && !flatten_if<openvdb::DoubleTree>(tree, flat) &&
      !flatten_if<HalfTree>(tree, flat))
    return "has type " + grid->valueType() + ", not a float or half scalar";
  cumulet_sparse_desc& desc = sparse.desc;
  desc.struct_size = sizeof desc;
  desc.brick_origins = flat.origins.data();
  desc.brick_values = flat.values.get();
  desc.brick_active = flat.active.get();
  desc.brick_count = flat.origins.size() / 3;
  desc.tiles = flat.tiles.data();
  desc.tile_count = flat.tiles.size();
  desc.background = flat.background;
  desc.name = sparse.name.c_str();
  /* OpenVDB multiplies row vectors from the left, so its rows are columns here. */
  const openvdb::Mat4d matrix = grid->transform().baseMap()->getAffineMap()->getMat4();
  for (int i = 0; i < 16; ++i) desc.index_to_world[i] = matrix(i / 4, i % 4);
  return std::string();
}

inline cumulet_status refuse(cumulet_status status, const std::string& name, const std::string& cause, char* error,
                             size_t error_size) {
  if (error == nullptr || error_size == 0) return status;
  std::string line = name + ": " + cause;
  for (char& c : line) c = static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  const size_t length = line.size() < error_size ? line.size() : error_size - 1;
  std::memcpy(error, line.data(), length);
  error[length] = '\0';
  return status;
}

} /* namespace openvdb_detail */

/**
 * Creates a volume from a float, half or double grid, with the grid's name. The result is the same as if the grid had
 * been written to a file and opened. The grid is copied during the call and not kept.
 *
 * Threads: any thread. No GL.
 *
 * @param grid       The grid.
 * @param out        Receives the volume, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT for a null grid; CUMULET_ERROR_FILE for a level set, another value
 *         type or a frustum transform; or CUMULET_ERROR_OUT_OF_MEMORY.
 */
inline cumulet_status volume_from_openvdb(const openvdb::GridBase::ConstPtr& grid, cumulet_volume** out,
                                          char* error = nullptr, size_t error_size = 0) {
  openvdb_detail::Sparse sparse;
  const auto refuse = [&](cumulet_status status, const std::string& cause) {
    if (out != nullptr) *out = nullptr;
    return openvdb_detail::refuse(status, sparse.name, cause, error, error_size);
  };
  try {
    cumulet_status status = CUMULET_OK;
    const std::string cause = openvdb_detail::flatten_grid(grid, sparse, status);
    if (!cause.empty()) return refuse(status, cause);
    return cumulet_volume_from_sparse(&sparse.desc, out, error, error_size);
  } catch (const std::bad_alloc&) {
    return refuse(CUMULET_ERROR_OUT_OF_MEMORY, "not enough memory to copy it");
  } catch (const std::exception& e) {
    return refuse(CUMULET_ERROR_FILE, e.what());
  }
}

/** A grid and its channel. */
struct OpenVdbField {
  cumulet_channel channel;
  openvdb::GridBase::ConstPtr grid;
};

/**
 * Submits a complete state of a dynamic volume from OpenVDB grids (cumulet_dynamic_volume_set). The grids are copied
 * during the call. Grids with tiles keep them, and such a state takes no cumulet_dynamic_volume_update.
 *
 * Threads: any thread; runs update callbacks of viewers that show the dynamic volume. No GL.
 *
 * @param volume     The dynamic volume.
 * @param fields     The grids and their channels.
 * @param name       Name in messages. NULL or "": "openvdb".
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return The status of cumulet_dynamic_volume_set; CUMULET_ERROR_INVALID_ARGUMENT for a null grid; or
 * CUMULET_ERROR_FILE for a level set, another value type or a frustum transform.
 */
inline cumulet_status dynamic_volume_set_openvdb(cumulet_dynamic_volume* volume,
                                                 const std::vector<OpenVdbField>& fields, const char* name,
                                                 char* error = nullptr, size_t error_size = 0) {
  std::string what = name != nullptr && *name != '\0' ? name : "openvdb";
  const auto refuse = [&](cumulet_status status, const std::string& cause) {
    return openvdb_detail::refuse(status, what, cause, error, error_size);
  };
  try {
    std::vector<openvdb_detail::Sparse> sparse(fields.size());
    std::vector<cumulet_field> given(fields.size());
    for (size_t i = 0; i < fields.size(); ++i) {
      cumulet_status status = CUMULET_OK;
      const std::string cause = openvdb_detail::flatten_grid(fields[i].grid, sparse[i], status);
      if (!cause.empty()) return refuse(status, sparse[i].name + ": " + cause);
      given[i].struct_size = sizeof given[i];
      given[i].channel = fields[i].channel;
      given[i].sparse = &sparse[i].desc;
    }
    cumulet_volume_fields_desc desc{};
    desc.struct_size = sizeof desc;
    desc.fields = given.data();
    desc.field_count = given.size();
    desc.name = what.c_str();
    return cumulet_dynamic_volume_set(volume, &desc, error, error_size);
  } catch (const std::bad_alloc&) {
    return refuse(CUMULET_ERROR_OUT_OF_MEMORY, "not enough memory to copy it");
  } catch (const std::exception& e) {
    return refuse(CUMULET_ERROR_FILE, e.what());
  }
}

} /* namespace cumulet */

#endif
