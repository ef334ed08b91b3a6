#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "checks.hpp"
#include "file.hpp"
#include "image.hpp"
#include "program.hpp"

namespace cumulet::image {
namespace {

constexpr std::array<const char*, 4> channel_names = {"R", "G", "B", "A"};

/// OpenEXR writes its line table in a destructor, where a full disk passes unseen. So it writes to memory, and the
/// file is written by replace_file, which looks.
class MemoryOutput final : public Imf::OStream {
 public:
  MemoryOutput() : OStream("memory") {}
  void write(const char data[], int size) override {
    const auto count = static_cast<std::size_t>(size);
    if (bytes_.size() < position_ + count) bytes_.resize(position_ + count);
    std::memcpy(bytes_.data() + position_, data, count);
    position_ += count;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  std::uint64_t position_ = 0;
};

}  // namespace

void write_exr(const std::string& path, const Image& image) {
  check_image(path, image);
  MemoryOutput output;
  try {
    Imf::Header header(static_cast<int>(image.width), static_cast<int>(image.height));
    header.compression() = Imf::ZIP_COMPRESSION;
    Imf::FrameBuffer frame;
    // The library asks for a mutable pointer and only reads.
    char* base = const_cast<char*>(reinterpret_cast<const char*>(image.rgba.data()));
    for (std::size_t c = 0; c < channel_names.size(); ++c) {
      header.channels().insert(channel_names[c], Imf::Channel(Imf::FLOAT));
      frame.insert(channel_names[c], Imf::Slice(Imf::FLOAT, base + 4 * c, 16, std::size_t{16} * image.width));
    }
    Imf::OutputFile file(output, header);
    file.setFrameBuffer(frame);
    file.writePixels(static_cast<int>(image.height));
  } catch (const std::exception& error) {
    fail(path, demo::one_line(error.what()));
  }
  replace_file(path, output.bytes());
}

Image read_exr(const std::string& path) {
  static_cast<void>(read_file(path));  // the system's own cause for a file that cannot be opened
  try {
    Imf::InputFile file(path.c_str());
    const Imath::Box2i window = file.header().dataWindow();
    const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
    const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
    if (width < 1 || height < 1 || width > max_side || height > max_side)
      throw std::runtime_error("unsupported size " + std::to_string(width) + "x" + std::to_string(height));
    Image image{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), {}};
    image.rgba.resize(std::size_t{4} * image.width * image.height);
    // A slice's base is where pixel (0, 0) would be, which the data window may not contain.
    const std::int64_t origin = (std::int64_t{window.min.y} * width + window.min.x) * 16;
    char* base = reinterpret_cast<char*>(image.rgba.data()) - origin;
    Imf::FrameBuffer frame;
    for (std::size_t c = 0; c < channel_names.size(); ++c)
      frame.insert(channel_names[c], Imf::Slice(Imf::FLOAT, base + 4 * c, 16, static_cast<std::size_t>(16 * width), 1,
                                                1, c == 3 ? 1.0 : 0.0));
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
    return image;
  } catch (const std::exception& error) {
    fail(path, "not a readable OpenEXR file: " + demo::one_line(error.what()));
  }
}

}  // namespace cumulet::image
