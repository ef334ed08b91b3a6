#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <fstream>
#include <mutex>

#include "volume/import_detail.hpp"

namespace cumulet::volume::detail {
namespace {

void initialize_openvdb() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

std::string class_name(openvdb::GridClass grid_class) {
  switch (grid_class) {
    case openvdb::GRID_FOG_VOLUME:
      return "fog volume";
    case openvdb::GRID_LEVEL_SET:
      return "level set";
    case openvdb::GRID_STAGGERED:
      return "staggered";
    default:
      return "unknown";
  }
}

glm::ivec3 to_glm(const openvdb::Coord& c) { return {c.x(), c.y(), c.z()}; }

template <typename TreeT>
class VdbLeaves final : public LeafSource {
 public:
  using LeafT = typename TreeT::LeafNodeType;
  static_assert(LeafT::DIM == brick_size);

  explicit VdbLeaves(typename TreeT::ConstPtr tree) : tree_(std::move(tree)) { tree_->getNodes(leaves_); }

  [[nodiscard]] std::size_t count() const override { return leaves_.size(); }
  [[nodiscard]] glm::ivec3 origin(std::size_t leaf) const override { return to_glm(leaves_[leaf]->origin()); }
  [[nodiscard]] ActiveMask active(std::size_t leaf) const override {
    ActiveMask mask;
    for (openvdb::Index x = 0; x < brick_size; ++x) {
      mask[x] = leaves_[leaf]->getValueMask().template getWord<std::uint64_t>(x);
    }
    return mask;
  }
  void values(std::size_t leaf, float* out) const override {
    const auto* data = leaves_[leaf]->buffer().data();
    for (int i = 0; i < brick_voxels; ++i) out[i] = static_cast<float>(data[i]);
  }

 private:
  typename TreeT::ConstPtr tree_;
  std::vector<const LeafT*> leaves_;
};

/// Collects the tiles of a node and of all internal nodes below it.
template <typename NodeT>
void collect_tiles(const NodeT& node, float background, std::vector<SourceTile>& tiles) {
  using ChildT = typename NodeT::ChildNodeType;
  constexpr auto size = static_cast<int>(ChildT::DIM);
  for (auto it = node.cbeginValueAll(); it; ++it) {
    const auto value = static_cast<float>(*it);
    if (!it.isValueOn() && value == background) continue;
    const glm::ivec3 min = to_glm(it.getCoord());
    tiles.push_back({{min, min + (size - 1), value}, it.isValueOn()});
  }
  if constexpr (ChildT::LEVEL > 0) {
    for (auto it = node.cbeginChildOn(); it; ++it) collect_tiles(*it, background, tiles);
  }
}

template <typename GridT>
void take_tree(const openvdb::GridBase& grid, SourceGrid& out) {
  using TreeT = typename GridT::TreeType;
  const auto tree = static_cast<const GridT&>(grid).treePtr();
  const auto& root = tree->root();
  // A damaged root table could hold the same region twice under two keys.
  constexpr int region_mask = static_cast<int>(TreeT::RootNodeType::ChildNodeType::DIM) - 1;
  for (auto it = root.cbeginChildAll(); it; ++it) {
    const openvdb::Coord key = it.getCoord();
    if (((key.x() | key.y() | key.z()) & region_mask) != 0) fail("damaged root node");
  }
  out.background = static_cast<float>(root.background());
  collect_tiles(root, out.background, out.tiles);
  out.leaves = std::make_unique<VdbLeaves<TreeT>>(tree);
}

/// A .vdb file read through openvdb's archive.
///
/// Not through openvdb::io::File: that one may copy the file, loads leaves lazily from a mapping
/// that a shorter file turns into SIGBUS, and reads on past the end of a damaged one. Here every
/// offset is checked against the file's size and the stream throws at its end.
class VdbReader final : public Reader, private openvdb::io::Archive {
 public:
  explicit VdbReader(const std::filesystem::path& file) {
    initialize_openvdb();
    size_ = static_cast<std::int64_t>(std::filesystem::file_size(file));
    stream_.open(file, std::ios::binary);
    if (!stream_) fail("cannot be opened");
    stream_.exceptions(std::ios::failbit | std::ios::badbit);
    at_end_means_truncated([this] { read_directory(); });
  }
  [[nodiscard]] const std::vector<GridEntry>& grids() const override { return entries_; }

