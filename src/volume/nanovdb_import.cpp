#include <blosc.h>
#include <tbb/parallel_for.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <new>

#include "volume/import_detail.hpp"
#include "volume/nanovdb_directory.hpp"
#include "volume/source_file.hpp"

namespace cumulet::volume::detail {
namespace {

using nanovdb::io::Codec;

/// The bytes of a grid, uninitialized and aligned as NanoVDB requires. NanoVDB's own handle is not used: since OpenVDB
/// 11 it reads a grid's counts without validation.
class GridBuffer {
 public:
  explicit GridBuffer(std::uint64_t size)
      : bytes_(static_cast<std::uint8_t*>(operator new(size, alignment))), size_(size) {}

  [[nodiscard]] std::uint8_t* data() const { return bytes_.get(); }
  [[nodiscard]] std::uint64_t size() const { return size_; }

 private:
  static constexpr std::align_val_t alignment{NANOVDB_DATA_ALIGNMENT};
  struct Delete {
    void operator()(std::uint8_t* bytes) const { operator delete(bytes, alignment); }
  };
  std::unique_ptr<std::uint8_t, Delete> bytes_;
  std::uint64_t size_;
};

glm::ivec3 child_offset(std::uint32_t i, unsigned log2_table, unsigned log2_child) {
  const std::uint32_t mask = (1U << log2_table) - 1U;
  return {glm::uvec3(i >> (2U * log2_table), (i >> log2_table) & mask, i & mask) << log2_child};
}

template <typename BuildT, typename Pick>
class NanoLeaves final : public HeldLeaves {
 public:
  using LeafT = nanovdb::NanoLeaf<BuildT>;

  NanoLeaves(std::shared_ptr<const GridBuffer> buffer, Pick pick) : buffer_(std::move(buffer)), pick_(pick) {}
  void add(const LeafT* leaf, glm::ivec3 origin) {
    leaves_.push_back(leaf);
    origins_.push_back(origin);
  }

  [[nodiscard]] std::size_t count() const override { return leaves_.size(); }
  [[nodiscard]] glm::ivec3 origin(std::size_t leaf) const override { return origins_[leaf]; }
  [[nodiscard]] ActiveMask active(std::size_t leaf) const override {
    const auto& bits = leaves_[leaf]->data()->mValueMask;  // its words have no accessor in all versions
    ActiveMask mask;
    static_assert(sizeof mask == sizeof bits);
    std::memcpy(mask.data(), reinterpret_cast<const std::byte*>(&bits), sizeof mask);
    return mask;
  }
  void values(std::size_t leaf, float* out) const override {
    const auto* data = leaves_[leaf]->data();
    for (std::uint32_t i = 0; i < brick_voxels; ++i) out[i] = pick_(data->getValue(i));
  }

 private:
  std::shared_ptr<const GridBuffer> buffer_;  // owns the memory of the leaves
  Pick pick_;
  std::vector<const LeafT*> leaves_;
  std::vector<glm::ivec3> origins_;
};

/// Traverses a grid's buffer and validates all offsets: NanoVDB itself does not check them.
template <typename BuildT, typename Pick = Lengths>
class NanoWalk {
 public:
  using GridT = nanovdb::NanoGrid<BuildT>;
  using TreeT = nanovdb::NanoTree<BuildT>;
  using RootT = nanovdb::NanoRoot<BuildT>;
  using UpperT = nanovdb::NanoUpper<BuildT>;
  using LowerT = nanovdb::NanoLower<BuildT>;
  using LeafT = nanovdb::NanoLeaf<BuildT>;

  static SourceGrid run(std::shared_ptr<const GridBuffer> buffer, const Log& log, const std::string& log_prefix,
                        const Progress* progress, Pick pick = {}) {
    NanoWalk walk(buffer->data(), buffer->size(), progress, pick);
    walk.tree(log, log_prefix);
    auto leaves = std::make_unique<NanoLeaves<BuildT, Pick>>(std::move(buffer), pick);
    for (const auto& [leaf, origin] : walk.leaves_) leaves->add(leaf, origin);
    walk.out_.leaves = std::move(leaves);
    return std::move(walk.out_);
  }

