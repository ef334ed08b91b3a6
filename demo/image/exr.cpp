#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfMatrixAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfVecAttribute.h>

#include <array>
#include <cstring>
#include <optional>
#include <utility>

#include "checks.hpp"
#include "file.hpp"
#include "image.hpp"
#include "layers.hpp"
#include "program.hpp"

namespace cumulet::image {
namespace {

/// Writes to memory. OpenEXR writes its line table in a destructor, where write errors are lost; the file is written by
/// replace_file, which checks them.
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

std::string full_name(const LayerName& layer, std::size_t channel) {
  std::string name(layer.name);
  if (!name.empty()) name += '.';
  return name += layer.channels[channel];
}

constexpr std::size_t longest_name = 31;  // maximum length of an attribute name

void insert(Imf::Header& header, const Attribute& attribute) {
  if (attribute.name.empty() || attribute.name.size() > longest_name)
    throw std::logic_error("an attribute cannot be called \"" + attribute.name + "\"");
  struct Insert {
    Imf::Header& header;
    const std::string& name;
    void operator()(const std::string& text) const { header.insert(name, Imf::StringAttribute(text)); }
    void operator()(float number) const { header.insert(name, Imf::FloatAttribute(number)); }
    void operator()(double number) const { header.insert(name, Imf::DoubleAttribute(number)); }
    void operator()(const std::array<float, 2>& v) const { header.insert(name, Imf::V2fAttribute({v[0], v[1]})); }
    void operator()(const std::array<double, 3>& v) const {
      header.insert(name, Imf::V3dAttribute({v[0], v[1], v[2]}));
    }
    void operator()(const std::array<float, 16>& m) const {
      Imath::M44f matrix;
      std::memcpy(matrix.x, m.data(), sizeof matrix.x);
      header.insert(name, Imf::M44fAttribute(matrix));
    }
  };
  std::visit(Insert{header, attribute.name}, attribute.value);
}

/// Converts an attribute; nullopt if its type is not one that write_exr writes.
std::optional<Attribute> read_attribute(const char* name, const Imf::Attribute& attribute) {
  if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&attribute)) return Attribute{name, text->value()};
  if (const auto* number = dynamic_cast<const Imf::FloatAttribute*>(&attribute))
    return Attribute{name, number->value()};
  if (const auto* number = dynamic_cast<const Imf::DoubleAttribute*>(&attribute))
    return Attribute{name, number->value()};
  if (const auto* v = dynamic_cast<const Imf::V2fAttribute*>(&attribute))
    return Attribute{name, std::array{v->value().x, v->value().y}};
  if (const auto* v = dynamic_cast<const Imf::V3dAttribute*>(&attribute))
    return Attribute{name, std::array{v->value().x, v->value().y, v->value().z}};
  if (const auto* m = dynamic_cast<const Imf::M44fAttribute*>(&attribute)) {
    std::array<float, 16> matrix{};
    std::memcpy(matrix.data(), m->value().x, sizeof matrix);
    return Attribute{name, matrix};
  }
  return std::nullopt;
}

/// Returns width and height of the data window. Throws if they are out of range.
std::array<std::uint32_t, 2> size_of(const Imf::Header& header) {
  const Imath::Box2i& window = header.dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  if (width < 1 || height < 1 || width > max_side || height > max_side)
    throw std::runtime_error("unsupported size " + std::to_string(width) + "x" + std::to_string(height));
  return {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
}

/// Returns the windows. Throws if write_exr would not write such windows.
Windows windows_of(const Imf::Header& header) {
  const auto [width, height] = size_of(header);
  const Imath::Box2i& data = header.dataWindow();
  const Imath::Box2i& whole = header.displayWindow();
  if (!whole.intersects(data.min) || !whole.intersects(data.max) || whole.max.x - whole.min.x >= max_side ||
      whole.max.y - whole.min.y >= max_side)
    throw std::runtime_error("its data window is not within its display window");
  const auto number = [](int value) { return static_cast<std::uint32_t>(value); };
  return {width,
          height,
          number(data.min.x - whole.min.x),
          number(data.min.y - whole.min.y),
          number(whole.max.x - whole.min.x + 1),
          number(whole.max.y - whole.min.y + 1)};
}

/// Opens the file, calls `read` with it and returns its result. Throws one line with the path.
template <class Read>
auto read_exr_file(const std::string& path, const Read& read) {
  static_cast<void>(read_file(path));  // fails with the system's error message if the file cannot be opened
  try {
    Imf::InputFile file(path.c_str());
    return read(file);
  } catch (const std::exception& error) {
    fail(path, "not a readable OpenEXR file: " + demo::one_line(error.what()));
  }
}

/// fill: value of each missing channel; empty: a missing channel is an error.
Pixels read_layer(const std::string& path, const LayerName& layer, std::span<const float> fill) {
  return read_exr_file(path, [&](Imf::InputFile& file) {
    const auto [width, height] = size_of(file.header());
    const Imath::Box2i& window = file.header().dataWindow();
    const std::size_t channels = layer.channels.size();
    Pixels pixels{width, height, {}};
    pixels.values.resize(channels * pixels.width * pixels.height);
    const std::size_t stride = channels * sizeof(float);
    // The base of a slice is the address of pixel (0, 0), which may lie outside the data window.
    const std::int64_t origin = (std::int64_t{window.min.y} * width + window.min.x) * static_cast<std::int64_t>(stride);
    char* base = reinterpret_cast<char*>(pixels.values.data()) - origin;
    Imf::FrameBuffer frame;
    for (std::size_t c = 0; c < channels; ++c) {
      const std::string name = full_name(layer, c);
      if (fill.empty() && file.header().channels().findChannel(name) == nullptr)
        throw std::runtime_error("it has no channel " + name);
      frame.insert(name, Imf::Slice(Imf::FLOAT, base + sizeof(float) * c, stride, stride * pixels.width, 1, 1,
                                    fill.empty() ? 0.0 : double{fill[c]}));
    }
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
    return pixels;
  });
}

}  // namespace

