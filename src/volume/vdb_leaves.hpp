#pragma once

// Private to volume/: the leaves of OpenVDB's trees. Include it after vdb_compression.hpp.

#include <openvdb/io/io.h>
#include <openvdb/openvdb.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <istream>
#include <memory>
#include <optional>
#include <streambuf>
#include <utility>
#include <vector>

#include "volume/import_detail.hpp"
#include "volume/source_file.hpp"
#include "volume/vdb_compression.hpp"

namespace cumulet::volume::detail {

inline glm::ivec3 to_glm(const openvdb::Coord& c) { return {c.x(), c.y(), c.z()}; }

template <typename LeafT>
ActiveMask active_of(const LeafT& leaf) {
  ActiveMask mask;
  for (openvdb::Index x = 0; x < brick_size; ++x) mask[x] = leaf.getValueMask().template getWord<std::uint64_t>(x);
  return mask;
}

/// A stream over bytes; it throws at their end.
class MemoryStream final : public std::istream {
 public:
  explicit MemoryStream(std::vector<char>& bytes) : std::istream(nullptr), buffer_(bytes) {
    rdbuf(&buffer_);
    exceptions(std::ios::failbit | std::ios::badbit);
  }

 private:
  class Buffer final : public std::streambuf {
   public:
    explicit Buffer(std::vector<char>& bytes) { setg(bytes.data(), bytes.data(), bytes.data() + bytes.size()); }

   protected:
    pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode which) override {
      const off_type base = from == std::ios_base::beg   ? 0
                            : from == std::ios_base::cur ? gptr() - eback()
                                                         : egptr() - eback();
      return seekpos(base + offset, which);
    }
    pos_type seekpos(pos_type position, std::ios_base::openmode /*which*/) override {
      const off_type target = position;
      if (target < 0 || target > egptr() - eback()) return {off_type{-1}};
      setg(eback(), eback() + target, egptr());
      return position;
    }
  };
  Buffer buffer_;
};

/// A file with the stream metadata of OpenVDB, to which the stream points.
struct VdbStream {
  SourceFile& file;
  openvdb::io::StreamMetadata::Ptr& metadata;
};

/// An OpenVDB tree that leaves its leaves' values in the file, and frees the nodes it has read if its stream throws:
/// OpenVDB's own root leaks the child that it was reading, with all nodes below.
template <typename TreeT>
class OwningTree final : public TreeT {
 public:
  using LeafT = typename TreeT::LeafNodeType;
  using ValueT = typename TreeT::ValueType;

  void readTopology(std::istream& in, bool from_half) override {
    using RootT = typename TreeT::RootNodeType;
    using ChildT = typename RootT::ChildNodeType;
    const auto read = [&]<typename T>(T& value) { in.read(reinterpret_cast<char*>(&value), sizeof value); };
    this->clear();
    std::int32_t buffers = 0;  // per leaf; each leaf repeats it
    read(buffers);
    RootT& root = this->root();
    ValueT background{};
    read(background);
    root.setBackground(background, false);
    openvdb::io::setGridBackgroundValuePtr(in, &root.background());
    // A node that was read only in part holds the background where child pointers should be. It can be freed if these
    // are null pointers. Otherwise it must be read completely, and is leaked if the file ends before.
    const bool frees = std::all_of(reinterpret_cast<const char*>(&background),
                                   reinterpret_cast<const char*>(&background + 1), [](char c) { return c == 0; });
    auto& file = dynamic_cast<SourceFile&>(in);
    openvdb::Index tiles = 0;
    openvdb::Index children = 0;
    read(tiles);
    read(children);
    const auto read_key = [&] {
      std::array<std::int32_t, 3> key{};
      read(key);
      // A damaged table could contain the same region twice under two keys.
      if (((key[0] | key[1] | key[2]) & static_cast<int>(ChildT::DIM - 1)) != 0) fail("damaged root node");
      return openvdb::Coord(key.data());
    };
    for (openvdb::Index i = 0; i < tiles; ++i) {
      const openvdb::Coord key = read_key();
      ValueT value{};
      std::uint8_t active = 0;
      read(value);
      read(active);
      root.addTile(key, value, active != 0);
    }
    for (openvdb::Index i = 0; i < children; ++i) {
      auto child = std::make_unique<ChildT>(openvdb::PartialCreate(), read_key(), background);
      file.hold(!frees);
      try {
        child->readTopology(in, from_half);
      } catch (...) {
        if (!frees) (void)child.release();
        throw;
      }
      file.hold(false);
      root.addChild(child.release());
    }
  }

  /// Records the position of the values instead of reading them.
  void readBuffers(std::istream& in, bool from_half) override {
    buffers_ = Buffers{in.tellg(), from_half, openvdb::io::StreamMetadata(*openvdb::io::getStreamMetadataPtr(in))};
    // The file's own index is not used, because it is not validated.
    buffers_->settings.gridMetadata().clearMetadata();
  }
  /// Sets the end of the grid in the file (or of the file), for progress.
  void ends_at(std::int64_t end) { end_ = end; }