  SourceGrid read(std::size_t index, const Log& /*log*/, const std::string& /*log_prefix*/) override {
    SourceGrid out;
    at_end_means_truncated([&] {
      openvdb::GridBase::Ptr grid = read_grid(descriptors_[index]);
      if (descriptors_[index].isInstance()) {
        const auto parent = std::find_if(descriptors_.begin(), descriptors_.end(), [&](const auto& d) {
          return d.uniqueName() == descriptors_[index].instanceParentName();
        });
        if (parent == descriptors_.end() || parent->isInstance()) fail("it shares the tree of a grid that is missing");
        grid->setTree(read_grid(*parent)->baseTreePtr());
      }
      const auto matrix = grid->transform().baseMap()->getAffineMap()->getMat4();
      // OpenVDB multiplies row vectors from the left: its rows are our columns.
      for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row) out.index_to_world[column][row] = matrix(column, row);
      }
      if (grid->isType<openvdb::FloatGrid>()) {
        take_tree<openvdb::FloatGrid>(*grid, out);
      } else {
        take_tree<openvdb::DoubleGrid>(*grid, out);
      }
    });
    return out;
  }

 private:
  template <typename Function>
  void at_end_means_truncated(Function&& function) {
    try {
      function();
    } catch (const std::ios_base::failure&) {
      fail("the file is truncated or damaged: unexpected end of file");
    }
  }

  template <typename T>
  T read_value() {
    T value;
    stream_.read(reinterpret_cast<char*>(&value), sizeof value);
    return value;
  }

  void skip_string() {
    const auto length = read_value<std::uint32_t>();
    if (length > size_ - stream_.tellg()) fail("the file is truncated or damaged: unexpected end of file");
    stream_.seekg(length, std::ios::cur);
  }

  void skip_metadata() {
    const auto count = read_value<std::uint32_t>();
    for (std::uint32_t i = 0; i < count; ++i) {
      skip_string();  // name
      skip_string();  // type
      skip_string();  // value, which has a length before it too
    }
  }

  /// Runs a walk over lengths that OpenVDB would allocate unseen, gigabytes from four damaged bytes; then rewinds.
  template <typename Walk>
  void check_lengths(Walk&& walk) {
    const auto position = stream_.tellg();
    walk();
    stream_.seekg(position);
  }

  void check_grid_head() {
    check_lengths([this] {
      if (fileVersion() >= openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION) read_value<std::uint32_t>();
      skip_metadata();
      skip_string();  // the transform's type
    });
  }

  void read_directory() {
    // Checked before OpenVDB sees it, because OpenVDB prints a warning about newer files.
    stream_.seekg(8);
    const auto version = read_value<std::uint32_t>();
    if (version > openvdb::OPENVDB_FILE_VERSION || version < openvdb::OPENVDB_FILE_VERSION_GRID_INSTANCING) {
      fail("VDB file format " + std::to_string(version) + " is not supported");
    }
    stream_.seekg(0);
    readHeader(stream_);
    metadata_ = std::make_shared<openvdb::io::StreamMetadata>();
    metadata_->setSeekable(true);
    openvdb::io::setStreamMetadataPtr(stream_, metadata_, /*transfer=*/false);
    setFormatVersion(stream_);
    setLibraryVersion(stream_);
    setDataCompression(stream_);
    check_lengths([this] { skip_metadata(); });
    openvdb::MetaMap().readMeta(stream_);
    const std::int32_t count = readGridCount(stream_);
    if (count < 0) fail("the file is damaged: negative grid count");
    for (std::int32_t i = 0; i < count; ++i) read_entry();
  }

