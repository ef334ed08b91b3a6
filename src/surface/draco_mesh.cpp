#include "surface/draco_mesh.hpp"

#include <draco/compression/decode.h>
#include <draco/compression/point_cloud/point_cloud_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>

#include <algorithm>
#include <limits>

#include "base/detached_work.hpp"

namespace cumulet::surface::detail {

namespace {

/// Returns the number of triangles in the stream's header, which the decoder would allocate.
std::uint64_t face_count(std::span<const std::uint8_t> bytes, const std::string& what) {
  const std::string broken = what + " cannot be decompressed (KHR_draco_mesh_compression)";
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::DracoHeader header{};
  if (!draco::PointCloudDecoder::DecodeHeader(&buffer, &header).ok()) malformed(broken);
  if (header.encoder_type != draco::TRIANGULAR_MESH || header.version_major != 2 || header.version_minor != 2) {
    malformed(what + ": its Draco stream is not a mesh of version 2.2");
  }
  buffer.set_bitstream_version(
      static_cast<std::uint16_t>(DRACO_BITSTREAM_VERSION(header.version_major, header.version_minor)));
  if ((header.flags & METADATA_FLAG_MASK) != 0) {
    draco::GeometryMetadata metadata;
    draco::MetadataDecoder decoder;
    if (!decoder.DecodeGeometryMetadata(&buffer, &metadata)) malformed(broken);
  }
  std::uint32_t faces = 0;
  if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING) {
    std::uint8_t traversal = 0;
    std::uint32_t vertices = 0;
    if (!buffer.Decode(&traversal) || !draco::DecodeVarint(&vertices, &buffer)) malformed(broken);
  }
  if (!draco::DecodeVarint(&faces, &buffer)) malformed(broken);
  return faces;
}

double largest(draco::DataType type) {
  switch (type) {
    case draco::DT_INT8:
      return std::numeric_limits<std::int8_t>::max();
    case draco::DT_UINT8:
      return std::numeric_limits<std::uint8_t>::max();
    case draco::DT_INT16:
      return std::numeric_limits<std::int16_t>::max();
    case draco::DT_UINT16:
      return std::numeric_limits<std::uint16_t>::max();
    default:
      return 1.0;
  }
}

class DecodedMesh final : public DracoMesh {
 public:
  DecodedMesh(std::unique_ptr<draco::Mesh> mesh, const Budget& budget) : mesh_(std::move(mesh)), budget_(budget) {}

  [[nodiscard]] std::size_t vertex_count() const override { return mesh_->num_points(); }

  [[nodiscard]] std::vector<std::uint32_t> indices() const override {
    std::vector<std::uint32_t> result;
    result.reserve(std::size_t{mesh_->num_faces()} * 3);
    for (std::uint32_t f = 0; f < mesh_->num_faces(); ++f) {
      budget_.check(f);
      for (const draco::PointIndex& point : mesh_->face(draco::FaceIndex(f))) result.push_back(point.value());
    }
    return result;
  }

  void read(std::uint32_t id, std::size_t components, bool normalized, const std::vector<std::uint32_t>& which,
            float* to, std::size_t step, const std::string& what) const override {
    draco::Mesh& mesh = *mesh_;
    const int attribute_id = mesh.GetAttributeIdByUniqueId(id);
    if (attribute_id < 0) malformed(what + ": there is no Draco attribute " + std::to_string(id));
    draco::PointAttribute* attribute = mesh.attribute(attribute_id);
    if (!attribute->is_mapping_identity() && attribute->indices_map_size() < mesh.num_points()) {
      malformed(what + " has fewer elements than vertices");
    }
    if (attribute->num_components() < components) malformed(what + " has the wrong type of element");
    // Draco's own flag may differ from the accessor's.
    attribute->set_normalized(false);
    const double divisor = normalized ? largest(attribute->data_type()) : 1.0;
    std::vector<float> element(attribute->num_components());
    for (std::size_t n = 0; n < which.size(); ++n) {
      budget_.check(n);
      const draco::AttributeValueIndex index = attribute->mapped_index(draco::PointIndex(which[n]));
      if (index.value() >= attribute->size() ||
          !attribute->ConvertValue(index, static_cast<std::int8_t>(element.size()), element.data())) {
        malformed(what + " has fewer elements than vertices");
      }
      for (std::size_t c = 0; c < components; ++c) {
        to[n * step + c] = divisor == 1.0 ? element[c] : static_cast<float>(std::max(element[c] / divisor, -1.0));
      }
    }
  }

 private:
  std::unique_ptr<draco::Mesh> mesh_;
  const Budget& budget_;
};

}  // namespace

std::unique_ptr<DracoMesh> decode_draco(Bytes bytes, const Owner& owner, const std::string& what, Budget& budget) {
  const std::uint64_t faces = face_count(bytes, what);
  // This is far above the compression ratio of regular meshes.
  if (faces > bytes.size() * 1024) {
    malformed(what + ": " + std::to_string(bytes.size()) + " bytes cannot hold " + std::to_string(faces) +
              " triangles");
  }
  constexpr std::uint64_t bytes_per_face = 256;  // of the decoder's tables
  budget.take(faces, bytes_per_face, what);
  auto mesh = run_cancellable(budget.progress_for(faces * bytes_per_face), [bytes, owner, what] {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) {
      malformed(what + " cannot be decompressed (KHR_draco_mesh_compression): " +
                one_line(decoded.status().error_msg_string()));
    }
    return std::move(decoded).value();
  });
  return std::make_unique<DecodedMesh>(std::move(mesh), budget);
}

}  // namespace cumulet::surface::detail