 private:
  NanoWalk(const std::uint8_t* begin, std::uint64_t size, const Progress* progress, Pick pick)
      : begin_(begin), size_(size), progress_(progress), pick_(pick) {}

  [[noreturn]] static void damaged(const char* what) { fail(std::string("the file is damaged: ") + what); }

  /// Returns the object at this offset from another one. Throws unless it is within the buffer.
  template <typename T>
  const T* at(const void* from, std::int64_t offset, std::uint64_t bytes = sizeof(T)) const {
    const auto start = static_cast<const std::uint8_t*>(from) - begin_;
    const auto limit = static_cast<std::int64_t>(size_);
    if (offset < -limit || offset > limit) damaged("an offset leads outside of the grid");
    const std::int64_t position = start + offset;
    if (position < 0 || position > limit || bytes > size_ - static_cast<std::uint64_t>(position) ||
        position % NANOVDB_DATA_ALIGNMENT != 0) {
      damaged("an offset leads outside of the grid");
    }
    return reinterpret_cast<const T*>(begin_ + position);
  }

  /// Every node has one parent, so visiting more nodes than fit the buffer means that the tree is invalid.
  void count(int level, std::uint64_t bytes) {
    node_bytes_ += bytes;
    if (++visited_[level] > declared_[level] || node_bytes_ > size_) damaged("its tree has more nodes than declared");
  }

  void tile(glm::ivec3 min, int size, float value, bool active) {
    if (!active && value == out_.background) return;
    out_.tiles.push_back({{min, min + (size - 1), value}, active});
  }

  void tree(const Log& log, const std::string& log_prefix) {
    const auto* grid = at<GridT>(begin_, 0);
    const auto* tree = at<TreeT>(begin_, sizeof(GridT));
    std::copy_n(tree->data()->mNodeCount, 3, declared_);
    const std::uint64_t root_offset = tree->data()->mNodeOffset[3];
    if (root_offset > size_) damaged("an offset leads outside of the grid");
    const auto* root = at<RootT>(tree, static_cast<std::int64_t>(root_offset));
    const std::uint64_t tiles = root->data()->mTableSize;
    const std::uint64_t root_bytes = sizeof(RootT) + tiles * sizeof(typename RootT::DataType::Tile);
    at<RootT>(root, 0, root_bytes);

    // The checksum covers contiguous bytes; in a damaged file the root may be elsewhere.
    if (root_offset == sizeof(TreeT) && !has_right_checksum(*grid->data(), root_bytes)) {
      log.warning(log_prefix + "its checksum does not match; the file may be damaged");
    }

    const nanovdb::Map& map = grid->data()->mMap;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) out_.index_to_world[column][row] = map.mMatD[row * 3 + column];
      out_.index_to_world[3][row] = map.mVecD[row];
    }
    out_.background = pick_(root->data()->mBackground);

    constexpr auto size = static_cast<int>(UpperT::DIM);
    std::map<std::array<int, 3>, bool> regions;
    for (std::uint32_t i = 0; i < tiles; ++i) {
      const auto* entry = root->data()->tile(i);
      const nanovdb::Coord key = entry->origin();
      const glm::ivec3 origin(key[0], key[1], key[2]);
      if (((origin.x | origin.y | origin.z) & (size - 1)) != 0) damaged("misaligned root tile");
      if (!regions.insert({{origin.x, origin.y, origin.z}, true}).second)
        damaged("two root tiles at the same position");
      if (entry->isChild()) {
        upper(*at<UpperT>(root, entry->child), origin);
      } else {
        tile(origin, size, pick_(entry->value), entry->isActive());
      }
    }
  }