  void read_entry() {
    openvdb::io::GridDescriptor descriptor;
    openvdb::GridBase::Ptr grid;
    check_lengths([this] {
      for (int i = 0; i < 3; ++i) skip_string();
    });
    try {
      grid = descriptor.read(stream_);
    } catch (const openvdb::LookupError&) {
      // A type this build does not know: the offsets that follow still lead past it.
      descriptor.setGridPos(read_value<std::int64_t>());
      descriptor.setBlockPos(read_value<std::int64_t>());
      descriptor.setEndPos(read_value<std::int64_t>());
    }
    const std::int64_t body = stream_.tellg();
    if (inputHasGridOffsets()) {
      if (descriptor.getGridPos() < body || descriptor.getEndPos() < descriptor.getGridPos()) {
        fail("the file is damaged: grid offsets out of order");
      }
      if (descriptor.getEndPos() > size_) {
        fail("the file is truncated: " + std::to_string(size_) + " bytes of at least " +
             std::to_string(descriptor.getEndPos()));
      }
    } else {
      if (!grid) fail("unknown grid type " + descriptor.gridType() + " in a file without offsets");
      descriptor.setGridPos(body);
    }

    GridEntry entry;
    entry.info.name = descriptor.gridName();
    entry.unique_name = openvdb::io::GridDescriptor::nameAsString(descriptor.uniqueName());
    if (!grid) {
      entry.info.type = descriptor.gridType();
      entry.info.grid_class = "unknown";
      entry.refusal = scalar_fog_refusal(entry.info.type, entry.info.grid_class, false);
    } else {
      if (inputHasGridOffsets()) {
        stream_.seekg(descriptor.getGridPos());
        check_grid_head();
        readGridCompression(stream_);
        grid->readMeta(stream_);
        grid->readTransform(stream_);
      } else {
        // Written to a pipe: where the next grid begins is known only after reading this one.
        check_grid_head();
        readGrid(grid, descriptor, stream_);
      }
      describe(*grid, descriptor, entry);
    }
    if (inputHasGridOffsets()) {
      stream_.seekg(descriptor.getEndPos());
    }
    descriptors_.push_back(descriptor);
    entries_.push_back(std::move(entry));
  }

  static void describe(const openvdb::GridBase& grid, const openvdb::io::GridDescriptor& descriptor, GridEntry& entry) {
    const bool is_float = grid.isType<openvdb::FloatGrid>();
    const bool points = grid.type().find("ptdataidx") != std::string::npos;
    entry.info.type = is_float && descriptor.saveFloatAsHalf() ? "half" : points ? "points" : grid.valueType();
    entry.info.grid_class = class_name(grid.getGridClass());
    entry.refusal =
        scalar_fog_refusal(entry.info.type, entry.info.grid_class, is_float || grid.isType<openvdb::DoubleGrid>());
    if (entry.refusal.empty() && !grid.transform().isLinear()) {
      entry.refusal = "has a frustum transform, which is not affine";
    }
  }

  openvdb::GridBase::Ptr read_grid(const openvdb::io::GridDescriptor& descriptor) {
    openvdb::GridBase::Ptr grid = openvdb::GridBase::createGrid(descriptor.gridType());
    grid->setSaveFloatAsHalf(descriptor.saveFloatAsHalf());
    stream_.seekg(descriptor.getGridPos());
    readGrid(grid, descriptor, stream_);
    return grid;
  }

  std::int64_t size_ = 0;
  openvdb::io::StreamMetadata::Ptr metadata_;  // the stream points to it
  std::ifstream stream_;  // small buffer on purpose: OpenVDB seeks at every leaf, and a seek drops the buffer
  std::vector<openvdb::io::GridDescriptor> descriptors_;
  std::vector<GridEntry> entries_;
};

}  // namespace

std::unique_ptr<Reader> open_vdb(const std::filesystem::path& file) { return std::make_unique<VdbReader>(file); }

}  // namespace cumulet::volume::detail
