#include "surface/bvh.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>

#include "base/error.hpp"
#include "base/progress_part.hpp"

namespace cumulet::surface {

using glm::vec3;

// Four lanes, so that compilers vectorize each loop; the fourth lane is always 0 or ignored.
struct Bvh::Bounds {
  static constexpr float huge = 3.0e38F;

  std::array<float, 4> low{huge, huge, huge, huge};
  std::array<float, 4> high{-huge, -huge, -huge, -huge};

  void add(const Bounds& other) {
    for (unsigned i = 0; i < 4; ++i) {
      low[i] = other.low[i] < low[i] ? other.low[i] : low[i];
      high[i] = other.high[i] > high[i] ? other.high[i] : high[i];
    }
  }
  void add(const std::array<float, 4>& point) {
    for (unsigned i = 0; i < 4; ++i) {
      low[i] = point[i] < low[i] ? point[i] : low[i];
      high[i] = point[i] > high[i] ? point[i] : high[i];
    }
  }
  // Adding zero turns -0 into +0: otherwise minima and maxima would depend on the order.
  void add(const vec3& p) { add(std::array<float, 4>{p.x + 0.0F, p.y + 0.0F, p.z + 0.0F, 0.0F}); }
  [[nodiscard]] bool empty() const { return low[0] > high[0]; }
  // Returns twice the center.
  [[nodiscard]] std::array<float, 4> centre() const {
    std::array<float, 4> sum{};
    for (unsigned i = 0; i < 4; ++i) sum[i] = low[i] + high[i];
    return sum;
  }
  // Returns half the surface area.
  [[nodiscard]] float area() const {
    if (empty()) return 0.0F;
    const float x = high[0] - low[0];
    const float y = high[1] - low[1];
    const float z = high[2] - low[2];
    return x * y + y * z + z * x;
  }
};

namespace {

constexpr float far_away = 3.0e38F;   // position of an empty box, which no ray reaches
constexpr float most = 1.0e12F;       // beyond it the shader's products overflow
constexpr std::size_t grain = 4096;   // triangles per task in flat loops
constexpr std::size_t piece = 16384;  // triangles whose subtree one task builds; independent of the number of threads,
                                      // for deterministic results
constexpr std::uint32_t nothing = 0xffffffffU;  // the link of an absent child: a leaf beyond all records
// Cost of a node, in triangle tests. Values from 1 to 4 trace equally fast; a higher cost gives fewer nodes.
constexpr float visit_cost = 2.0F;

bool sound(const vec3& p) { return std::abs(p.x) <= most && std::abs(p.y) <= most && std::abs(p.z) <= most; }

std::uint32_t leaf_link(std::size_t first, std::size_t count) {
  return Bvh::leaf_bit | (static_cast<std::uint32_t>(count - 1) << 29U) | static_cast<std::uint32_t>(first);
}

// Number of triangles that fit under a node of this level (the root's is 0), or into a leaf at max_depth.
std::size_t capacity(int level) { return std::size_t{Bvh::max_leaf} << static_cast<unsigned>(Bvh::max_depth - level); }

}  // namespace

class Bvh::Builder {
 public:
  Builder(std::span<const PosedVertex> vertices, std::span<const std::uint32_t> indices,
          std::span<const std::uint32_t> flags, const Progress* progress)
      : vertices_(vertices), indices_(indices), flags_(flags), progress_(progress) {}

