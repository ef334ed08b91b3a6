#include "surface/winding.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

namespace cumulet::surface::detail {

namespace {

using glm::dvec3;

// A shape with less volume relative to its area (a sphere has 0.094) is a two-sided sheet.
constexpr double min_volume = 1e-6;
// Number of the largest shapes that are tested for shapes within them.
constexpr std::size_t max_hulls = 64;

/// Numbers vertices so that vertices at the same position share a number.
std::vector<std::uint32_t> weld(std::span<const glm::vec3> positions) {
  std::vector<std::uint32_t> order(positions.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](std::uint32_t i) { return std::array{positions[i].x, positions[i].y, positions[i].z}; };
  std::ranges::sort(order, {}, key);
  std::vector<std::uint32_t> welded(positions.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && positions[order[i]] == positions[order[i - 1]];
    welded[order[i]] = same ? welded[order[i - 1]] : order[i];
  }
  return welded;
}

/// Union-find over connected triangles. Each triangle is wound like the root of its component or opposite to it.
class Pieces {
 public:
  explicit Pieces(std::size_t triangles) : parent_(triangles), against_(triangles, 0), open_(triangles, 0) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }

  struct Component {
    std::uint32_t piece = 0;
    bool against = false;
  };
  Component find(std::uint32_t triangle) {
    std::uint32_t root = triangle;
    bool against = false;
    for (; parent_[root] != root; root = parent_[root]) against ^= against_[root] != 0;
    // Path compression.
    bool rest = against;
    while (parent_[triangle] != root && triangle != root) {
      const std::uint32_t next = parent_[triangle];
      const bool step = against_[triangle] != 0;
      parent_[triangle] = root;
      against_[triangle] = rest ? 1 : 0;
      rest ^= step;
      triangle = next;
    }
    return {root, against};
  }
  void join(std::uint32_t a, std::uint32_t b, bool against) {
    const Component x = find(a);
    const Component y = find(b);
    if (x.piece == y.piece) {
      if ((x.against != y.against) != against) open(a);  // a Moebius strip has no inside
      return;
    }
    parent_[y.piece] = x.piece;
    against_[y.piece] = (x.against != y.against) != against ? 1 : 0;
    open_[x.piece] |= open_[y.piece];
  }
  void open(std::uint32_t triangle) { open_[find(triangle).piece] = 1; }
  [[nodiscard]] bool is_open(std::uint32_t piece) const { return open_[piece] != 0; }

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint8_t> against_;  // wound opposite to its parent
  std::vector<std::uint8_t> open_;     // valid for roots
};

struct Edge {
  std::uint32_t low;
  std::uint32_t high;
  std::uint32_t triangle;
  bool falling;  // from high to low
};

struct Shape {
  double volume = 0.0;           // by the winding of the component's root triangle
  std::array<double, 2> area{};  // of triangles wound like the root, and opposite to it
  dvec3 low{std::numeric_limits<double>::max()};
  dvec3 high{std::numeric_limits<double>::lowest()};
  dvec3 origin{0.0};

  [[nodiscard]] double whole() const { return area[0] + area[1]; }
  [[nodiscard]] double inward() const { return volume > 0.0 ? area[1] : area[0]; }
  [[nodiscard]] bool solid() const {
    const double scale = std::pow(whole(), 1.5);
    return std::isfinite(scale) && std::abs(volume) > min_volume * scale;
  }
  [[nodiscard]] bool holds(const Shape& other) const {
    return glm::all(glm::lessThan(low, other.low)) && glm::all(glm::greaterThan(high, other.high));
  }
};

Pieces pieces_of(const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[t][k];
      const std::uint32_t b = triangles[t][(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), t, a > b});
    }
  }
  std::ranges::sort(edges, {}, [](const Edge& e) { return std::pair(e.low, e.high); });
  Pieces pieces(triangles.size());
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high) ++end;
    for (std::size_t k = i + 1; k < end; ++k) {
      pieces.join(edges[i].triangle, edges[k].triangle, end - i == 2 && edges[i].falling == edges[k].falling);
    }
    if (end - i != 2) pieces.open(edges[i].triangle);
    i = end;
  }
  return pieces;
}

}  // namespace

Winding winding_of(std::span<const glm::vec3> positions, std::span<const std::uint32_t> indices) {
  const std::vector<std::uint32_t> welded = weld(positions);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  triangles.reserve(indices.size() / 3);
  for (std::size_t i = 0; i + 3 <= indices.size(); i += 3) {
    const std::array<std::uint32_t, 3> t{welded[indices[i]], welded[indices[i + 1]], welded[indices[i + 2]]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);
  }
  Pieces pieces = pieces_of(triangles);
  std::vector<Shape> shapes(triangles.size());  // per component, at the index of its root triangle
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const auto [piece, against] = pieces.find(t);
    if (pieces.is_open(piece)) continue;
    Shape& shape = shapes[piece];
    if (shape.whole() == 0.0) shape.origin = positions[triangles[t][0]];  // a nearby origin avoids cancellation
    std::array<dvec3, 3> p{};
    for (std::size_t k = 0; k < 3; ++k) {
      const dvec3 at = positions[triangles[t][k]];
      shape.low = glm::min(shape.low, at);
      shape.high = glm::max(shape.high, at);
      p[k] = at - shape.origin;
    }
    shape.volume += (against ? -1.0 : 1.0) * glm::dot(p[0], glm::cross(p[1], p[2])) / 6.0;
    shape.area[against ? 1 : 0] += 0.5 * glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
  }
  std::erase_if(shapes, [](const Shape& shape) { return !shape.solid(); });
  std::ranges::sort(shapes, std::ranges::greater{}, [](const Shape& shape) { return std::abs(shape.volume); });
  const std::span<const Shape> hulls(shapes.data(), std::min(shapes.size(), max_hulls));
  Winding winding;
  for (const Shape& shape : shapes) {
    if (std::ranges::any_of(hulls, [&](const Shape& hull) { return hull.holds(shape); })) continue;
    winding.area += shape.whole();
    winding.inward += shape.inward();
  }
  return winding;
}

}  // namespace cumulet::surface::detail