  /// Reads all values into the leaves.
  void fill(const VdbStream& stream) {
    if (!buffers_) return;
    std::vector<LeafT*> leaves;
    this->getNodes(leaves);
    stream.file.seekg(buffers_->position);
    with_settings(stream, [&] {
      for (LeafT* leaf : leaves) leaf->readBuffers(stream.file, buffers_->from_half);
    });
  }
  /// Moves the stream, which is at the values, past them.
  void pass(const VdbStream& stream) const {
    if (!buffers_) return;
    std::vector<const LeafT*> leaves;
    this->getNodes(leaves);
    std::vector<char> bytes;
    with_settings(stream, [&] {
      for (const LeafT* leaf : leaves) {
        bytes.clear();
        is_indexed() ? copy(stream.file, *leaf, bytes) : read(stream.file, *leaf, [](const LeafT&) {});
      }
    });
  }
  /// Calls take(index in leaves, leaf with values) for each chosen leaf, on several threads, until one call returns
  /// false. leaves: all leaves of the tree. Returns whether no call returned false.
  template <class Take>
  bool sweep(const VdbStream& stream, const std::vector<const LeafT*>& leaves, const LeafSource::Choice& chosen,
             Portion portion, const Take& take) const {
    if (!buffers_) return true;
    stream.file.seekg(buffers_->position);
    stream.file.begin(portion.from, portion.to,
                      static_cast<std::uint64_t>(std::max(end_, buffers_->position) - buffers_->position));
    std::atomic<bool> wanted = true;
    if (!is_indexed()) {
      with_settings(stream, [&] {
        for (std::size_t i = 0; i < leaves.size() && wanted; ++i)
          read(stream.file, *leaves[i], [&](const LeafT& leaf) { wanted = (chosen && !chosen(i)) || take(i, leaf); });
      });
      return wanted;
    }
    // One thread reads the compressed data run by run; all threads decompress.
    struct Run {
      std::vector<std::size_t> leaves;
      std::vector<char> bytes;
    };
    using RunPtr = std::shared_ptr<Run>;
    // Short runs first: a sweep that stops early has then read little ahead.
    constexpr std::size_t max_leaves = 256;
    std::size_t leaves_a_run = 4;
    std::size_t next = 0;
    std::vector<char> head;
    const auto take_run = [&](tbb::flow_control& flow) -> RunPtr {
      if (next == leaves.size() || !wanted) {
        flow.stop();
        return nullptr;
      }
      const auto run = std::make_shared<Run>();
      for (; next != leaves.size() && run->leaves.size() != leaves_a_run; ++next) {
        if (chosen && !chosen(next)) {
          pass_over(stream.file, *leaves[next], head);
        } else {
          copy(stream.file, *leaves[next], run->bytes);
          run->leaves.push_back(next);
        }
      }
      leaves_a_run = std::min(2 * leaves_a_run, max_leaves);
      return run;
    };
    const auto unpack = [&](const RunPtr& run) {
      MemoryStream in(run->bytes);
      auto settings = std::make_shared<openvdb::io::StreamMetadata>(buffers_->settings);
      settings->transferTo(in);
      openvdb::io::setStreamMetadataPtr(in, settings, /*transfer=*/false);
      for (const std::size_t i : run->leaves) {
        if (!wanted) break;
        read(in, *leaves[i], [&](const LeafT& leaf) {
          if (!take(i, leaf)) wanted = false;
        });
      }
    };
    const auto at_a_time = 2 * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
    tbb::parallel_pipeline(at_a_time, tbb::make_filter<void, RunPtr>(tbb::filter_mode::serial_in_order, take_run) &
                                          tbb::make_filter<RunPtr, void>(tbb::filter_mode::parallel, unpack));
    return wanted;
  }

 private:
  struct Buffers {
    std::int64_t position;
    bool from_half;
    openvdb::io::StreamMetadata settings;
  };

  /// Whether leaf values have the layout that copy() supports.
  [[nodiscard]] bool is_indexed() const {
    return buffers_->settings.fileVersion() >= openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION;
  }

  template <class Work>
  void with_settings(const VdbStream& stream, const Work& work) const {
    auto settings = std::make_shared<openvdb::io::StreamMetadata>(buffers_->settings);
    struct Restore {
      const VdbStream& stream;
      ~Restore() { openvdb::io::setStreamMetadataPtr(stream.file, stream.metadata, /*transfer=*/false); }
    } const restore{stream};
    openvdb::io::setStreamMetadataPtr(stream.file, settings, /*transfer=*/false);
    work();
  }

  /// Reads the values of a leaf into a temporary leaf and passes it to use().
  template <class Use>
  void read(std::istream& in, const LeafT& leaf, const Use& use) const {
    LeafT whole(openvdb::PartialCreate(), leaf.origin());
    whole.setValueMask(leaf.getValueMask());
    whole.readBuffers(in, buffers_->from_half);
    use(whole);
  }

