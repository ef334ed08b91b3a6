#include "light/environment_file.hpp"

#include <IlmThreadPool.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/apart.hpp"
#include "base/error.hpp"
#include "base/one_line.hpp"
#include "base/progress_part.hpp"
#include "base/read_rest.hpp"

namespace cumulet::light {

namespace {

// OpenEXR's own statics, made when the library is loaded: at exit they then go after a decode that was left
// (base/apart), which is waited for. Made with the first file they would go before it.
[[maybe_unused]] const bool open_exr_is_made = []() noexcept {
  Imf::staticInitialize();
  return IlmThread::ThreadPool::globalThreadPool().numThreads() >= 0;
}();

// Of a load's progress.
constexpr double decoded_from = 0.2;
constexpr double decoded_to = 0.5;

[[noreturn]] void fail(const std::string& name, const std::string& cause) {
  throw Error(ErrorCode::file, one_line(name) + ": " + cause);
}

/// A Radiance picture (Ward, "Real Pixels", Graphics Gems II, 1991): lines of text, then rows of shared exponents.
/// stb_image takes one that is cut short for one whose rest is black.
class RadianceFile {
 public:
  RadianceFile(std::span<const std::uint8_t> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  EnvironmentPixels read(Progress* progress) {
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
    ProgressPart part(progress, decoded_from, decoded_to, pixels.height);
    for (std::uint32_t y = 0; y < pixels.height; ++y) {
      part.add(1);
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

/// A file's bytes, for OpenEXR.
class ByteStream : public Imf::IStream {
 public:
  ByteStream(std::vector<std::uint8_t> bytes, const std::string& name)
      : Imf::IStream(name.c_str()), bytes_(std::move(bytes)) {}

  bool read(char to[], int count) override {
    const auto wanted = static_cast<std::size_t>(count);
    if (at_ > bytes_.size() || wanted > bytes_.size() - at_) throw std::runtime_error("the file is cut short");
    std::memcpy(to, bytes_.data() + at_, wanted);
    at_ += wanted;
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t to) override { at_ = to; }

 private:
  std::vector<std::uint8_t> bytes_;
  std::uint64_t at_ = 0;
};

/// An OpenEXR picture on its way from bytes to pixels. Owns all of it: see apart().
class ExrFile {
 public:
  ExrFile(std::vector<std::uint8_t> bytes, const std::string& path, Progress* progress)
      : stream_(std::move(bytes), path), file_(stream_) {
    const Imath::Box2i& window = file_.header().dataWindow();
    const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
    const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
    check_environment_size(path, width, height);
    pixels_.width = static_cast<std::uint32_t>(width);
    pixels_.height = static_cast<std::uint32_t>(height);
    resize(pixels_.values, std::size_t{pixels_.width} * pixels_.height, progress);
    const std::int64_t stride = sizeof(glm::vec3);
    // A slice's base is where pixel (0, 0) would be, which the data window may not contain.
    char* const base =
        reinterpret_cast<char*>(pixels_.values.data()) - (std::int64_t{window.min.y} * width + window.min.x) * stride;
    const Imf::ChannelList& channels = file_.header().channels();
    const auto has = [&](const char* name) { return channels.findChannel(name) != nullptr; };
    grey_ = !has("R") && !has("G") && !has("B") && has("Y");
    Imf::FrameBuffer frame;
    const auto read = [&](const char* name, std::size_t c) {
      if (!has(name)) fail(path, std::string("has no channel ") + name);
      frame.insert(name, Imf::Slice(Imf::FLOAT, base + c * sizeof(float), stride, stride * pixels_.width));
    };
    if (grey_) {
      read("Y", 0);
    } else {
      read("R", 0);
      read("G", 1);
      read("B", 2);
    }
    file_.setFrameBuffer(frame);
  }

  /// Rows from 0, as many as there are from this one on, at most so many. Returns the next.
  std::uint32_t decode(std::uint32_t row, std::uint32_t most) {
    const std::uint32_t end = row + std::min(most, pixels_.height - row);
    const int top = file_.header().dataWindow().min.y;
    file_.readPixels(top + static_cast<int>(row), top + static_cast<int>(end) - 1);
    if (!grey_) return end;
    const auto first = pixels_.values.begin() + std::ptrdiff_t{row} * pixels_.width;
    std::for_each(first, pixels_.values.begin() + std::ptrdiff_t{end} * pixels_.width,
                  [](glm::vec3& value) { value = glm::vec3(value.x); });
    return end;
  }
  [[nodiscard]] std::uint32_t height() const { return pixels_.height; }
  [[nodiscard]] EnvironmentPixels take() { return std::move(pixels_); }

 private:
  ByteStream stream_;
  Imf::InputFile file_;
  EnvironmentPixels pixels_;
  bool grey_ = false;
};

EnvironmentPixels read_exr(std::vector<std::uint8_t> bytes, const std::string& path, Progress* progress) {
  try {
    const auto file = make_left<ExrFile>(std::move(bytes), path, progress);
    // OpenEXR keeps the block of rows that it decoded last.
    constexpr std::uint32_t rows = 64;
    ProgressPart part(progress, decoded_from, decoded_to, file->height());
    for (std::uint32_t y = 0; y < file->height();) {
      const std::uint32_t next = apart(progress, [file, y] { return file->decode(y, rows); });
      part.add(next - y);
      y = next;
    }
    return file->take();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    fail(path, "not a readable OpenEXR file: " + one_line(error.what(), 200));
  }
}

/// All of it, in pieces between which a load may be cancelled.
std::vector<std::uint8_t> read_bytes(const std::string& path, Progress* progress) {
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(path, std::strerror(errno));
  std::error_code unknown;
  const std::uintmax_t told = std::filesystem::file_size(path, unknown);
  const std::uintmax_t size = unknown ? 0 : told;
  constexpr std::size_t piece = std::size_t{1} << 20U;
  ProgressPart part(progress, 0.0, decoded_from, size);
  std::vector<std::uint8_t> bytes;
  bytes.reserve(size + piece);
  read_rest(file, bytes, [&part](std::size_t count) { part.add(count); });
  if (file.bad()) fail(path, std::strerror(errno));
  return bytes;
}

}  // namespace

EnvironmentPixels read_radiance(std::span<const std::uint8_t> bytes, const std::string& name, Progress* progress) {
  return RadianceFile(bytes, name).read(progress);
}

EnvironmentPixels read_environment(const std::string& path, Progress* progress) {
  std::vector<std::uint8_t> bytes = read_bytes(path, progress);
  constexpr std::array<std::uint8_t, 4> open_exr = {0x76, 0x2F, 0x31, 0x01};
  const bool exr = bytes.size() >= open_exr.size() && std::equal(open_exr.begin(), open_exr.end(), bytes.begin());
  return exr ? read_exr(std::move(bytes), path, progress) : read_radiance(bytes, path, progress);
}

EnvironmentPtr open_environment(const std::string& path, Progress* progress) {
  const auto pixels = make_left<const EnvironmentPixels>(read_environment(path, progress));
  return make_environment(*pixels, path, progress);
}

}  // namespace cumulet::light
