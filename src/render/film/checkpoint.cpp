#include "render/film/checkpoint.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"

namespace cumulet::render {

namespace {

/// Header in front of the saved layers.
struct SavedHeader {
  std::uint32_t what = 0x41434d43;  // "CMCA"
  std::uint32_t format = 2;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t layers = 0;
  std::array<std::uint16_t, 4> box{};  // x, y, width and height of the region's pixels
  std::uint32_t spare = 0;
  bool operator==(const SavedHeader&) const = default;
};
static_assert(sizeof(SavedHeader) == 32);

/// Follows the layers of an adaptive picture, in front of Allotment::saved().
struct SavedPass {
  std::uint32_t target = 0;
};

/// Throws Error(invalid_argument) if the pass does not fit a picture with that many samples.
std::uint32_t saved_pass(std::span<const std::byte> saved, std::uint32_t target_samples) {
  SavedPass pass;
  std::memcpy(&pass, saved.data(), sizeof pass);
  if (pass.target < 1 || pass.target > target_samples)
    throw Error(ErrorCode::invalid_argument, "the accumulation was saved with another number of samples");
  return pass.target;
}

template <class SamplesOf>
Accumulated accumulated_of(glm::uvec2 size, SamplesOf&& samples_of) {
  Accumulated counts;
  for (std::uint32_t y = 0; y < size.y; ++y) {
    for (std::uint32_t x = 0; x < size.x; ++x) {
      const std::uint32_t count = samples_of(glm::uvec2(x, y));
      counts.least = std::min(counts.least, count);
      counts.most = std::max(counts.most, count);
      counts.all += count;
    }
  }
  return counts;
}

SavedHeader header_of(const Picture& picture, std::size_t layers) {
  const glm::u16vec2 first(picture.box().first);
  const glm::u16vec2 extent(picture.box().size);
  SavedHeader header;
  header.width = picture.size().x;
  header.height = picture.size().y;
  header.layers = static_cast<std::uint32_t>(layers);
  header.box = {first.x, first.y, extent.x, extent.y};
  return header;
}

// Calls visit with each saved layer, its offset in the saved state, and its size there.
template <class Visit>
void for_each_saved(const Picture& picture, Visit&& visit) {
  std::size_t at = sizeof(SavedHeader);
  for (const FilmLayer& layer : picture.accumulated_layers()) {
    const std::size_t size = std::size_t{picture.size().x} * picture.size().y * layer.pixel_bytes;
    visit(layer, at, size);
    at += size;
  }
}

}  // namespace

std::size_t checkpoint_bytes(const Picture& picture) {
  std::size_t bytes = sizeof(SavedHeader);
  for_each_saved(picture, [&](const FilmLayer&, std::size_t, std::size_t size) { bytes += size; });
  return bytes + (picture.is_adaptive() ? sizeof(SavedPass) + picture.accumulation().live_squares().size() : 0);
}

void save_checkpoint(const gl::Functions& gl, const Picture& picture, std::span<std::byte> bytes) {
  const SavedHeader header = header_of(picture, picture.accumulated_layers().size());
  std::memcpy(bytes.data(), &header, sizeof header);
  for_each_saved(picture, [&](const FilmLayer& layer, std::size_t at, std::size_t size) {
    const PixelTransfer transfer = transfer_of(layer);
    gl.GetTextureImage(picture.film().texture(layer), 0, transfer.format, transfer.type, static_cast<GLsizei>(size),
                       bytes.data() + at);
  });
  if (picture.is_adaptive()) {
    const SavedPass pass{picture.accumulation().pass_target()};
    const auto live = std::as_bytes(picture.accumulation().live_squares());
    std::ranges::copy(live, bytes.last(live.size()).begin());
    std::memcpy(bytes.last(live.size() + sizeof pass).data(), &pass, sizeof pass);
  }
  gl::check(gl, "reading the accumulation");
}

void restore_checkpoint(const gl::Functions& gl, Picture& picture, std::span<const std::byte> saved,
                        std::uint64_t revision) {
  const SavedHeader wanted = header_of(picture, picture.accumulated_layers().size());
  SavedHeader header;
  if (saved.size() >= sizeof header) std::memcpy(&header, saved.data(), sizeof header);
  if (saved.size() != checkpoint_bytes(picture) || header != wanted)
    throw Error(ErrorCode::invalid_argument,
                "the data is not an accumulation of an image with this size, region and layers");
  std::vector<glm::uvec2> counts(std::size_t{picture.size().x} * picture.size().y);
  for_each_saved(picture, [&](const FilmLayer& layer, std::size_t at, std::size_t size) {
    if (layer == film_layers::counts) std::memcpy(counts.data(), saved.data() + at, size);
  });
  const auto samples_of = [&](glm::uvec2 pixel) {
    const glm::uvec2 at = picture.box().first + pixel;
    return counts[std::size_t{at.y} * picture.size().x + at.x].x;
  };
  const Accumulated accumulated = accumulated_of(picture.box().size, samples_of);
  const std::size_t squares = picture.accumulation().live_squares().size();
  std::optional<std::uint32_t> pass;
  if (picture.is_adaptive()) pass = saved_pass(saved.last(squares + sizeof(SavedPass)), picture.target_samples());
  if (pass && std::ranges::any_of(saved.last(squares), [](std::byte live) { return live > std::byte{3}; }))
    throw Error(ErrorCode::invalid_argument, "the accumulation is corrupt: adaptive-sampling mask");
  if (accumulated.most > picture.target_samples()) {
    throw Error(ErrorCode::invalid_argument, "the accumulation has pixels with " + std::to_string(accumulated.most) +
                                                 " samples, but the image is limited to " +
                                                 std::to_string(picture.target_samples()));
  }
  if (picture.done()) return;
  for_each_saved(picture, [&](const FilmLayer& layer, std::size_t at, std::size_t) {
    const PixelTransfer transfer = transfer_of(layer);
    const GLuint texture = picture.film().texture(layer);
    const glm::ivec2 size(picture.size());
    const std::byte* bytes = saved.data() + at;
    if (layer.slices > 0) {
      gl.TextureSubImage3D(texture, 0, 0, 0, 0, size.x, size.y, static_cast<GLsizei>(layer.slices), transfer.format,
                           transfer.type, bytes);
    } else {
      gl.TextureSubImage2D(texture, 0, 0, 0, size.x, size.y, transfer.format, transfer.type, bytes);
    }
  });
  gl::check(gl, "restoring the accumulation");
  picture.change_all(revision);
  if (pass) {
    std::vector<std::uint8_t> live(squares);
    std::memcpy(live.data(), saved.last(squares).data(), squares);
    picture.accumulation().restore_live_squares(live, samples_of);
  }
  picture.accumulation().go_on_from(accumulated, pass);
}

}  // namespace cumulet::render
