#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "gl/objects.hpp"
#include "render/film/picture_textures.hpp"
#include "render/pacing/region.hpp"
#include "render/pacing/row_revisions.hpp"
#include "render/passes/display.hpp"

namespace cumulet::render {

/// Identifies the sums, and how they were turned into means.
struct MeansOf {
  GLuint sum = 0;
  GLuint before = 0;
  bool holes = false;
  MeansBackground background = MeansBackground::added;
  glm::uvec2 size{0U};
  std::uint64_t picture = 0;
  std::uint64_t request = 0;
  std::optional<std::uint64_t> revision;
  bool filtered = false;
  bool operator==(const MeansOf&) const = default;

  /// True if both are of the same picture and of unfiltered sums, and differ at most in their revision. Then rows that
  /// did not change between the two revisions have equal means.
  [[nodiscard]] bool differs_in_rows(const MeansOf& other) const {
    MeansOf same = other;
    same.revision = revision;
    return same == *this && revision && other.revision && !filtered && picture != 0;
  }
};

/// Returns the rows in which the means of newer differ from those of older; all rows if this is unknown. If pixels may
/// be unsampled, one more row on each side, because unsampled pixels take values from their neighbors.
[[nodiscard]] std::vector<RowRange> changed_rows(const MeansOf& older, const MeansOf& newer, const RowRevisions* rows);

/// Cache of the displayed image, copied to the target while nothing of it changes. Needs a current context.
class Composed {
 public:
  /// Everything that decides how the image looks, except the target's previous content.
  struct Of {
    MeansOf means;
    Display display;
    GLuint program = 0;
    glm::ivec2 size{0};  // of the destination rectangle
    Region region;
    GLenum format = GL_RGBA8;
    bool operator==(const Of&) const = default;
  };

  explicit Composed(gl::FunctionsPtr gl) : gl_(std::move(gl)) {}

  /// Returns whether the composed image should be cached: always, or if the last frame drew the same image.
  [[nodiscard]] bool is_kept(const Of& of, bool always);
  /// Brings the cached image up to date. compose draws the given rows, counted from the picture's top, into the given
  /// texture. Returns the texture. If there is no memory for this size, throws Error(out_of_memory) the first time and
  /// returns 0 after that.
  GLuint update(const Of& of, const RowRevisions* rows,
                const std::function<void(GLuint texture, const std::vector<RowRange>& rows)>& compose);
  /// True if the cached image is up to date, so that update() composes nothing.
  [[nodiscard]] bool is_current(const Of& of, const RowRevisions* rows) const {
    return texture_ && size_ == of.size && format_ == of.format && stale_rows(of, rows).empty();
  }
  /// Rows that the last update() composed.
  [[nodiscard]] std::uint32_t composed_rows() const { return composed_rows_; }
  void drop();
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  [[nodiscard]] std::vector<RowRange> stale_rows(const Of& of, const RowRevisions* rows) const;

  gl::FunctionsPtr gl_;
  gl::Object texture_;
  std::optional<Of> of_;    // content of texture_
  std::optional<Of> last_;  // drawn by the last frame
  glm::ivec2 size_{0};      // of texture_
  GLenum format_ = GL_RGBA8;
  std::optional<glm::ivec2> no_memory_for_;
  std::uint32_t composed_rows_ = 0;
};

}  // namespace cumulet::render
