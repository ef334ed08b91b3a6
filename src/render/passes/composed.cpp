#include "render/passes/composed.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "render/passes/target_format.hpp"

namespace cumulet::render {

std::vector<RowRange> changed_rows(const MeansOf& older, const MeansOf& newer, const RowRevisions* rows) {
  if (rows == nullptr || !newer.differs_in_rows(older)) return {{0, newer.size.y}};
  return rows->since(*older.revision, newer.holes ? 1 : 0);
}

bool Composed::is_kept(const Of& of, bool always) {
  const bool again = of.means.revision && last_ == of;
  last_ = of;
  const bool kept = always || again;
  if (!kept) drop();
  return kept;
}

std::vector<RowRange> Composed::stale_rows(const Of& of, const RowRevisions* rows) const {
  const auto height = static_cast<std::uint32_t>(of.size.y);
  std::vector<RowRange> all{{0, height}};
  if (!of_) return all;
  if (of.means.revision && *of_ == of) return {};
  Of same = *of_;
  same.means = of.means;
  if (same != of) return all;
  // Converts rows of the picture to rows of the rectangle, widened by the reach of bilinear filtering if sizes differ.
  const double scale = double(height) / of.means.size.y;
  const double reach = of.means.size.y == height ? 0.0 : 1.0;
  std::vector<RowRange> stale;
  for (const RowRange& range : changed_rows(of_->means, of.means, rows)) {
    const double first = std::floor((range.first - reach) * scale - reach);
    const double end = std::ceil((range.end + reach) * scale + reach);
    stale.push_back({static_cast<std::uint32_t>(std::clamp(first, 0.0, double(height))),
                     static_cast<std::uint32_t>(std::clamp(end, 0.0, double(height)))});
  }
  return stale;
}

GLuint Composed::update(const Of& of, const RowRevisions* rows,
                        const std::function<void(GLuint texture, const std::vector<RowRange>& rows)>& compose) {
  composed_rows_ = 0;
  if (no_memory_for_ == of.size) return 0;
  if (!texture_ || size_ != of.size || format_ != of.format) {
    drop();
    try {
      texture_ =
          gl::make_texture_2d(gl_, of.format, of.size.x, of.size.y, "creating the texture of the composed image");
    } catch (const Error& error) {
      // The image is composed in every frame then.
      if (error.code() == ErrorCode::out_of_memory) no_memory_for_ = of.size;
      throw;
    }
    no_memory_for_.reset();
    gl_->TextureParameteri(texture_.name(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl_->TextureParameteri(texture_.name(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    gl_->TextureParameteri(texture_.name(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl_->TextureParameteri(texture_.name(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    size_ = of.size;
    format_ = of.format;
  }
  const std::vector<RowRange> stale = stale_rows(of, rows);
  of_.reset();  // until composing has succeeded
  if (!stale.empty()) compose(texture_.name(), stale);
  for (const RowRange& range : stale) composed_rows_ += range.end - range.first;
  of_ = of;
  return texture_.name();
}

void Composed::drop() {
  texture_ = {};
  of_.reset();
  size_ = glm::ivec2(0);
}

std::uint64_t Composed::bytes() const {
  return texture_ ? std::uint64_t(size_.x) * std::uint64_t(size_.y) * bytes_per_texel(format_) : 0;
}

}  // namespace cumulet::render
