#include "light/exr_file.hpp"

#include <IlmThreadPool.h>
#include <ImfEnvmap.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputPart.h>
#include <ImfIntAttribute.h>
#include <ImfMultiPartInputFile.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <optional>
#include <stdexcept>
#include <utility>

#include "base/detached_work.hpp"
#include "base/error.hpp"
#include "base/one_line.hpp"
#include "base/progress_part.hpp"
#include "light/chroma.hpp"
#include "light/cube_map.hpp"
#include "light/environment_reading.hpp"
#include "light/exr_channels.hpp"
#include "light/primaries.hpp"

namespace cumulet::light {

namespace {

// Creates OpenEXR's statics when the library is loaded. At exit they are then destroyed after decoding that continues
// in the background (base/detached_work) has ended. If they were created with the first file, they would be destroyed
// before.
[[maybe_unused]] const bool open_exr_is_made = []() noexcept {
  Imf::staticInitialize();
  return IlmThread::ThreadPool::globalThreadPool().numThreads() >= 0;
}();

[[noreturn]] void fail(const std::string& path, const std::string& cause) {
  throw Error(ErrorCode::file, one_line(path) + ": " + cause);
}

/// An OpenEXR stream over a file's bytes.
class ByteStream : public Imf::IStream {
 public:
  ByteStream(std::vector<std::uint8_t> bytes, const std::string& name)
      : Imf::IStream(name.c_str()), bytes_(std::move(bytes)) {}