  void run(Bvh& out) {
    gather();
    if (ids_.empty()) return;
    Piece root;
    root.end = ids_.size();
    root.centres = tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, ids_.size(), grain), Bounds(),
        [&](const auto& range, Bounds sum) {
          for (std::size_t i = range.begin(); i != range.end(); ++i) sum.add(boxes_[ids_[i]].centre());
          return sum;
        },
        [](Bounds a, const Bounds& b) {
          a.add(b);
          return a;
        });
    if (root.end <= max_leaf) {
      Bounds box;
      for (const std::uint32_t id : ids_) box.add(boxes_[id]);
      out.nodes_[0].child[0] = child_of(box, leaf_link(0, root.end));
    } else {
      grow(root);
    }
    boxes_ = {};
    scratch_ = {};
    if (root.end > max_leaf) join(root, out);
    root = Piece();
    out.records_.resize(ids_.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, ids_.size(), grain), [&](const auto& range) {
      check(progress_);
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        Record& record = out.records_[i];
        record.triangle = ids_[i];
        record.flags = flags_.empty() ? 0 : flags_[ids_[i]];
        set_triangle(record, vertices_, indices_);
      }
    });
  }

  // Sets the corners of a record's triangle. If a coordinate is not sound, all corners become 0, `spare` becomes 1 and
  // the box is empty.
  static void set_triangle(Record& record, std::span<const PosedVertex> vertices,
                           std::span<const std::uint32_t> indices) {
    const std::size_t first = std::size_t{record.triangle} * 3;
    record.v0 = vertices[indices[first]].position;
    record.v1 = vertices[indices[first + 1]].position;
    record.v2 = vertices[indices[first + 2]].position;
    record.spare = sound(record.v0) && sound(record.v1) && sound(record.v2) ? 0 : 1;
    if (record.spare != 0) record.v0 = record.v1 = record.v2 = vec3(0.0F);
  }

  static Node::Child child_of(const Bounds& box, std::uint32_t link) {
    if (box.empty()) return {vec3(far_away), link, vec3(far_away), 0};
    return {{box.low[0], box.low[1], box.low[2]}, link, {box.high[0], box.high[1], box.high[2]}, 0};
  }

  // Throws if a corner of any triangle is not a vertex.
  static void check_indices(std::span<const PosedVertex> vertices, std::span<const std::uint32_t> indices) {
    std::atomic<bool> outside = false;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, indices.size(), 3 * grain), [&](const auto& range) {
      bool any = false;
      for (std::size_t i = range.begin(); i != range.end(); ++i) any = any || indices[i] >= vertices.size();
      if (any) outside.store(true, std::memory_order_relaxed);
    });
    if (outside.load()) {
      throw Error(ErrorCode::invalid_argument, "triangles: an index is not less than " +
                                                   std::to_string(vertices.size()) + ", the number of vertices");
    }
  }

 private:
  // The triangles ids_[begin, end), of one subtree.
  struct Piece {
    std::size_t begin = 0;
    std::size_t end = 0;
    int level = 0;
    Bounds box;
    Bounds centres;
    std::vector<Node> nodes;                       // the whole subtree, links from 0; or
    std::array<std::unique_ptr<Piece>, 2> halves;  // the two halves of one node; if both members are empty the piece is
                                                   // a leaf
    [[nodiscard]] std::size_t count() const { return end - begin; }
  };
  struct Item {
    Bounds box;
    std::uint32_t id;
  };

  static constexpr unsigned bin_count = 16;
  static constexpr std::size_t sweep_most = 16;  // maximum number of triangles for which all splits are tried, without
                                                 // bins
  struct Bin {
    Bounds box;
    std::uint32_t count = 0;
  };
  // Division of the centers' box into bins along each axis.
  struct Grid {
    explicit Grid(const Bounds& centres) {
      for (unsigned axis = 0; axis < 3; ++axis) {
        low[axis] = centres.low[axis];
        const float size = centres.high[axis] - centres.low[axis];
        // The guard avoids overflow and division by zero.
        scale[axis] = size > 1.0e-30F ? (static_cast<float>(bin_count) * 0.99999F) / size : 0.0F;
      }
    }
    [[nodiscard]] unsigned bin(const std::array<float, 4>& centre, unsigned axis) const {
      return std::min(bin_count - 1, static_cast<unsigned>(std::max(0.0F, (centre[axis] - low[axis]) * scale[axis])));
    }
    std::array<float, 3> low{};
    std::array<float, 3> scale{};
  };
  struct Bins {
    std::array<std::array<Bin, bin_count>, 3> bins;

    void add(const Grid& grid, const Bounds& box) {
      const std::array<float, 4> centre = box.centre();
      for (unsigned axis = 0; axis < 3; ++axis) {
        Bin& bin = bins[axis][grid.bin(centre, axis)];
        bin.box.add(box);
        ++bin.count;
      }
    }
    void add(const Bins& other) {
      for (unsigned axis = 0; axis < 3; ++axis) {
        for (unsigned i = 0; i < bin_count; ++i) {
          bins[axis][i].box.add(other.bins[axis][i].box);
          bins[axis][i].count += other.bins[axis][i].count;
        }
      }
    }
  };
  // Bins below `bin` go to the first half.
  struct Split {
    bool found = false;
    unsigned axis = 0;
    unsigned bin = 0;
    std::array<Bounds, 2> box;
    std::array<Bounds, 2> centres;
    std::array<std::size_t, 2> count{};
  };

  void gather() {
    const std::size_t triangles = indices_.size() / 3;
    resize(boxes_, triangles, progress_);
    ids_.reserve(triangles);
    for (std::size_t i = 0; i < triangles; ++i) {
      if (flags_.empty() || (flags_[i] & TriangleFlags::left_out) == 0) ids_.push_back(static_cast<std::uint32_t>(i));
    }
    scratch_.resize(ids_.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, triangles, grain), [&](const auto& range) {
      check(progress_);
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        Bounds box;
        bool all = true;
        for (std::size_t corner = 0; corner < 3; ++corner) {
          const vec3& p = vertices_[indices_[3 * i + corner]].position;
          all = all && sound(p);
          box.add(p);
        }
        if (all) boxes_[i] = box;
      }
    });
  }

  // Returns the split between bins with the lowest area times triangles. Splits with a half that exceeds the capacity
  // below it are excluded.
  static Split best_split(const Bins& bins, std::size_t half_capacity) {
    Split best;
    float best_cost = std::numeric_limits<float>::infinity();
    for (unsigned axis = 0; axis < 3; ++axis) {
      const auto& row = bins.bins[axis];
      std::array<float, bin_count> above{};
      std::array<std::size_t, bin_count> above_count{};
      Bounds box;
      std::size_t count = 0;
      for (unsigned i = bin_count - 1; i > 0; --i) {
        box.add(row[i].box);
        count += row[i].count;
        above[i] = box.area();
        above_count[i] = count;
      }
      box = Bounds();
      count = 0;
      for (unsigned i = 1; i < bin_count; ++i) {
        box.add(row[i - 1].box);
        count += row[i - 1].count;
        if (count == 0 || above_count[i] == 0 || count > half_capacity || above_count[i] > half_capacity) continue;
        const float cost = box.area() * static_cast<float>(count) + above[i] * static_cast<float>(above_count[i]);
        if (cost < best_cost) {
          best_cost = cost;
          best.found = true;
          best.axis = axis;
          best.bin = i;
        }
      }
    }
    if (!best.found) return best;
    for (unsigned i = 0; i < bin_count; ++i) {
      const unsigned half = i < best.bin ? 0 : 1;
      const Bin& bin = bins.bins[best.axis][i];
      best.box[half].add(bin.box);
      best.count[half] += bin.count;
    }
    return best;
  }

  static unsigned widest(const Bounds& centres) {
    unsigned axis = 0;
    for (unsigned i = 1; i < 3; ++i) {
      if (centres.high[i] - centres.low[i] > centres.high[axis] - centres.low[axis]) axis = i;
    }
    return axis;
  }

  // Builds a subtree: for many triangles one node and two pieces, else all of it.
  void grow(Piece& p) {
    check(progress_);
    if (p.count() <= piece) {
      grow_small(p);
      return;
    }
    const Split split = divide(p);
    for (unsigned half = 0; half < 2; ++half) {
      p.halves[half] = std::make_unique<Piece>();
      Piece& h = *p.halves[half];
      h.begin = half == 0 ? p.begin : p.begin + split.count[0];
      h.end = half == 0 ? p.begin + split.count[0] : p.end;
      h.level = p.level + 1;
      h.box = split.box[half];
      h.centres = split.centres[half];
    }
    const auto grow_half = [&](Piece& h) {
      if (h.count() > 1) grow(h);
    };
    tbb::parallel_invoke([&] { grow_half(*p.halves[0]); }, [&] { grow_half(*p.halves[1]); });
  }

  // Reorders ids_[begin, end), the first half first. The order within each half is kept.
  Split divide(const Piece& p) {
    const Grid grid(p.centres);
    const auto ids = tbb::blocked_range<std::size_t>(p.begin, p.end, grain);
    const Bins bins = tbb::parallel_reduce(
        ids, Bins(),
        [&](const auto& range, Bins sum) {
          check(progress_);
          for (std::size_t i = range.begin(); i != range.end(); ++i) sum.add(grid, boxes_[ids_[i]]);
          return sum;
        },
        [](Bins a, const Bins& b) {
          a.add(b);
          return a;
        });
    Split split = best_split(bins, capacity(p.level + 1));
    if (!split.found) {
      median(ids_.begin() + static_cast<std::ptrdiff_t>(p.begin), ids_.begin() + static_cast<std::ptrdiff_t>(p.end),
             widest(p.centres), [&](std::uint32_t id) { return std::pair(boxes_[id].centre(), id); });
      split.count = {p.count() / 2, p.count() - p.count() / 2};
      for (std::size_t i = p.begin; i < p.end; ++i) {
        const unsigned half = i < p.begin + split.count[0] ? 0 : 1;
        split.box[half].add(boxes_[ids_[i]]);
        split.centres[half].add(boxes_[ids_[i]].centre());
      }
      return split;
    }
    const std::size_t chunks = (p.count() + grain - 1) / grain;
    std::vector<std::size_t> first_in(chunks + 1);
    const auto in_first = [&](std::uint32_t id) { return grid.bin(boxes_[id].centre(), split.axis) < split.bin; };
    const auto each_chunk = [&](const auto& visit) {
      tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
        check(progress_);
        visit(c, p.begin + c * grain, std::min(p.end, p.begin + (c + 1) * grain));
      });
    };
    std::vector<std::array<Bounds, 2>> centres(chunks);
    each_chunk([&](std::size_t c, std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        const bool first = in_first(ids_[i]);
        first_in[c + 1] += first ? 1 : 0;
        centres[c][first ? 0 : 1].add(boxes_[ids_[i]].centre());
      }
    });
    for (std::size_t c = 0; c < chunks; ++c) {
      first_in[c + 1] += first_in[c];
      for (unsigned half = 0; half < 2; ++half) split.centres[half].add(centres[c][half]);
    }
    each_chunk([&](std::size_t c, std::size_t from, std::size_t to) {
      std::size_t first = p.begin + first_in[c];
      std::size_t second = from + split.count[0] - first_in[c];
      for (std::size_t i = from; i < to; ++i) scratch_[in_first(ids_[i]) ? first++ : second++] = ids_[i];
    });
    each_chunk([&](std::size_t /*c*/, std::size_t from, std::size_t to) {
      std::copy(scratch_.begin() + static_cast<std::ptrdiff_t>(from),
                scratch_.begin() + static_cast<std::ptrdiff_t>(to), ids_.begin() + static_cast<std::ptrdiff_t>(from));
    });
    return split;
  }

  // Splits into halves of equal size, by center along the axis, then by index.
  template <class Iterator, class Key>
  static void median(Iterator begin, Iterator end, unsigned axis, Key key) {
    std::nth_element(begin, begin + (end - begin) / 2, end, [&](const auto& a, const auto& b) {
      const auto [centre_a, id_a] = key(a);
      const auto [centre_b, id_b] = key(b);
      return centre_a[axis] != centre_b[axis] ? centre_a[axis] < centre_b[axis] : id_a < id_b;
    });
  }

  void grow_small(Piece& p) {
    std::vector<Item> items(p.count());
    for (std::size_t i = 0; i < items.size(); ++i) items[i] = {boxes_[ids_[p.begin + i]], ids_[p.begin + i]};
    p.nodes.reserve(items.size() / 2);
    Bounds box;
    for (const Item& item : items) box.add(item.box);
    const Small root{0, items.size(), p.level, box, p.centres};
    if (subtree(p.nodes, items, p.begin, root) >= leaf_bit) p.nodes.clear();
    for (std::size_t i = 0; i < items.size(); ++i) ids_[p.begin + i] = items[i].id;
  }

  // The items [begin, end) of a piece.
  struct Small {
    std::size_t begin;
    std::size_t end;
    int level;
    Bounds box;
    Bounds centres;
    [[nodiscard]] std::size_t count() const { return end - begin; }
  };

  // For few triangles: tries all splits between neighbors along each axis. Reorders the items.
  static Split sweep(std::vector<Item>& items, const Small& s, std::size_t half_capacity) {
    std::array<std::array<std::uint8_t, sweep_most>, 3> order{};
    std::array<float, sweep_most> above{};
    Split best;
    float best_cost = std::numeric_limits<float>::infinity();
    const std::size_t n = s.count();
    for (unsigned axis = 0; axis < 3; ++axis) {
      std::array<float, sweep_most> centre{};
      for (std::size_t i = 0; i < n; ++i) {
        const Bounds& box = items[s.begin + i].box;
        const float c = box.low[axis] + box.high[axis];
        std::size_t to = i;
        for (; to > 0 && centre[to - 1] > c; --to) {
          centre[to] = centre[to - 1];
          order[axis][to] = order[axis][to - 1];
        }
        centre[to] = c;
        order[axis][to] = static_cast<std::uint8_t>(i);
      }
      Bounds box;
      for (std::size_t i = n - 1; i > 0; --i) {
        box.add(items[s.begin + order[axis][i]].box);
        above[i] = box.area();
      }
      box = Bounds();
      for (std::size_t i = 1; i < n; ++i) {
        box.add(items[s.begin + order[axis][i - 1]].box);
        if (i > half_capacity || n - i > half_capacity) continue;
        const float cost = box.area() * static_cast<float>(i) + above[i] * static_cast<float>(n - i);
        if (cost < best_cost) {
          best_cost = cost;
          best.axis = axis;
          best.count = {i, n - i};
        }
      }
    }
    std::array<Item, sweep_most> sorted;
    for (std::size_t i = 0; i < n; ++i) sorted[i] = items[s.begin + order[best.axis][i]];
    for (std::size_t i = 0; i < n; ++i) {
      const unsigned half = i < best.count[0] ? 0 : 1;
      best.box[half].add(sorted[i].box);
      best.centres[half].add(sorted[i].box.centre());
      items[s.begin + i] = sorted[i];
    }
    return best;
  }

  // For many triangles: splits by bins, or at the median if there is no such split.
  static Split cut(std::vector<Item>& items, const Small& s, std::size_t half_capacity) {
    const Grid grid(s.centres);
    Bins bins;
    for (std::size_t i = s.begin; i < s.end; ++i) bins.add(grid, items[i].box);
    Split split = best_split(bins, half_capacity);
    const auto begin = items.begin() + static_cast<std::ptrdiff_t>(s.begin);
    const auto end = items.begin() + static_cast<std::ptrdiff_t>(s.end);
    if (split.found) {
      std::partition(begin, end, [&](const Item& item) { return grid.bin(item.box.centre(), split.axis) < split.bin; });
    } else {
      median(begin, end, widest(s.centres), [](const Item& item) { return std::pair(item.box.centre(), item.id); });
      split.count = {s.count() / 2, s.count() - s.count() / 2};
    }
    for (std::size_t i = s.begin; i < s.end; ++i) {
      const unsigned half = i < s.begin + split.count[0] ? 0 : 1;
      if (!split.found) split.box[half].add(items[i].box);
      split.centres[half].add(items[i].box.centre());
    }
    return split;
  }

  // Appends the nodes of a subtree, its root first, and returns the link to it.
  static std::uint32_t subtree(std::vector<Node>& nodes, std::vector<Item>& items, std::size_t base, const Small& s) {
    if (s.count() == 1 || s.level == max_depth) return leaf_link(base + s.begin, s.count());
    const std::size_t half_capacity = capacity(s.level + 1);
    const Split split = s.count() <= sweep_most ? sweep(items, s, half_capacity) : cut(items, s, half_capacity);
    if (s.count() <= max_leaf) {
      const float area = s.box.area();
      if (area * static_cast<float>(s.count()) <= visit_cost * area +
                                                      split.box[0].area() * static_cast<float>(split.count[0]) +
                                                      split.box[1].area() * static_cast<float>(split.count[1])) {
        return leaf_link(base + s.begin, s.count());
      }
    }
    const std::size_t at = nodes.size();
    nodes.emplace_back();
    const std::size_t middle = s.begin + split.count[0];
    for (unsigned half = 0; half < 2; ++half) {
      const Small child{half == 0 ? s.begin : middle, half == 0 ? middle : s.end, s.level + 1, split.box[half],
                        split.centres[half]};
      const std::uint32_t link = subtree(nodes, items, base, child);
      nodes[at].child[half] = child_of(child.box, link);
    }
    return static_cast<std::uint32_t>(at);
  }

  // Concatenates the nodes of all pieces.
  static void join(const Piece& root, Bvh& out) {
    std::vector<std::pair<const Piece*, std::uint32_t>> parts;
    std::vector<Node> above;
    std::uint32_t next = 0;
    // Nodes above the parts with their positions, known once all nodes before them are counted.
    std::vector<std::pair<std::uint32_t, Node>> nodes_above;
    const std::function<std::uint32_t(const Piece&)> put_piece = [&](const Piece& p) {
      if (!p.nodes.empty()) {
        const std::uint32_t at = next;
        parts.emplace_back(&p, at);
        next += static_cast<std::uint32_t>(p.nodes.size());
        return at;
      }
      if (p.halves[0] == nullptr) return leaf_link(p.begin, p.count());
      const std::uint32_t at = next++;
      Node node{};
      for (unsigned half = 0; half < 2; ++half) {
        node.child[half] = child_of(p.halves[half]->box, put_piece(*p.halves[half]));
      }
      nodes_above.emplace_back(at, node);
      return at;
    };
    put_piece(root);
    out.nodes_.resize(next);
    out.parts_.clear();
    for (const auto& [p, at] : parts) out.parts_.push_back({at, at + static_cast<std::uint32_t>(p->nodes.size())});
    for (const auto& [at, node] : nodes_above) out.nodes_[at] = node;
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
      const std::uint32_t at = parts[i].second;
      std::size_t to = at;
      for (const Node& node : parts[i].first->nodes) {
        Node& copy = out.nodes_[to++];
        copy = node;
        for (Node::Child& child : copy.child) child.link += child.link < leaf_bit ? at : 0;
      }
    });
  }

  std::span<const PosedVertex> vertices_;
  std::span<const std::uint32_t> indices_;
  std::span<const std::uint32_t> flags_;
  const Progress* progress_;
  std::vector<Bounds> boxes_;  // one per triangle
  std::vector<std::uint32_t> ids_, scratch_;
};

