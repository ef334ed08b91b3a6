#include "volume/vdb_compression.hpp"

#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <mutex>
#include <string_view>

#include "base/detached_work.hpp"
#include "volume/import_detail.hpp"
#include "volume/source_file.hpp"
#include "volume/vdb_leaves.hpp"
#include "volume/vdb_metadata.hpp"
#include "volume/vdb_trees.hpp"

namespace cumulet::volume {

void initialize_readers() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

namespace detail {
namespace {

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

using HalfGrid = openvdb::Grid<openvdb::tree::Tree4<openvdb::math::half, 5, 4, 3>::Type>;

// Differs from 224 only by grids of halves.
constexpr std::uint32_t known_file_version = 225;

/// Creates a grid. OpenVDB 10, unlike 13, does not register grids of halves, and registering them here would affect
/// OpenVDB in the whole process.
openvdb::GridBase::Ptr create_grid(const std::string& type) {
  return type == HalfGrid::gridType() ? HalfGrid::create() : openvdb::GridBase::createGrid(type);
}

/// Collects the tiles of a node and of all internal nodes below it.
template <typename NodeT, typename Pick>
void collect_tiles(const NodeT& node, Pick pick, float background, std::vector<SourceTile>& tiles) {
  using ChildT = typename NodeT::ChildNodeType;
  constexpr auto size = static_cast<int>(ChildT::DIM);
  for (auto it = node.cbeginValueAll(); it; ++it) {
    const float value = pick(*it);
    if (!it.isValueOn() && value == background) continue;
    const glm::ivec3 min = to_glm(it.getCoord());
    tiles.push_back({{min, min + (size - 1), value}, it.isValueOn()});
  }
  if constexpr (ChildT::LEVEL > 0) {
    for (auto it = node.cbeginChildOn(); it; ++it) collect_tiles(*it, pick, background, tiles);
  }
}

/// Returns everything except the leaves.
template <typename GridT, typename Pick>
SourceGrid take_grid(const openvdb::GridBase& grid, Pick pick) {
  const auto& root = static_cast<const GridT&>(grid).tree().root();
  SourceGrid out;
  const auto matrix = grid.transform().baseMap()->getAffineMap()->getMat4();
  // OpenVDB multiplies row vectors from the left: its rows are the columns here.
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 4; ++row) out.index_to_world[column][row] = matrix(column, row);
  }
  out.background = pick(root.background());
  collect_tiles(root, pick, out.background, out.tiles);
  return out;
}

/// Returns the tree of a grid for which own_tree() was called.
template <typename GridT>
std::shared_ptr<OwningTree<typename GridT::TreeType>> tree_of(openvdb::GridBase& grid) {
  return std::static_pointer_cast<OwningTree<typename GridT::TreeType>>(static_cast<GridT&>(grid).treePtr());
}

/// Calls f<GridT>() for the grid's type if its voxels can be read.
template <typename Call>
void with_type(const openvdb::GridBase& grid, Call&& f) {
  const auto try_types = [&]<typename... GridT>() {
    (void)((grid.isType<GridT>() && (f.template operator()<GridT>(), true)) || ...);
  };
  try_types.template operator()<openvdb::FloatGrid, openvdb::DoubleGrid, HalfGrid, openvdb::Int32Grid,
                                openvdb::Int64Grid, openvdb::Vec3SGrid, openvdb::Vec3DGrid, openvdb::Vec3IGrid>();
}

constexpr const char* unreadable = "has an unsupported type";

template <typename T>
T read_value(SourceFile& stream) {
  T value;
  stream.read(reinterpret_cast<char*>(&value), sizeof value);
  return value;
}

/// Returns the header of a file of version 222 or later, in a form that this OpenVDB understands, and moves the stream
/// past it. OpenVDB prints a warning for versions newer than its own, and cannot read the blank identifier that newer
/// ones may write.
std::vector<char> understood_header(SourceFile& stream) {
  constexpr std::size_t version_at = 8;
  constexpr std::size_t id_at = 8 + 3 * sizeof(std::uint32_t) + 1;
  constexpr std::string_view id = "00000000-0000-0000-0000-000000000000";
  std::vector<char> header(id_at);
  stream.seekg(0);
  stream.read(header.data(), static_cast<std::streamsize>(header.size()));
  std::uint32_t version = 0;
  std::memcpy(&version, header.data() + version_at, sizeof version);
  version = std::min<std::uint32_t>(version, openvdb::OPENVDB_FILE_VERSION);
  std::memcpy(header.data() + version_at, &version, sizeof version);
  header.insert(header.end(), id.begin(), id.end());
  stream.seekg(static_cast<std::streamoff>(header.size()));
  return header;
}

/// A .vdb file read through OpenVDB's archive.
///
/// openvdb::io::File is not used: it may copy the file, and loads leaves lazily from a mapping that causes SIGBUS if
/// the file becomes shorter. It also reads past the end of a damaged file. Here every offset is checked against the
/// file's size, and the stream throws at its end.
class VdbReader final : public Reader, private openvdb::io::Archive {
 public:
  VdbReader(std::unique_ptr<ByteSource> content, Progress* progress)
      : stream_(std::move(content), progress), size_(stream_.size()) {
    initialize_readers();
    try {
      read_directory();
    } catch (const Error&) {
      throw;
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& e) {
      if (remarks_.empty()) throw;
      const bool at_end = dynamic_cast<const std::ios_base::failure*>(&e) != nullptr;
      fail(std::string(at_end ? end_of_file : e.what()) + "; it " + remarks_[0]);
    }
  }
  [[nodiscard]] const std::vector<GridInfo>& grids() const override { return entries_; }
  [[nodiscard]] const std::vector<Metadata>& metadata() const override { return file_metadata_; }
  [[nodiscard]] const std::string& format() const override { return format_; }
  [[nodiscard]] std::vector<std::string> remarks() const override { return remarks_; }

