#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "base/detached_work.hpp"
#include "surface/jpeg.h"
#include "surface/materials.hpp"
#include "surface/webp.hpp"

namespace cumulet::surface::detail {

namespace {

/// Contents of an image's header.
struct Header {
  std::uint64_t width = 0;
  std::uint64_t height = 0;
  std::uint64_t min_bytes = 0;  ///< minimum file size for so many pixels
};

std::uint64_t big_endian(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8U | bytes[at + i];
  return value;
}

constexpr std::array<std::uint8_t, 8> png_signature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

Header png_header(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 33) malformed("is a truncated PNG");
  Header header;
  header.width = big_endian(bytes, 16, 4);
  header.height = big_endian(bytes, 20, 4);
  // Deflate expands a byte to at most 1032 bytes, and a pixel has at least one bit.
  header.min_bytes = header.width * header.height / 8 / 1032;
  return header;
}

bool is_jpeg(Bytes bytes) { return bytes.size() >= 4 && bytes[0] == 0xFF && bytes[1] == 0xD8; }

Header jpeg_header(Bytes bytes) {
  cumulet_jpeg_header found{};
  cumulet_jpeg_report report{};
  if (cumulet_jpeg_read_header(bytes.data(), bytes.size(), &found, &report) == 0) {
    malformed("is a JPEG that cannot be read: " + one_line(report.error));
  }
  Header header{found.width, found.height, 0};
  // With Huffman coding a block of 8 x 8 has at least one bit, and a component at least one block per 32 x 32 pixels.
  if (found.arithmetic == 0) header.min_bytes = header.width * header.height / 8192;
  return header;
}

/// RIFF container with the form type WEBP.
bool is_webp(Bytes bytes) {
  constexpr std::size_t form = 8;
  return bytes.size() >= form + 4 && std::memcmp(bytes.data(), "RIFF", 4) == 0 &&
         std::memcmp(&bytes[form], "WEBP", 4) == 0;
}

Header read_header(std::span<const std::uint8_t> bytes) {
  if (bytes.size() >= png_signature.size() && std::equal(png_signature.begin(), png_signature.end(), bytes.begin())) {
    return png_header(bytes);
  }
  if (is_jpeg(bytes)) return jpeg_header(bytes);
  if (is_webp(bytes)) {
    // A uniform image takes a few bytes at any size, so only the budget limits it.
    const WebpSize size = read_webp_size(bytes);
    return {size.width, size.height, 0};
  }
  constexpr std::array<std::uint8_t, 4> ktx2 = {0xAB, 'K', 'T', 'X'};
  if (bytes.size() >= ktx2.size() && std::equal(ktx2.begin(), ktx2.end(), bytes.begin())) {
    malformed("is a KTX2 image, which is not supported");
  }
  malformed("is neither PNG, JPEG nor WebP");
}

DecodedImage decode_jpeg(Bytes bytes, const Header& header) {
  DecodedImage result;
  Image& image = result.image;
  image.width = static_cast<std::uint32_t>(header.width);
  image.height = static_cast<std::uint32_t>(header.height);
  image.rgba.resize(std::size_t{image.width} * image.height * 4);
  const cumulet_jpeg_header expected{image.width, image.height, 0};
  cumulet_jpeg_report report{};
  if (cumulet_jpeg_decode(bytes.data(), bytes.size(), &expected, image.rgba.data(), &report) == 0) {
    malformed("cannot be decoded: " + one_line(report.error));
  }
  result.damage = one_line(report.damage);
  return result;
}

/// Must be called only for images that fit the budget.
Image decode_png(Bytes bytes) {
  tinygltf::Image image;
  std::string error;
  std::string warning;
  const bool good =
      tinygltf::LoadImageData(&image, 0, &error, &warning, 0, 0, bytes.data(), static_cast<int>(bytes.size()), nullptr);
  if (!good || image.width <= 0 || image.height <= 0 || image.component != 4) malformed("cannot be decoded");
  Image result;
  result.width = static_cast<std::uint32_t>(image.width);
  result.height = static_cast<std::uint32_t>(image.height);
  const std::size_t count = std::size_t{result.width} * result.height * 4;
  if (image.bits == 16 && image.image.size() == 2 * count) {
    result.rgba.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      std::uint16_t wide = 0;
      std::memcpy(&wide, &image.image[2 * i], sizeof wide);
      result.rgba[i] = static_cast<std::uint8_t>((wide * 255U + 32767U) / 65535U);
    }
  } else if (image.bits == 8 && image.image.size() == count) {
    result.rgba = std::move(image.image);
  } else {
    malformed("cannot be decoded");
  }
  return result;
}

}  // namespace

DecodedImage decode_image(Bytes bytes, const Owner& owner, Budget& budget) {
  // The libraries read more formats and trust the sizes in files. Only images that glTF allows and that fit in memory
  // pass.
  const Header header = read_header(bytes);
  const std::string size = std::to_string(header.width) + " x " + std::to_string(header.height) + " pixels";
  const std::uint32_t side = budget.limits().image_side;
  if (header.width == 0 || header.height == 0) malformed("has no pixels");
  if (header.width > side || header.height > side || header.width * header.height * 8 > std::uint64_t{INT32_MAX} ||
      bytes.size() > std::uint64_t{INT32_MAX}) {
    malformed(size + " exceed the limit");
  }
  if (header.min_bytes > bytes.size())
    malformed(size + " do not fit into its " + std::to_string(bytes.size()) + " bytes");
  const std::uint64_t pixels = header.width * header.height;
  budget.take(pixels, 4, "an image of " + size);
  return run_cancellable(budget.progress_for(4 * pixels), [bytes, owner, header] {
    if (is_jpeg(bytes)) return decode_jpeg(bytes, header);
    return DecodedImage{is_webp(bytes) ? decode_webp(bytes, {header.width, header.height}) : decode_png(bytes), {}};
  });
}

}  // namespace cumulet::surface::detail