Bvh::Bvh() : nodes_(1) {
  for (Node::Child& child : nodes_[0].child) child = Builder::child_of(Bounds(), nothing);
}

Bvh Bvh::build(std::span<const PosedVertex> vertices, std::span<const std::uint32_t> indices,
               std::span<const std::uint32_t> flags, const Progress* progress) {
  if (indices.size() % 3 != 0) throw Error(ErrorCode::invalid_argument, "triangles: indices are not a multiple of 3");
  const std::size_t triangles = indices.size() / 3;
  if (!flags.empty() && flags.size() != triangles) {
    throw Error(ErrorCode::invalid_argument, "triangles: " + std::to_string(flags.size()) + " flags for " +
                                                 std::to_string(triangles) + " triangles");
  }
  if (triangles > max_triangles) {
    throw Error(ErrorCode::unsupported, std::to_string(triangles) + " triangles: at most " +
                                            std::to_string(max_triangles) + " fit into the BVH");
  }
  Builder::check_indices(vertices, indices);
  Bvh bvh;
  bvh.triangles_ = triangles;
  Builder(vertices, indices, flags, progress).run(bvh);
  return bvh;
}

Bvh::Bounds Bvh::bounds_of(std::uint32_t link) const {
  Bounds box;
  if (link >= leaf_bit) {
    const std::size_t first = link & 0x1fffffffU;
    const std::size_t end = std::min(records_.size(), first + ((link >> 29U) & 3U) + 1);
    for (std::size_t i = first; i < end; ++i) {
      const Record& record = records_[i];
      if (record.spare != 0) continue;
      box.add(record.v0);
      box.add(record.v1);
      box.add(record.v2);
    }
    return box;
  }
  for (const Node::Child& child : nodes_[link].child) {
    if (child.low.x == far_away) continue;
    box.add(child.low);
    box.add(child.high);
  }
  return box;
}