  [[nodiscard]] double opened() const override { return inputHasGridOffsets() ? 0.0 : 0.35; }
  [[nodiscard]] double reading() const override { return 0.1; }
  [[nodiscard]] bool streams() const override {
    return fileVersion() >= openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION;
  }

  SourceGrid read(std::size_t index, Portion portion, const Log& /*log*/, const std::string& /*log_prefix*/) override {
    const openvdb::GridBase::Ptr grid = read_topology(index, portion);
    SourceGrid out;
    with_type(*grid, [&]<typename GridT>() {
      out = take_grid<GridT>(*grid, Lengths());
      out.leaves = std::make_unique<StreamedLeaves<typename GridT::TreeType, Lengths>>(tree_of<GridT>(*grid), Lengths(),
                                                                                       vdb_stream());
    });
    if (!out.leaves) fail(unreadable);
    return out;
  }

  std::array<SourceGrid, 3> read_vector(std::size_t index, Portion portion, const Log& /*log*/,
                                        const std::string& /*log_prefix*/) override {
    const openvdb::GridBase::Ptr grid = read_topology(index, portion);
    std::array<SourceGrid, 3> out;
    with_type(*grid, [&]<typename GridT>() {
      if constexpr (!is_number<typename GridT::ValueType>) {
        const auto tree = tree_of<GridT>(*grid);
        tree->fill(vdb_stream());
        for (int axis = 0; axis < 3; ++axis) {
          out[axis] = take_grid<GridT>(*grid, Component{axis});
          out[axis].leaves = std::make_unique<VdbLeaves<typename GridT::TreeType, Component>>(tree, Component{axis});
        }
      }
    });
    if (!out[0].leaves) fail(unreadable);
    return out;
  }

 private:
  void skip_string() {
    const auto length = read_value<std::uint32_t>(stream_);
    if (length > size_ - stream_.tellg()) fail(end_of_file);
    stream_.seekg(length, std::ios::cur);
  }