  void upper(const UpperT& node, glm::ivec3 origin) {
    count(2, sizeof(UpperT));
    const auto* data = node.data();
    constexpr auto size = static_cast<int>(LowerT::DIM);
    for (std::uint32_t i = 0; i < UpperT::SIZE; ++i) {
      const glm::ivec3 child = origin + child_offset(i, UpperT::LOG2DIM, LowerT::TOTAL);
      if (data->isChild(i)) {
        lower(*at<LowerT>(data, data->mTable[i].child), child);
      } else {
        tile(child, size, pick_(data->getValue(i)), data->isActive(i));
      }
    }
  }

  void lower(const LowerT& node, glm::ivec3 origin) {
    check(progress_);
    count(1, sizeof(LowerT));
    const auto* data = node.data();
    for (std::uint32_t i = 0; i < LowerT::SIZE; ++i) {
      const glm::ivec3 child = origin + child_offset(i, LowerT::LOG2DIM, LeafT::TOTAL);
      if (data->isChild(i)) {
        const auto* leaf = at<LeafT>(data, data->mTable[i].child);
        std::uint64_t bytes = sizeof(LeafT);
        if constexpr (std::is_same_v<BuildT, nanovdb::FpN>) {
          if (leaf->data()->mFlags >> 5U > 4) damaged("a leaf has an invalid bit width");
          bytes = leaf->data()->memUsage();
          at<LeafT>(data, data->mTable[i].child, bytes);
        }
        count(0, bytes);
        leaves_.emplace_back(leaf, child);
      } else {
        tile(child, brick_size, pick_(data->getValue(i)), data->isActive(i));
      }
    }
  }

  const std::uint8_t* begin_;
  std::uint64_t size_;
  const Progress* progress_;
  Pick pick_;
  std::uint32_t declared_[3] = {};
  std::uint64_t visited_[3] = {};
  std::uint64_t node_bytes_ = 0;
  SourceGrid out_;
  std::vector<std::pair<const LeafT*, glm::ivec3>> leaves_;
};

/// A .nvdb file. NanoVDB's own reader is not used: it does not validate sizes.
class NanoReader final : public Reader {
 public:
  NanoReader(std::unique_ptr<ByteSource> content, Progress* progress)
      : progress_(progress),
        stream_(std::move(content), progress),
        size_(static_cast<std::uint64_t>(stream_.size())),
        directory_(read_nano_directory(stream_)) {}

  [[nodiscard]] const std::vector<GridInfo>& grids() const override { return directory_.grids; }
  [[nodiscard]] const std::vector<Metadata>& metadata() const override { return metadata_; }
  [[nodiscard]] const std::string& format() const override { return directory_.format; }
  [[nodiscard]] std::vector<std::string> remarks() const override { return directory_.remarks; }
  [[nodiscard]] double reading() const override { return 0.7; }

  SourceGrid read(std::size_t index, Portion portion, const Log& log, const std::string& log_prefix) override {
    std::shared_ptr<const GridBuffer> buffer = load_checked(index, portion);
    switch (directory_.locations[index].type) {
      case nanovdb::GridType::Float:
        return NanoWalk<float>::run(std::move(buffer), log, log_prefix, progress_);
      case nanovdb::GridType::Double:
        return NanoWalk<double>::run(std::move(buffer), log, log_prefix, progress_);
      case nanovdb::GridType::Fp4:
        return NanoWalk<nanovdb::Fp4>::run(std::move(buffer), log, log_prefix, progress_);
      case nanovdb::GridType::Fp8:
        return NanoWalk<nanovdb::Fp8>::run(std::move(buffer), log, log_prefix, progress_);
      case nanovdb::GridType::Fp16:
        return NanoWalk<nanovdb::Fp16>::run(std::move(buffer), log, log_prefix, progress_);
      case nanovdb::GridType::FpN:
        return NanoWalk<nanovdb::FpN>::run(std::move(buffer), log, log_prefix, progress_);
      case nanovdb::GridType::Vec3f:
        return NanoWalk<nanovdb::Vec3f>::run(std::move(buffer), log, log_prefix, progress_);
      case nanovdb::GridType::Vec3d:
        return NanoWalk<nanovdb::Vec3d>::run(std::move(buffer), log, log_prefix, progress_);
      default:
        fail(unreadable);
    }
  }

