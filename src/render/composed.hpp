#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "gl/objects.hpp"
#include "render/display.hpp"
#include "render/picture_textures.hpp"
#include "render/region.hpp"
#include "render/row_revisions.hpp"

namespace cumulet::render {

/// What the sums were when they were turned into means.
struct MeansOf {
  GLuint sum = 0;
  GLuint before = 0;
  bool holes = false;
  MeansBackground background = MeansBackground::added;
  glm::uvec2 size{0U};
  std::uint64_t picture = 0;
  std::uint64_t wish = 0;
  std::optional<std::uint64_t> revision;
  bool filtered = false;
  bool operator==(const MeansOf&) const = default;

  /// Whether these are of the same picture, and of unfiltered sums that are known apart by their revision alone: then
  /// rows that did not change between the two are the same in both.
  [[nodiscard]] bool differs_in_rows(const MeansOf& other) const {
    MeansOf same = other;
    same.revision = revision;
    return same == *this && revision && other.revision && !filtered && picture != 0;
  }
};

/// The rows in which means of these sums differ from older ones; all rows where that is not known. One beside those
/// that changed, where pixels without samples take after their neighbors.
[[nodiscard]] std::vector<RowRange> changed_rows(const MeansOf& older, const MeansOf& newer, const RowRevisions* rows);

/// A picture as it is displayed, to be copied as long as nothing of it changes. Needs the context current.
class Composed {
 public:
  /// All that decides how it looks, but what a target holds.
  struct Of {
    MeansOf means;
    Display display;
    GLuint program = 0;
    glm::ivec2 size{0};  // of the rectangle that it is drawn into
    Region region;
    GLenum format = GL_RGBA8;
    bool operator==(const Of&) const = default;
  };

  explicit Composed(gl::FunctionsPtr gl) : gl_(std::move(gl)) {}

  /// Whether it is worth keeping: where the last frame drew the same, or all the time.
  [[nodiscard]] bool is_kept(const Of& of, bool always);
  /// Brings it up to this. compose draws these rows of it, of which the first is the picture's top, into the texture of
  /// that name. Returns the texture. Throws Error(out_of_memory) the first time that there is no memory for one of
  /// this size, and returns 0 after that.
  GLuint update(const Of& of, const RowRevisions* rows,
                const std::function<void(GLuint texture, const std::vector<RowRange>& rows)>& compose);
  /// Whether it is as it shall be: nothing is to be composed.
  [[nodiscard]] bool is_current(const Of& of, const RowRevisions* rows) const {
    return texture_ && size_ == of.size && format_ == of.format && stale_rows(of, rows).empty();
  }
  /// Rows that the last update composed.
  [[nodiscard]] std::uint32_t composed_rows() const { return composed_rows_; }
  void drop();
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  [[nodiscard]] std::vector<RowRange> stale_rows(const Of& of, const RowRevisions* rows) const;

  gl::FunctionsPtr gl_;
  gl::Object texture_;
  std::optional<Of> of_;    // what it holds
  std::optional<Of> last_;  // what the last frame drew
  glm::ivec2 size_{0};      // of the texture
  GLenum format_ = GL_RGBA8;
  std::optional<glm::ivec2> no_memory_for_;
  std::uint32_t composed_rows_ = 0;
};

}  // namespace cumulet::render