  void skip_metadata() {
    const auto count = read_value<std::uint32_t>(stream_);
    for (std::uint32_t i = 0; i < count; ++i) {
      skip_string();  // name
      skip_string();  // type
      skip_string();  // value, which has a length prefix as well
    }
  }

  /// Runs a check of lengths for which OpenVDB would allocate memory without validation (gigabytes from four damaged
  /// bytes), then rewinds.
  template <typename Walk>
  void check_lengths(Walk&& walk) {
    const auto position = stream_.tellg();
    walk();
    stream_.seekg(position);
  }

  void check_grid_head() {
    check_lengths([this] {
      if (fileVersion() >= openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION) read_value<std::uint32_t>(stream_);
      skip_metadata();
      skip_string();  // the transform's type
    });
  }

  void read_directory() {
    stream_.seekg(8);
    const auto version = read_value<std::uint32_t>(stream_);
    if (version < openvdb::OPENVDB_FILE_VERSION_GRID_INSTANCING) {
      fail("VDB file format " + std::to_string(version) + " is not supported: this library reads " +
           std::to_string(openvdb::OPENVDB_FILE_VERSION_GRID_INSTANCING) + " and later");
    }
    if (version > known_file_version) {
      remarks_.push_back("has VDB file format " + std::to_string(version) + ", which is newer than the known " +
                         std::to_string(known_file_version));
    }
    format_ = "OpenVDB " + std::to_string(version);
    stream_.seekg(0);
    if (version < openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION) {
      readHeader(stream_);
    } else {
      std::vector<char> header = understood_header(stream_);
      MemoryStream copy(header);
      readHeader(copy);
    }
    metadata_ = std::make_shared<openvdb::io::StreamMetadata>();
    metadata_->setSeekable(true);
    openvdb::io::setStreamMetadataPtr(stream_, metadata_, /*transfer=*/false);
    setFormatVersion(stream_);
    setLibraryVersion(stream_);
    setDataCompression(stream_);
    check_lengths([this] { skip_metadata(); });
    openvdb::MetaMap metadata;
    metadata.readMeta(stream_);
    file_metadata_ = metadata_of(metadata);
    const std::int32_t count = readGridCount(stream_);
    if (!inputHasGridOffsets()) stream_.begin(0.0, opened(), static_cast<std::uint64_t>(size_));
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
      if (descriptor.gridType() == HalfGrid::gridType()) {
        grid = HalfGrid::create();
        grid->setSaveFloatAsHalf(descriptor.saveFloatAsHalf());
      }
      // For a grid of an unknown type, the offsets lead past it.
      descriptor.setGridPos(read_value<std::int64_t>(stream_));
      descriptor.setBlockPos(read_value<std::int64_t>(stream_));
      descriptor.setEndPos(read_value<std::int64_t>(stream_));
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

    GridInfo entry;
    entry.name = descriptor.gridName();
    entry.unique_name = openvdb::io::GridDescriptor::nameAsString(descriptor.uniqueName());
    if (!grid) {
      entry.type = descriptor.gridType();
      entry.grid_class = "unknown";
      entry.refusal = scalar_fog_refusal(entry.type, entry.grid_class, false);
    } else {
      if (inputHasGridOffsets()) {
        stream_.seekg(descriptor.getGridPos());
        check_grid_head();
        readGridCompression(stream_);
        grid->readMeta(stream_);
        grid->readTransform(stream_);
      } else {
        // Written to a pipe: the next grid's position is known only after reading this one.
        check_grid_head();
        stream_.hold(!own_tree(*grid));
        readGrid(grid, descriptor, stream_);
        stream_.hold(false);
        with_type(*grid, [&]<typename GridT>() { tree_of<GridT>(*grid)->pass(vdb_stream()); });
      }
      describe(*grid, descriptor, entry);
    }
    if (inputHasGridOffsets()) {
      stream_.seekg(descriptor.getEndPos());
    }
    descriptors_.push_back(descriptor);
    entries_.push_back(std::move(entry));
  }

