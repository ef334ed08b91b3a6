#include "base/missing_feature.hpp"
#include "surface/draco_mesh.hpp"

namespace cumulet::surface::detail {

struct DracoMesh::State {};

namespace {

[[noreturn]] void refuse(const std::string& what) {
  malformed(missing_feature(what + " is compressed by Draco", "CUMULET_DRACO"));
}

}  // namespace

DracoMesh::DracoMesh(Bytes /*bytes*/, const Owner& /*owner*/, const std::string& what, Budget& budget)
    : budget_(budget) {
  refuse(what);
}
DracoMesh::~DracoMesh() = default;

// No object exists, so these are never called.
std::size_t DracoMesh::vertex_count() const { return 0; }
std::vector<std::uint32_t> DracoMesh::indices() const { return {}; }
void DracoMesh::read(std::uint32_t /*id*/, std::size_t /*components*/, bool /*normalized*/,
                     const std::vector<std::uint32_t>& /*which*/, float* /*to*/, std::size_t /*step*/,
                     const std::string& what) const {
  refuse(what);
}

}  // namespace cumulet::surface::detail
