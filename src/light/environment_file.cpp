#include "light/environment_file.hpp"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/one_line.hpp"

namespace cumulet::light {

namespace {

[[noreturn]] void fail(const std::string& name, const std::string& cause) {
  throw Error(ErrorCode::file, name + ": " + cause);
}

/// A Radiance picture (Ward, "Real Pixels", Graphics Gems II, 1991): lines of text, then rows of shared exponents.
/// stb_image takes one that is cut short for one whose rest is black.
class RadianceFile {
 public:
  RadianceFile(std::span<const std::uint8_t> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  EnvironmentPixels read() {
    const std::string_view first = line();
    if (first != "#?RADIANCE" && first != "#?RGBE") fail(name_, "neither a Radiance (.hdr) nor an OpenEXR file");
    double exposure = 1.0;
    for (std::string_view text = line(); !text.empty(); text = line()) {
      if (text.starts_with("FORMAT=") && text != "FORMAT=32-bit_rle_rgbe") {
        fail(name_, "is of " + one_line(text, 60) + ", not FORMAT=32-bit_rle_rgbe");
      }
      if (text.starts_with("EXPOSURE=")) exposure *= number(text.substr(9));
    }
    EnvironmentPixels pixels = resolution(line());
    check_environment_size(name_, pixels.width, pixels.height);
    // A row is at least this long, whatever its coding.
    const std::size_t least = std::min<std::size_t>(pixels.width, 4);
    if ((bytes_.size() - at_) / least < pixels.height) cut();
    pixels.values.reserve(std::size_t{pixels.width} * pixels.height);
    std::vector<std::array<std::uint8_t, 4>> row(pixels.width);
    for (std::uint32_t y = 0; y < pixels.height; ++y) {
      read_row(row);
      for (const auto& [r, g, b, e] : row) {
        const auto unit = static_cast<float>(e == 0 ? 0.0 : std::ldexp(1.0, e - 136) / exposure);
        pixels.values.push_back(unit * glm::vec3(r, g, b));
      }
    }
    return pixels;
  }

 private:
  [[noreturn]] void cut() const { fail(name_, "a Radiance picture that is cut short"); }

  std::uint8_t next() {
    if (at_ >= bytes_.size()) cut();
    return bytes_[at_++];
  }

  std::string_view line() {
    const std::size_t begin = at_;
    while (next() != '\n') {
    }
    std::string_view text(reinterpret_cast<const char*>(bytes_.data()) + begin, at_ - 1 - begin);
    if (text.ends_with('\r')) text.remove_suffix(1);
    return text;
  }

  double number(std::string_view text) const {
    double value = 0.0;
    while (text.starts_with(' ')) text.remove_prefix(1);
    std::from_chars(text.data(), text.data() + text.size(), value);
    if (!(value > 0.0)) fail(name_, "an EXPOSURE that is not above 0");
    return value;
  }

  EnvironmentPixels resolution(std::string_view text) const {
    const auto refuse = [&] { fail(name_, "a resolution of '" + one_line(text, 60) + "', not '-Y HEIGHT +X WIDTH'"); };
    EnvironmentPixels pixels;
    const auto take = [&](std::string_view axis, std::uint32_t& side) {
      if (!text.starts_with(axis)) refuse();
      const char* const end = text.data() + text.size();
      const auto read = std::from_chars(text.data() + axis.size(), end, side);
      if (read.ec != std::errc{}) refuse();
      text = {read.ptr, static_cast<std::size_t>(end - read.ptr)};
    };
    const std::string_view whole = text;
    take("-Y ", pixels.height);
    take(" +X ", pixels.width);
    if (!text.empty()) {
      text = whole;
      refuse();
    }
    return pixels;
  }

  void read_row(std::vector<std::array<std::uint8_t, 4>>& row) {
    const std::size_t width = row.size();
    const bool coded = width >= 8 && width < 32768 && bytes_.size() - at_ >= 4 && bytes_[at_] == 2 &&
                       bytes_[at_ + 1] == 2 && bytes_[at_ + 2] < 128;
    if (!coded) return read_flat(row);
    if ((std::size_t{bytes_[at_ + 2]} << 8U | bytes_[at_ + 3]) != width) fail(name_, "a row of another width");
    at_ += 4;
    for (std::size_t c = 0; c < 4; ++c) {
      for (std::size_t x = 0; x < width;) {
        const std::uint8_t count = next();
        const bool run = count > 128;
        const std::size_t length = run ? count - 128U : count;
        if (length == 0 || length > width - x) fail(name_, "a run beyond its row");
        std::uint8_t value = run ? next() : std::uint8_t{0};
        for (std::size_t i = 0; i < length; ++i) {
          if (!run) value = next();
          row[x++][c] = value;
        }
      }
    }
  }

  /// Pixels as they are; 1, 1, 1, n among them repeats the last one n times, shifted by 8 bits more each time.
  void read_flat(std::vector<std::array<std::uint8_t, 4>>& row) {
    unsigned shift = 0;
    for (std::size_t x = 0; x < row.size();) {
      std::array<std::uint8_t, 4> pixel{};
      for (std::uint8_t& byte : pixel) byte = next();
      if (pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1) {
        row[x++] = pixel;
        shift = 0;
        continue;
      }
      const std::size_t length = shift < 24 ? std::size_t{pixel[3]} << shift : row.size();
      if (x == 0 || length > row.size() - x) fail(name_, "a run beyond its row");
      for (std::size_t i = 0; i < length; ++i, ++x) row[x] = row[x - 1];
      shift += 8;
    }
  }

  std::span<const std::uint8_t> bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
};

EnvironmentPixels read_exr(const std::string& path) {
  try {
    Imf::InputFile file(path.c_str());
    const Imath::Box2i window = file.header().dataWindow();
    const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
    const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
    check_environment_size(path, width, height);
    EnvironmentPixels pixels{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), {}};
    pixels.values.resize(std::size_t{pixels.width} * pixels.height);
    const std::int64_t stride = sizeof(glm::vec3);
    // A slice's base is where pixel (0, 0) would be, which the data window may not contain.
    char* const base =
        reinterpret_cast<char*>(pixels.values.data()) - (std::int64_t{window.min.y} * width + window.min.x) * stride;
    const Imf::ChannelList& channels = file.header().channels();
    const auto has = [&](const char* name) { return channels.findChannel(name) != nullptr; };
    const bool grey = !has("R") && !has("G") && !has("B") && has("Y");
    Imf::FrameBuffer frame;
    const auto read = [&](const char* name, std::size_t c) {
      if (!has(name)) fail(path, std::string("has no channel ") + name);
      frame.insert(name, Imf::Slice(Imf::FLOAT, base + c * sizeof(float), stride, stride * pixels.width));
    };
    if (grey) {
      read("Y", 0);
    } else {
      read("R", 0);
      read("G", 1);
      read("B", 2);
    }
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
    if (grey) {
      for (glm::vec3& value : pixels.values) value = glm::vec3(value.x);
    }
    return pixels;
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    fail(path, "not a readable OpenEXR file: " + one_line(error.what(), 200));
  }
}

}  // namespace

EnvironmentPixels read_radiance(std::span<const std::uint8_t> bytes, const std::string& name) {
  return RadianceFile(bytes, name).read();
}

EnvironmentPixels read_environment(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(path, std::strerror(errno));
  std::vector<std::uint8_t> bytes(4);
  file.read(reinterpret_cast<char*>(bytes.data()), 4);
  constexpr std::array<std::uint8_t, 4> open_exr = {0x76, 0x2F, 0x31, 0x01};
  if (file && std::ranges::equal(bytes, open_exr)) return read_exr(path);
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  file.clear();
  constexpr std::size_t piece = std::size_t{1} << 20U;
  while (file) {
    const std::size_t before = bytes.size();
    bytes.resize(before + piece);
    file.read(reinterpret_cast<char*>(bytes.data() + before), piece);
    bytes.resize(before + static_cast<std::size_t>(file.gcount()));
  }
  if (file.bad()) fail(path, std::strerror(errno));
  return read_radiance(bytes, path);
}

}  // namespace cumulet::light