void write_exr(const std::string& path, const Windows& windows, std::span<const Layer> layers,
               std::span<const Attribute> attributes) {
  const std::size_t width = windows.width;
  const std::size_t height = windows.height;
  check_size(path, windows.width, windows.height);
  check_size(path, windows.whole_width, windows.whole_height);
  const Imath::V2i first(static_cast<int>(windows.left), static_cast<int>(windows.top));
  const Imath::V2i size(static_cast<int>(width), static_cast<int>(height));
  Imf::Header header(static_cast<int>(windows.whole_width), static_cast<int>(windows.whole_height));
  header.dataWindow() = {first, first + size - Imath::V2i(1)};
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::addChromaticities(header, Imf::Chromaticities());  // the default is Rec. 709
  for (const Attribute& attribute : attributes) insert(header, attribute);
  Imf::FrameBuffer frame;
  for (const Layer& layer : layers) {
    const std::size_t channels = layer.name.channels.size();
    if (layer.values.size() != channels * width * height)
      throw std::logic_error(path + ": the image size and the pixels of layer \"" + std::string(layer.name.name) +
                             "\" disagree");
    // OpenEXR requires a mutable pointer, but only reads. The base is the address of pixel (0, 0).
    const std::size_t stride = channels * sizeof(float);
    const std::size_t origin = (windows.top * width + windows.left) * stride;
    char* base = const_cast<char*>(reinterpret_cast<const char*>(layer.values.data())) - origin;
    for (std::size_t c = 0; c < channels; ++c) {
      const std::string name = full_name(layer.name, c);
      if (header.channels().findChannel(name) != nullptr)
        throw std::logic_error(std::string(path).append(": two channels have the name ").append(name));
      header.channels().insert(name, Imf::Channel(Imf::FLOAT));
      frame.insert(name, Imf::Slice(Imf::FLOAT, base + sizeof(float) * c, stride, stride * width));
    }
  }
  MemoryOutput output;
  try {
    Imf::OutputFile file(output, header);
    file.setFrameBuffer(frame);
    file.writePixels(static_cast<int>(height));
  } catch (const std::exception& error) {
    fail(path, demo::one_line(error.what()));
  }
  replace_file(path, output.bytes());
}

void write_exr(const std::string& path, const Image& image) {
  const Layer beauty{layers::beauty, image.rgba};
  write_exr(path, image.width, image.height, {&beauty, 1});
}

Contents read_contents(const std::string& path) {
  return read_exr_file(path, [](const Imf::InputFile& file) {
    Contents contents{windows_of(file.header()), {}, {}};
    const Imf::ChannelList& channels = file.header().channels();
    for (auto channel = channels.begin(); channel != channels.end(); ++channel)
      contents.channels.emplace_back(channel.name());
    for (auto attribute = file.header().begin(); attribute != file.header().end(); ++attribute) {
      auto read = read_attribute(attribute.name(), attribute.attribute());
      if (read && read->name.size() <= longest_name) contents.attributes.push_back(std::move(*read));
    }
    return contents;
  });
}

Pixels read_exr(const std::string& path, const LayerName& layer) { return read_layer(path, layer, {}); }

Image read_exr(const std::string& path) {
  constexpr std::array<float, 4> fill{0.0f, 0.0f, 0.0f, 1.0f};
  Pixels pixels = read_layer(path, layers::beauty, fill);
  return {pixels.width, pixels.height, std::move(pixels.values)};
}

}  // namespace cumulet::image
