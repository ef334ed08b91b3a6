#include "volume/vdb_compression.hpp"
// The line above must come first; vdb_compression.hpp gives the reason.
#include "volume/vdb_metadata.hpp"

#include <openvdb/Metadata.h>
#include <openvdb/Types.h>

#include <cstdint>
#include <optional>
#include <string>

#include "base/number_text.hpp"

namespace cumulet::volume::detail {
namespace {

std::string text_of(float value) { return general_text(value); }
std::string text_of(double value) { return general_text(value); }
std::string text_of(std::int32_t value) { return std::to_string(value); }
std::string text_of(std::int64_t value) { return std::to_string(value); }

/// "[1, 2, 3]"
template <int Size, typename T>
std::string text_of(const openvdb::math::Tuple<Size, T>& value) {
  std::string text = "[";
  for (int i = 0; i < Size; ++i) text += (i > 0 ? ", " : "") + text_of(value[i]);
  return text + "]";
}

/// Formats rows in brackets, one per line, with six decimals.
template <typename T>
std::string text_of(const openvdb::math::Mat4<T>& value) {
  std::string text = "[";
  for (int row = 0; row < 4; ++row) {
    text += row > 0 ? ",\n [" : "[";
    for (int column = 0; column < 4; ++column) {
      text += (column > 0 ? ", " : "") + fixed_text(double{value(row, column)}, 6);
    }
    text += "]";
  }
  return text + "]";
}

template <typename T>
std::optional<std::string> text_as(const openvdb::Metadata& metadata) {
  using Typed = openvdb::TypedMetadata<T>;
  if (metadata.typeName() != Typed::staticTypeName()) return std::nullopt;
  return text_of(static_cast<const Typed&>(metadata).value());
}

/// OpenVDB 13 has metadata of type half, which OpenVDB 10 stores as bytes.
std::optional<std::string> half_text(const openvdb::Metadata& metadata) {
  const auto* bytes = dynamic_cast<const openvdb::UnknownMetadata*>(&metadata);
  if (bytes == nullptr || bytes->typeName() != "half" || bytes->value().size() != 2) return std::nullopt;
  openvdb::math::half half;
  half.setBits(static_cast<unsigned short>(bytes->value()[0] | (bytes->value()[1] << 8U)));
  return text_of(static_cast<float>(half));
}

std::string text_of(const openvdb::Metadata& metadata) {
  using namespace openvdb;
  std::optional<std::string> text = half_text(metadata);
  const auto try_types = [&]<typename... T>() { (void)((text || (text = text_as<T>(metadata))) || ...); };
  try_types.template operator()<std::int32_t, std::int64_t, float, double, Vec2i, Vec2s, Vec2d, Vec3i, Vec3s, Vec3d,
                                Vec4i, Vec4s, Vec4d, math::Mat4s, math::Mat4d>();
  return text ? *text : metadata.str();
}

}  // namespace

std::vector<Metadata> metadata_of(const openvdb::MetaMap& map) {
  std::vector<Metadata> entries;
  for (auto it = map.beginMeta(); it != map.endMeta(); ++it) {
    // OpenVDB's own index of the file, which is binary and large.
    if (it->second->typeName() == "__delayedload") continue;
    constexpr std::size_t longest = 4096;
    entries.push_back({it->first, it->second->typeName(), text_of(*it->second).substr(0, longest)});
  }
  return entries;
}

}  // namespace cumulet::volume::detail