void Bvh::fit(std::uint32_t node) {
  for (Node::Child& child : nodes_[node].child) child = Builder::child_of(bounds_of(child.link), child.link);
}

void Bvh::refit(std::span<const PosedVertex> vertices, std::span<const std::uint32_t> indices,
                const Progress* progress) {
  if (indices.size() != 3 * triangles_) {
    throw Error(ErrorCode::invalid_argument, "triangles: " + std::to_string(indices.size() / 3) +
                                                 ", but the BVH was built for " + std::to_string(triangles_));
  }
  Builder::check_indices(vertices, indices);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, records_.size(), grain), [&](const auto& range) {
    check(progress);
    for (std::size_t i = range.begin(); i != range.end(); ++i) Builder::set_triangle(records_[i], vertices, indices);
  });
  // Bottom-up: children come after their parents.
  tbb::parallel_for(std::size_t{0}, parts_.size(), [&](std::size_t p) {
    check(progress);
    for (std::uint32_t node = parts_[p].end; node > parts_[p].begin; --node) fit(node - 1);
  });
  auto node = static_cast<std::uint32_t>(nodes_.size());
  for (std::size_t p = parts_.size() + 1; p > 0; --p) {
    const std::uint32_t from = p > parts_.size() ? node : parts_[p - 1].begin;
    const std::uint32_t below = p > 1 ? parts_[p - 2].end : 0;
    for (node = from; node > below; --node) fit(node - 1);
  }
}