  bool read(char to[], int count) override {
    const auto wanted = static_cast<std::size_t>(count);
    if (at_ > bytes_.size() || wanted > bytes_.size() - at_) throw std::runtime_error("the file is truncated");
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

/// A rectangle of pixels, with 64-bit numbers because a file's windows may be arbitrary.
struct Window {
  std::int64_t left = 0;
  std::int64_t top = 0;
  std::int64_t width = 0;
  std::int64_t height = 0;

  bool operator==(const Window&) const = default;
};

Window window_of(const Imath::Box2i& box) {
  return {box.min.x, box.min.y, std::int64_t{box.max.x} - box.min.x + 1, std::int64_t{box.max.y} - box.min.y + 1};
}

/// The geometry and colors of the image, from its header.
struct Description {
  ExrChannels channels;
  Window data;
  Window display;
  bool cube = false;
  Primaries primaries;
};

bool is_flat(const Imf::Header& header) { return !header.hasType() || !Imf::isDeepData(header.type()); }

Primaries primaries_of(const Imf::Header& header) {
  Primaries primaries;
  const auto* const aces = header.findTypedAttribute<Imf::IntAttribute>("acesImageContainerFlag");
  if (aces != nullptr && aces->value() == 1) primaries = aces_primaries;
  const auto point = [](const Imath::V2f& xy) { return glm::dvec2(xy.x, xy.y); };
  if (Imf::hasChromaticities(header)) {
    const Imf::Chromaticities& c = Imf::chromaticities(header);
    primaries = {point(c.red), point(c.green), point(c.blue), point(c.white)};
  }
  // The color that counts as white, as in OpenEXR's AcesInputFile.
  if (Imf::hasAdoptedNeutral(header)) primaries.white = point(Imf::adoptedNeutral(header));
  return primaries;
}

/// An OpenEXR image while it is decoded. Owns all of its data, as run_cancellable() requires.
class ExrPicture {
 public:
  ExrPicture(std::vector<std::uint8_t> bytes, const std::string& path)
      : path_(path), stream_(std::move(bytes), path), file_(stream_) {}

  /// Chooses the part and its channels, and allocates the pixels.
  void open(Progress* progress) {
    const int part = choose_part();
    const Imf::Header& header = file_.header(part);
    describe(header);
    const auto width = static_cast<std::uint32_t>(description_.data.width);
    const auto height = static_cast<std::uint32_t>(description_.data.height);
    pixels_.width = width;
    pixels_.height = height;
    resize(pixels_.values, std::size_t{width} * height, progress);
    part_.emplace(file_, part);
    Imf::FrameBuffer frame;
    for (std::size_t c = 0; c < description_.channels.count(); ++c) {
      const std::string& name = description_.channels.names[c];
      const Imf::Channel& channel = *header.channels().findChannel(name);
      frame.insert(name, slice(channel, c));
    }
    part_->setFrameBuffer(frame);
  }

  /// Decodes up to `most` rows from `row` on, counted from 0. Returns the next row.
  std::uint32_t decode(std::uint32_t row, std::uint32_t most) {
    const std::uint32_t end = row + std::min(most, pixels_.height - row);
    const auto top = static_cast<int>(description_.data.top);
    part_->readPixels(top + static_cast<int>(row), top + static_cast<int>(end) - 1);
    return end;
  }
  /// Whether combine() is needed.
  [[nodiscard]] bool is_coded() const {
    using Kind = ExrChannels::Kind;
    const Kind kind = description_.channels.kind;
    return kind == Kind::luminance || kind == Kind::luminance_chroma ||
           std::ranges::any_of(planes_, [](const SampledPlane& plane) { return !plane.values.empty(); });
  }
  /// Saves the luminance at the chroma samples, before combine() overwrites it.
  void prepare_chroma() {
    if (description_.channels.kind != ExrChannels::Kind::luminance_chroma) return;
    for (std::size_t c = 1; c < planes_.size(); ++c) {
      if (planes_[c].values.empty()) continue;
      SampledPlane& at = luminance_[c];
      at = planes_[c];
      for (std::uint32_t y = 0; y < at.height; ++y) {
        for (std::uint32_t x = 0; x < at.width; ++x) {
          at.values[std::size_t{y} * at.width + x] =
              pixels_.values[std::size_t{y} * at.y_step * pixels_.width + std::size_t{x} * at.x_step].x;
        }
      }
    }
  }
  /// Converts a decoded row to RGB with the file's primaries, or to XYZ. All rows must have been decoded.
  void combine(std::uint32_t y) {
    const std::span<glm::vec3> row(&pixels_.values[std::size_t{y} * pixels_.width], pixels_.width);
    std::vector<float> values(row.size());
    std::vector<float> luminance;
    for (const glm::vec3& value : row) luminance.push_back(value.x);
    for (std::size_t c = 0; c < planes_.size(); ++c) {
      if (planes_[c].values.empty()) continue;
      if (luminance_[c].values.empty()) {
        planes_[c].row(y, values);
      } else {
        planes_[c].row(y, values, luminance, luminance_[c]);
      }
      for (std::size_t x = 0; x < row.size(); ++x) row[x][static_cast<int>(c)] = values[x];
    }
    if (description_.channels.kind == ExrChannels::Kind::luminance) {
      for (glm::vec3& value : row) value = glm::vec3(value.x);
    }
    if (description_.channels.kind == ExrChannels::Kind::luminance_chroma) {
      for (glm::vec3& value : row) value = from_chroma(value);
    }
  }
  [[nodiscard]] const Description& description() const { return description_; }
  [[nodiscard]] std::uint32_t height() const { return pixels_.height; }
  [[nodiscard]] EnvironmentPixels take() { return std::move(pixels_); }

 private:
  int choose_part() {
    std::optional<int> first_flat;
    std::optional<int> chosen;
    for (int p = 0; p < file_.parts(); ++p) {
      if (!is_flat(file_.header(p))) continue;
      if (!first_flat) first_flat = p;
      auto found = find_colors(file_.header(p).channels());
      if (!found || (chosen && (description_.channels.layer.empty() || !found->layer.empty()))) continue;
      chosen = p;
      description_.channels = std::move(*found);
    }
    if (!first_flat) fail(path_, "deep OpenEXR images are not supported");
    if (!chosen) fail(path_, "has no channel " + missing_channel(file_.header(*first_flat).channels()));
    if (file_.parts() > 1) {
      const Imf::Header& header = file_.header(*chosen);
      const std::string name = header.hasName() ? " (" + one_line(header.name(), 60) + ")" : "";
      pixels_.remarks.push_back("part " + std::to_string(*chosen + 1) + name + " of " + std::to_string(file_.parts()) +
                                " is used");
    }
    const std::string& layer = description_.channels.layer;
    if (!layer.empty()) pixels_.remarks.push_back("layer " + one_line(layer, 60) + " is used");
    return *chosen;
  }

  void describe(const Imf::Header& header) {
    description_.data = window_of(header.dataWindow());
    description_.display = window_of(header.displayWindow());
    description_.primaries = primaries_of(header);
    if (const auto to_xyz = xyz_matrix(description_.primaries); to_xyz && (*to_xyz)[1].y > 0.0) {
      weights_ = glm::vec3((*to_xyz)[0].y, (*to_xyz)[1].y, (*to_xyz)[2].y);
    }
    description_.cube = Imf::hasEnvmap(header) && Imf::envmap(header) == Imf::ENVMAP_CUBE;
    const Window& data = description_.data;
    const auto fits = [](const Window& window) { return window.width >= 1 && window.height == 6 * window.width; };
    if (description_.cube) {
      // The data window is the cube (ImfEnvmap.h); if a program has cropped it, the display window is the cube.
      if (fits(data)) description_.display = data;
      const Window& whole = description_.display;
      if (!fits(whole)) {
        fail(path_, "the cube map has " + std::to_string(whole.width) + "x" + std::to_string(whole.height) +
                        " pixels, which are not six square faces");
      }
      if (whole.width > CubeMap::max_side) {
        fail(path_, "the cube map has faces of " + std::to_string(whole.width) + " pixels per side; the limit is " +
                        std::to_string(CubeMap::max_side));
      }
      if (data != whole) check_environment_size(path_, data.width, data.height);
    } else {
      check_environment_size(path_, data.width, data.height);
      check_environment_size(path_, description_.display.width, description_.display.height);
      if (fits(description_.display)) {
        pixels_.remarks.emplace_back(
            "has the shape of a cube map, but no envmap attribute; it is read as equirectangular");
      }
    }
    if (header.hasTileDescription()) {
      const Imf::TileDescription& tiles = header.tileDescription();
      constexpr unsigned most = Environment::max_side;
      if (tiles.xSize > most || tiles.ySize > most) {
        fail(path_, "tiles of " + std::to_string(tiles.xSize) + "x" + std::to_string(tiles.ySize) + " pixels");
      }
    }
  }

  /// Returns the destination of a channel: its component of the pixels or, if it is subsampled, a plane.
  Imf::Slice slice(const Imf::Channel& channel, std::size_t c) {
    const auto x_step = static_cast<std::uint32_t>(channel.xSampling);
    const auto y_step = static_cast<std::uint32_t>(channel.ySampling);
    char* base = reinterpret_cast<char*>(pixels_.values.data()) + c * sizeof(float);
    std::int64_t stride = sizeof(glm::vec3);
    std::int64_t row = stride * pixels_.width;
    if (x_step != 1 || y_step != 1) {
      planes_[c] = SampledPlane(pixels_.width, pixels_.height, x_step, y_step);
      base = reinterpret_cast<char*>(planes_[c].values.data());
      stride = sizeof(float);
      row = stride * planes_[c].width;
    }
    // A slice's base is the address of pixel (0, 0), which may be outside of the data window.
    base -= description_.data.left / channel.xSampling * stride + description_.data.top / channel.ySampling * row;
    return {Imf::FLOAT,       base, static_cast<std::size_t>(stride), static_cast<std::size_t>(row), channel.xSampling,
            channel.ySampling};
  }

  /// Y, RY = (R - Y) / Y and BY = (B - Y) / Y, as in ImfRgbaYca.h.
  [[nodiscard]] glm::vec3 from_chroma(const glm::vec3& value) const {
    const float red = (value.y + 1.0F) * value.x;
    const float blue = (value.z + 1.0F) * value.x;
    return {red, (value.x - weights_.x * red - weights_.z * blue) / weights_.y, blue};
  }

  std::string path_;
  ByteStream stream_;
  Imf::MultiPartInputFile file_;
  std::optional<Imf::InputPart> part_;
  Description description_;
  EnvironmentPixels pixels_;
  std::array<SampledPlane, 3> planes_;
  std::array<SampledPlane, 3> luminance_;         ///< at the chroma samples
  glm::vec3 weights_{0.2126F, 0.7152F, 0.0722F};  ///< luminance weights of the file's primaries
};

/// Returns the display window of an image that has pixels in its data window; the rest is black.
EnvironmentPixels in_display_window(EnvironmentPixels from, const Window& data, const Window& display,
                                    const std::string& path, Progress* progress) {
  if (data == display) return from;
  const std::int64_t left = std::max(data.left, display.left);
  const std::int64_t right = std::min(data.left + data.width, display.left + display.width);
  const std::int64_t top = std::max(data.top, display.top);
  const std::int64_t bottom = std::min(data.top + data.height, display.top + display.height);
  if (left >= right || top >= bottom) fail(path, "has no pixels in its display window");
  EnvironmentPixels to;
  to.width = static_cast<std::uint32_t>(display.width);
  to.height = static_cast<std::uint32_t>(display.height);
  to.remarks = std::move(from.remarks);
  if (right - left < display.width || bottom - top < display.height) {
    to.remarks.emplace_back("its data window is smaller than its display window; pixels outside are black");
  }
  resize(to.values, std::size_t{to.width} * to.height, progress);
  for (std::int64_t y = top; y < bottom; ++y) {
    check(progress);
    const auto row = from.values.begin() + (y - data.top) * data.width + (left - data.left);
    std::copy(row, row + (right - left), to.values.begin() + (y - display.top) * display.width + (left - display.left));
  }
  return to;
}

EnvironmentPixels to_rec709(EnvironmentPixels pixels, const Description& description, Progress* progress) {
  std::optional<glm::dmat3> matrix;
  std::string from;
  if (description.channels.kind == ExrChannels::Kind::xyz) {
    matrix = rec709_matrix_of_xyz();
    from = "CIE XYZ";
  } else if (description.channels.kind != ExrChannels::Kind::luminance &&
             !similar(description.primaries, Primaries{})) {
    matrix = rec709_matrix(description.primaries);
    from = name_of(description.primaries);
    if (!matrix) pixels.remarks.emplace_back("its chromaticities are invalid; Rec. 709 is assumed");
  }
  if (matrix) {
    convert_rows(pixels, *matrix, from, progress);
  } else if (description.channels.kind == ExrChannels::Kind::luminance_chroma) {
    // Interpolated chroma may be outside of the gamut.
    for (std::uint32_t y = 0; y < pixels.height; ++y) {
      check(progress);
      for (glm::vec3& value : row_of(pixels, y)) value = into_gamut(value);
    }
  }
  return pixels;
}

}  // namespace

EnvironmentPixels read_exr(std::vector<std::uint8_t> bytes, const std::string& path, Progress* progress) {
  try {
    const auto file = make_deferred_delete<ExrPicture>(std::move(bytes), path);
    file->open(progress);
    const Description& description = file->description();
    // OpenEXR caches the block of rows that it decoded last.
    constexpr std::uint32_t rows = 64;
    ProgressPart part(progress, decoded_from, decoded_to, file->height());
    for (std::uint32_t y = 0; y < file->height();) {
      const std::uint32_t next = run_cancellable(progress, [file, y] { return file->decode(y, rows); });
      part.add(next - y);
      y = next;
    }
    file->prepare_chroma();
    for (std::uint32_t y = 0; file->is_coded() && y < file->height(); ++y) {
      part.check();
      file->combine(y);
    }
    EnvironmentPixels pixels = in_display_window(to_rec709(file->take(), description, progress), description.data,
                                                 description.display, path, progress);
    if (!description.cube) return pixels;
    EnvironmentPixels flat = resample({pixels.width, std::move(pixels.values)}, progress);
    flat.remarks = std::move(pixels.remarks);
    return flat;
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    fail(path, "not a readable OpenEXR file: " + one_line(error.what(), 200));
  }
}

}  // namespace cumulet::light