  static void describe(const openvdb::GridBase& grid, const openvdb::io::GridDescriptor& descriptor, GridInfo& entry) {
    const bool is_float = grid.isType<openvdb::FloatGrid>();
    const bool points = grid.type().find("ptdataidx") != std::string::npos;
    entry.type = is_float && descriptor.saveFloatAsHalf() ? "half" : points ? "points" : grid.valueType();
    entry.grid_class = class_name(grid.getGridClass());
    entry.refusal = scalar_fog_refusal(entry.type, entry.grid_class,
                                       is_float || grid.isType<openvdb::DoubleGrid>() || grid.isType<HalfGrid>());
    entry.metadata = metadata_of(grid);
    if (!grid.transform().isLinear()) {
      if (entry.refusal.empty()) entry.refusal = "has a frustum transform, which is not affine";
      return;
    }
    if (points) return;
    with_type(grid, [&]<typename GridT>() {
      entry.values = is_number<typename GridT::ValueType> ? Values::scalars : Values::lengths;
    });
  }

  /// Gives the grid an OwningTree. Returns false if its type is not supported; reading it can then not be cancelled.
  static bool own_tree(openvdb::GridBase& grid) {
    bool own = false;
    with_type(grid, [&]<typename GridT>() {
      grid.setTree(make_deferred_delete<OwningTree<typename GridT::TreeType>>());
      own = true;
    });
    return own;
  }

  /// Reads a grid's tree, which may be shared with another grid; the leaves' values are still in the file.
  openvdb::GridBase::Ptr read_topology(std::size_t index, Portion portion) {
    openvdb::GridBase::Ptr grid = read_grid(descriptors_[index], portion);
    if (descriptors_[index].isInstance()) {
      const auto parent = std::find_if(descriptors_.begin(), descriptors_.end(), [&](const auto& d) {
        return d.uniqueName() == descriptors_[index].instanceParentName();
      });
      if (parent == descriptors_.end() || parent->isInstance()) fail("it shares the tree of a missing grid");
      grid->setTree(read_grid(*parent, portion)->baseTreePtr());
    }
    return grid;
  }

  openvdb::GridBase::Ptr read_grid(const openvdb::io::GridDescriptor& descriptor, Portion portion) {
    stream_.clear();  // making a proxy may have failed
    stream_.hold(false);
    stream_.seekg(descriptor.getGridPos());
    // An instance has no tree. Without offsets the end of a grid is unknown, and the file's end is used.
    if (!descriptor.isInstance()) {
      const std::int64_t bytes =
          inputHasGridOffsets() ? descriptor.getEndPos() - descriptor.getGridPos() : size_ - descriptor.getGridPos();
      stream_.begin(portion.from, portion.to, static_cast<std::uint64_t>(bytes));
    }
    openvdb::GridBase::Ptr grid = create_grid(descriptor.gridType());
    own_tree(*grid);
    grid->setSaveFloatAsHalf(descriptor.saveFloatAsHalf());
    readGrid(grid, descriptor, stream_);
    const std::int64_t end = inputHasGridOffsets() ? descriptor.getEndPos() : size_;
    with_type(*grid, [&]<typename GridT>() { tree_of<GridT>(*grid)->ends_at(end); });
    return grid;
  }

  VdbStream vdb_stream() { return {stream_, metadata_}; }

  openvdb::io::StreamMetadata::Ptr metadata_;  // the stream points to it
  std::vector<Metadata> file_metadata_;
  std::string format_;
  std::vector<std::string> remarks_;
  SourceFile stream_;
  std::int64_t size_;
  std::vector<openvdb::io::GridDescriptor> descriptors_;
  std::vector<GridInfo> entries_;
};

}  // namespace

std::unique_ptr<Reader> open_vdb(std::unique_ptr<ByteSource> content, Progress* progress) {
  return std::make_unique<VdbReader>(std::move(content), progress);
}

}  // namespace detail
}  // namespace cumulet::volume
