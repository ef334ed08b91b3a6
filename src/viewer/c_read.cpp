// Read-back without waiting, of the C ABI.

#include "settings/aov_table.hpp"
#include "viewer/c_viewer.hpp"

namespace {

using namespace cumulet::c_abi;
namespace core = cumulet::viewer;

core::ReadRequest request_of(const cumulet_read_desc* desc) {
  const cumulet_read_desc d = read_desc(desc, "cumulet_read_desc");
  require(number(d.source) <= CUMULET_READ_LIGHT_GROUP, "cumulet_read_desc.source is unknown");
  require(number(d.aov) < cumulet::settings::aovs.size(), "cumulet_read_desc.aov is unknown");
  return {static_cast<core::ReadRequest::Source>(d.source), static_cast<core::Aov>(d.aov), d.light_group};
}

}  // namespace

cumulet_status cumulet_begin_read(cumulet_viewer* viewer, const cumulet_read_desc* desc, uint64_t* read) {
  return guarded(viewer, [&](core::Viewer& v) {
    require(read != nullptr, "read is NULL");
    *read = 0;
    *read = v.begin_read(request_of(desc));
  });
}

cumulet_status cumulet_finish_read(cumulet_viewer* viewer, uint64_t read, float* values, size_t count,
                                   cumulet_read_info* info) {
  return guarded(viewer, [&](core::Viewer& v) {
    read_desc(info, "cumulet_read_info");
    const core::ReadState state = v.finish_read(read, values, count);
    cumulet_read_info out{};
    out.ready = state.ready ? 1 : 0;
    out.width = state.size.x;
    out.height = state.size.y;
    out.channels = state.channels;
    write_desc(info, out, "cumulet_read_info");
  });
}

cumulet_status cumulet_cancel_read(cumulet_viewer* viewer, uint64_t read) {
  return guarded(viewer, [&](core::Viewer& v) { v.cancel_read(read); });
}