double Bvh::cost() const {
  const double whole = bounds_of(0).area();
  if (!(whole > 0.0)) return 0.0;
  const double sum = tbb::parallel_deterministic_reduce(
      tbb::blocked_range<std::size_t>(0, nodes_.size(), grain), 0.0,
      [&](const auto& range, double part) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
          for (const Node::Child& child : nodes_[i].child) {
            if (child.low.x == far_away) continue;
            const glm::dvec3 size = glm::dvec3(child.high) - glm::dvec3(child.low);
            const double tests = child.link < leaf_bit ? 1.0 : ((child.link >> 29U) & 3U) + 1;
            part += (size.x * size.y + size.y * size.z + size.z * size.x) * tests;
          }
        }
        return part;
      },
      std::plus<>());
  return 1.0 + sum / whole;
}

int Bvh::depth() const {
  std::vector<std::uint8_t> levels(nodes_.size());
  std::uint8_t deepest = 0;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const auto level = static_cast<std::uint8_t>(levels[i] + 1);
    deepest = std::max(deepest, level);
    for (const Node::Child& child : nodes_[i].child) {
      if (child.link < leaf_bit) levels[child.link] = level;
    }
  }
  return deepest;
}

std::vector<std::uint32_t> triangle_flags(const Scene& scene, const Pose& pose) {
  std::vector<std::uint32_t> flags(scene.triangle_count());
  for (std::size_t i = 0; i < scene.draws.size(); ++i) {
    const Draw& draw = scene.draws[i];
    const Material& material = materials_of(scene, pose)[material_of(scene, pose, i)];
    std::uint32_t word = static_cast<std::uint32_t>(i) & TriangleFlags::user;
    if (material.alpha_mode != AlphaMode::opaque || may_be_clear(material)) word |= TriangleFlags::ask;
    if (!material.double_sided && !pose.double_sided && !bounds_volume(material)) word |= TriangleFlags::one_sided;
    if (i < pose.flipped.size() && pose.flipped[i] != 0) word |= TriangleFlags::clockwise;
    if (is_hidden(pose, i)) word |= TriangleFlags::left_out;
    const std::size_t first = draw.first_index / 3;
    for (std::size_t t = first; t < first + draw.index_count / 3; ++t) flags[t] = word;
  }
  return flags;
}

}  // namespace cumulet::surface