  std::array<SourceGrid, 3> read_vector(std::size_t index, Portion portion, const Log& log,
                                        const std::string& log_prefix) override {
    const std::shared_ptr<const GridBuffer> buffer = load_checked(index, portion);
    const auto components = [&]<typename BuildT>() {
      std::array<SourceGrid, 3> out;
      for (int axis = 0; axis < 3; ++axis) {
        // Problems of the grid are logged once.
        const Log& heard = axis > 0 ? Log() : log;
        out[axis] = NanoWalk<BuildT, Component>::run(buffer, heard, log_prefix, progress_, Component{axis});
      }
      return out;
    };
    if (directory_.locations[index].type == nanovdb::GridType::Vec3f)
      return components.template operator()<nanovdb::Vec3f>();
    if (directory_.locations[index].type == nanovdb::GridType::Vec3d)
      return components.template operator()<nanovdb::Vec3d>();
    fail(unreadable);
  }

 private:
  void read_bytes(std::uint64_t position, void* to, std::uint64_t bytes) {
    if (position > size_ || bytes > size_ - position) fail(end_of_file);
    stream_.seekg(static_cast<std::streamoff>(position));
    stream_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes));
  }

  std::shared_ptr<const GridBuffer> load_checked(std::size_t index, Portion portion) {
    auto buffer = std::make_shared<const GridBuffer>(load(directory_.locations[index], portion));
    if (buffer->size() < sizeof(nanovdb::GridData)) fail("the file is damaged: grid too small");
    const auto* grid = reinterpret_cast<const nanovdb::GridData*>(buffer->data());
    if (!is_nano_grid(*grid)) fail("the file is damaged: missing grid");
    if (grid->mGridType != directory_.locations[index].type)
      fail("the file is damaged: grid and directory differ in type");
    return buffer;
  }

  /// Reads and decodes a grid, validating all sizes. NanoVDB's own reader does not, and cannot be cancelled.
  GridBuffer load(const NanoLocation& location, Portion portion) {
    // No codec exceeds zlib's ratio of 1032 to 1: a larger size is rejected before memory is allocated.
    constexpr std::uint64_t max_expansion = 1040;
    if (location.memory_bytes == 0 || location.memory_bytes / max_expansion > location.file_bytes) fail(sizes_differ);
    if (location.codec == Codec::NONE && location.memory_bytes != location.file_bytes) fail(sizes_differ);
    ProgressPart& part = stream_.begin(
        portion.from, portion.to, location.file_bytes + (location.codec == Codec::NONE ? 0 : location.memory_bytes));
    GridBuffer buffer(location.memory_bytes);
    std::uint64_t position = location.position;
    std::uint64_t rest = location.file_bytes;
    const auto next_frame = [&] {
      std::uint64_t bytes = 0;
      if (rest < sizeof bytes) fail(sizes_differ);
      read_bytes(position, &bytes, sizeof bytes);
      position += sizeof bytes;
      rest -= sizeof bytes;
      if (bytes > rest) fail(sizes_differ);
      position += bytes;
      rest -= bytes;
      return bytes;
    };
    switch (location.codec) {
      case Codec::ZIP: {
        const std::uint64_t frame = next_frame();
        inflate_frame(frame, buffer.data(), location.memory_bytes, part);
        break;
      }
      case Codec::BLOSC:
        for (std::uint64_t done = 0; done < location.memory_bytes;) {
          const std::uint64_t chunk = std::min<std::uint64_t>(location.memory_bytes - done, max_chunk);
          const std::uint64_t frame = next_frame();
          unpack_frame(frame, buffer.data() + done, chunk, part);
          done += chunk;
        }
        break;
      default:
        read_bytes(position, buffer.data(), location.memory_bytes);
        rest = 0;
    }
    if (rest != 0) fail(sizes_differ);
    return buffer;
  }

  /// Decodes the zlib frame at the stream's position.
  void inflate_frame(std::uint64_t frame, std::uint8_t* to, std::uint64_t bytes, ProgressPart& part) {
    z_stream zip{};
    if (inflateInit(&zip) != Z_OK) throw std::bad_alloc();
    const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&zip, inflateEnd);
    std::vector<Bytef> input(std::size_t{64} << 10U);
    std::uint64_t done = 0;
    for (int status = Z_OK; status != Z_STREAM_END;) {
      if (zip.avail_in == 0) {
        const std::uint64_t n = std::min<std::uint64_t>(frame, input.size());
        if (n == 0) fail(sizes_differ);
        stream_.read(reinterpret_cast<char*>(input.data()), static_cast<std::streamsize>(n));
        frame -= n;
        zip.next_in = input.data();
        zip.avail_in = static_cast<uInt>(n);
      }
      const auto room = static_cast<uInt>(std::min<std::uint64_t>(bytes - done, max_piece));
      zip.next_out = to + done;
      zip.avail_out = room;
      status = inflate(&zip, Z_NO_FLUSH);
      const uInt got = room - zip.avail_out;
      if (status != Z_OK && status != Z_STREAM_END) fail(sizes_differ);
      done += got;
      part.add(got);
    }
    if (done != bytes) fail(sizes_differ);
  }

  /// Decodes the Blosc frame at the stream's position.
  void unpack_frame(std::uint64_t frame, std::uint8_t* to, std::uint64_t bytes, ProgressPart& part) {
    std::vector<char> packed;
    part.resize(packed, frame);
    stream_.read(packed.data(), static_cast<std::streamsize>(frame));
    std::size_t whole = 0;
    std::size_t block = 0;
    std::size_t item = 0;
    int flags = 0;
    if (frame < BLOSC_MIN_HEADER_LENGTH || blosc_cbuffer_validate(packed.data(), frame, &whole) != 0 || whole != bytes)
      fail(sizes_differ);
    blosc_cbuffer_sizes(packed.data(), &whole, &frame, &block);
    blosc_cbuffer_metainfo(packed.data(), &item, &flags);
    if (block == 0 || item == 0 || block % item != 0 || bytes % item != 0) fail(sizes_differ);
    // Blocks are compressed independently.
    const std::uint64_t piece = std::max<std::uint64_t>(max_piece / block, 1) * block;
    tbb::parallel_for(std::uint64_t{0}, (bytes + piece - 1) / piece, [&](std::uint64_t i) {
      part.check();
      const std::uint64_t n = std::min(piece, bytes - i * piece);
      const int got =
          blosc_getitem(packed.data(), static_cast<int>(i * piece / item), static_cast<int>(n / item), to + i * piece);
      if (got < 0 || static_cast<std::uint64_t>(got) != n) fail(sizes_differ);
      part.add(n);
    });
  }

  static constexpr const char* unreadable = "has an unsupported type";
  static constexpr const char* sizes_differ = "the file is damaged: inconsistent sizes";
  static constexpr std::uint64_t max_chunk = std::uint64_t{1} << 30U;  ///< NanoVDB's maximum per Blosc frame
  static constexpr std::uint64_t max_piece = std::uint64_t{4} << 20U;  ///< bytes between cancellation checks

  Progress* progress_;
  SourceFile stream_;
  std::uint64_t size_;
  std::vector<Metadata> metadata_;  // always empty: the format has no metadata
  NanoDirectory directory_;
};

}  // namespace

std::unique_ptr<Reader> open_nanovdb(std::unique_ptr<ByteSource> content, Progress* progress) {
  return std::make_unique<NanoReader>(std::move(content), progress);
}

}  // namespace cumulet::volume::detail