  /// Appends the bytes that LeafNode::readBuffers reads for a leaf, still compressed.
  void copy(std::istream& in, const LeafT& leaf, std::vector<char>& to) const {
    if (const auto bytes = copy_head(in, leaf, to)) copy_compressed(in, to, *bytes, buffers_->settings.compression());
  }
  /// Moves the stream past the values of a leaf. head: buffer for the data before the values.
  void pass_over(std::istream& in, const LeafT& leaf, std::vector<char>& head) const {
    head.clear();
    if (const auto bytes = copy_head(in, leaf, head))
      read_compressed(in, nullptr, *bytes, buffers_->settings.compression());
  }
  /// Appends the data before a leaf's values. Returns the uncompressed size of the values in bytes, or nullopt if the
  /// file has none.
  std::optional<std::size_t> copy_head(std::istream& in, const LeafT& leaf, std::vector<char>& to) const {
    using namespace openvdb::io;
    using Half = RealToHalf<ValueT>;
    copy_bytes(in, to, leaf.getValueMask().memUsage());
    copy_bytes(in, to, 1);
    const auto inactive = static_cast<std::int8_t>(to.back());
    const bool two = inactive == MASK_AND_TWO_INACTIVE_VALS;
    const bool selects = two || inactive == MASK_AND_NO_INACTIVE_VALS || inactive == MASK_AND_ONE_INACTIVE_VAL;
    if (two || inactive == NO_MASK_AND_ONE_INACTIVE_VAL || inactive == MASK_AND_ONE_INACTIVE_VAL)
      copy_bytes(in, to, (two ? 2 : 1) * sizeof(ValueT));
    if (selects) copy_bytes(in, to, leaf.getValueMask().memUsage());
    const std::uint32_t compression = buffers_->settings.compression();
    const bool active_alone = (compression & COMPRESS_ACTIVE_MASK) != 0 && inactive != NO_MASK_AND_ALL_VALS;
    const std::size_t count = active_alone ? leaf.onVoxelCount() : LeafT::SIZE;
    const bool halves = buffers_->from_half && Half::isReal;
    if (halves && count == 0) return std::nullopt;
    return count * (halves ? sizeof(typename Half::HalfT) : sizeof(ValueT));
  }

  std::optional<Buffers> buffers_;
  std::int64_t end_ = 0;
};

/// Leaves of a tree after fill().
template <typename TreeT, typename Pick>
class VdbLeaves final : public HeldLeaves {
 public:
  using LeafT = typename TreeT::LeafNodeType;
  static_assert(LeafT::DIM == brick_size);

  VdbLeaves(typename TreeT::ConstPtr tree, Pick pick) : tree_(std::move(tree)), pick_(pick) {
    tree_->getNodes(leaves_);
  }

  [[nodiscard]] std::size_t count() const override { return leaves_.size(); }
  [[nodiscard]] glm::ivec3 origin(std::size_t leaf) const override { return to_glm(leaves_[leaf]->origin()); }
  [[nodiscard]] ActiveMask active(std::size_t leaf) const override { return active_of(*leaves_[leaf]); }
  void values(std::size_t leaf, float* out) const override {
    const auto* data = leaves_[leaf]->buffer().data();
    for (int i = 0; i < brick_voxels; ++i) out[i] = pick_(data[i]);
  }

 private:
  typename TreeT::ConstPtr tree_;
  Pick pick_;
  std::vector<const LeafT*> leaves_;
};

/// Leaves whose values stay in a file until they are swept. The tree and the stream must outlive it.
template <typename TreeT, typename Pick>
class StreamedLeaves final : public LeafSource {
 public:
  using LeafT = typename TreeT::LeafNodeType;
  static_assert(LeafT::DIM == brick_size);

  StreamedLeaves(std::shared_ptr<const OwningTree<TreeT>> tree, Pick pick, const VdbStream& stream)
      : tree_(std::move(tree)), pick_(pick), stream_(stream) {
    tree_->getNodes(leaves_);
  }

  [[nodiscard]] std::size_t count() const override { return leaves_.size(); }
  [[nodiscard]] glm::ivec3 origin(std::size_t leaf) const override { return to_glm(leaves_[leaf]->origin()); }
  [[nodiscard]] ActiveMask active(std::size_t leaf) const override { return active_of(*leaves_[leaf]); }
  bool sweep_chosen(const Choice& chosen, const Visit& visit, Progress* /*progress*/, Portion portion) const override {
    return tree_->sweep(stream_, leaves_, chosen, portion, [&](std::size_t i, const LeafT& leaf) {
      std::array<float, brick_voxels> values;
      std::transform(leaf.buffer().data(), leaf.buffer().data() + brick_voxels, values.begin(), pick_);
      return visit(i, values);
    });
  }

 private:
  std::shared_ptr<const OwningTree<TreeT>> tree_;
  Pick pick_;
  VdbStream stream_;
  std::vector<const LeafT*> leaves_;
};

}  // namespace cumulet::volume::detail
