// Dynamic volumes of the C ABI. cumulet.h documents the calls.

#include <memory>
#include <vector>

#include "assets/live.hpp"
#include "base/library_thread.hpp"
#include "viewer/c_handles.hpp"
#include "viewer/c_support.hpp"
#include "viewer/c_viewer.hpp"

namespace {

using namespace cumulet::c_abi;
namespace render = cumulet::render;
using cumulet::viewer::Live;
using cumulet::volume::Channel;
using cumulet::volume::MemoryField;

static_assert(static_cast<unsigned>(Channel::velocity_z) == CUMULET_CHANNEL_VELOCITY_Z);
static_assert(static_cast<unsigned>(render::VoxelFormat::bytes) == CUMULET_VOXEL_FORMAT_R8);

// Memory of a host; the destructor returns it.
class HostMemory {
 public:
  HostMemory(cumulet_release_fn release, void* user) : release_(release), user_(user) {}
  ~HostMemory() {
    const cumulet::CallbackScope inside;
    const cumulet::viewer::WorkerPool::InCallback waits;
    release_(user_);
  }
  HostMemory(const HostMemory&) = delete;
  HostMemory& operator=(const HostMemory&) = delete;

 private:
  cumulet_release_fn release_;
  void* user_;
};

struct HandedState {
  cumulet_volume_fields_desc desc{};
  std::string name;
  std::vector<MemoryField> fields;
};

MemoryField field_of(const cumulet_field& field, const std::string& what) {
  const cumulet_field f = read_desc(&field, "cumulet_field");
  if (number(f.channel) > CUMULET_CHANNEL_VELOCITY_Z) refuse(what + ": its channel is unknown");
  if ((f.dense == nullptr) == (f.sparse == nullptr)) refuse(what + ": exactly one of dense and sparse must be set");
  const auto channel = static_cast<Channel>(number(f.channel));
  if (f.dense != nullptr) return {channel, to_dense(f.dense, what)};
  return {channel, to_sparse(f.sparse, what)};
}

HandedState state_of(const cumulet_volume_fields_desc* desc) {
  HandedState state;
  state.desc = read_desc(desc, "cumulet_volume_fields_desc");
  state.name = name_or(state.desc.name, "state");
  for_each_desc(
      state.desc.fields, state.desc.field_count, "cumulet_field", state.name + ": field",
      [&](const cumulet_field& field, const std::string& what) { state.fields.push_back(field_of(field, what)); });
  return state;
}

void require_no_release(const HandedState& state) {
  require(state.desc.release == nullptr,
          "cumulet_volume_fields_desc.release is only allowed in cumulet_dynamic_volume_set");
}

render::GlVoxels gl_voxels_of(const cumulet_gl_field& field, const std::string& what) {
  const cumulet_gl_field f = read_desc(&field, "cumulet_gl_field");
  if (number(f.channel) > CUMULET_CHANNEL_VELOCITY_Z) refuse(what + ": its channel is unknown");
  if ((f.texture == 0) == (f.buffer == 0)) refuse(what + ": exactly one of texture and buffer must be set");
  if (f.component > 3) refuse(what + ": its component is not from 0 to 3");
  if (number(f.format) > CUMULET_VOXEL_FORMAT_R8) refuse(what + ": its format is unknown");
  render::GlVoxels voxels{static_cast<Channel>(number(f.channel)), {}, matrix_or_identity(f.index_to_world)};
  if (f.texture != 0) {
    voxels.source = render::VoxelTexture{f.texture, static_cast<int>(f.component)};
  } else {
    voxels.source = render::VoxelBuffer{.name = f.buffer,
                                        .format = static_cast<render::VoxelFormat>(number(f.format)),
                                        .offset = f.offset,
                                        .strides = {f.strides[0], f.strides[1], f.strides[2]},
                                        .size = {f.size[0], f.size[1], f.size[2]}};
  }
  return voxels;
}

render::GlState gl_state_of(const cumulet_gl_volume_desc* desc) {
  const cumulet_gl_volume_desc d = read_desc(desc, "cumulet_gl_volume_desc");
  render::GlState state;
  state.name = name_or(d.name, "state");
  for_each_desc(d.fields, d.field_count, "cumulet_gl_field", state.name + ": field",
                [&](const cumulet_gl_field& field, const std::string& what) {
                  state.fields.push_back(gl_voxels_of(field, what));
                });
  const auto boxes = array_of(d.changed, d.changed_count, 1, state.name + ": changed boxes");
  if (d.changed != nullptr) state.changed.emplace();
  for (const cumulet_voxel_box& b : boxes)
    state.changed->push_back({{b.min[0], b.min[1], b.min[2]}, {b.max[0], b.max[1], b.max[2]}});
  state.wait = static_cast<GLsync>(d.wait);
  return state;
}

std::shared_ptr<Live> live_of(const cumulet_dynamic_volume_desc* desc) {
  const cumulet_dynamic_volume_desc d = read_desc(desc, "cumulet_dynamic_volume_desc");
  const auto moderate = [](double x) { return in_range(x, -1e15, 1e15); };
  require(std::ranges::all_of(d.bounds_min, moderate) && std::ranges::all_of(d.bounds_max, moderate),
          "cumulet_dynamic_volume_desc's bounds are not from -1e15 to 1e15");
  const cumulet::viewer::Bounds bounds{to_dvec3(d.bounds_min), to_dvec3(d.bounds_max)};
  require(d.gpu_resident == 0 || d.gpu_resident == 1, "cumulet_dynamic_volume_desc.gpu_resident is neither 0 nor 1");
  const bool stays = d.gpu_resident == 1;
  if (bounds.min == glm::dvec3(0.0) && bounds.max == glm::dvec3(0.0))
    return std::make_shared<Live>(std::nullopt, stays);
  require(glm::all(glm::lessThan(bounds.min, bounds.max)),
          "cumulet_dynamic_volume_desc.bounds_min is not below bounds_max");
  return std::make_shared<Live>(bounds, stays);
}

// Like on(), for calls with an error buffer.
template <class Call>
cumulet_status on_live(cumulet_dynamic_volume* live, char* error, size_t error_size, Call&& call) noexcept {
  return guarded(error, error_size, [&] {
    require(live != nullptr, "the dynamic volume is NULL");
    const auto kept = live->asset;  // the callbacks of this call may release the handle
    call(*kept);
  });
}

}  // namespace

cumulet_status cumulet_volume_from_fields(const cumulet_volume_fields_desc* desc, cumulet_volume** out, char* error,
                                          size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    const HandedState state = state_of(desc);
    require_no_release(state);
    cumulet::volume::check_fields(state.fields, state.name);
    return asset_of(state.name, cumulet::volume::import_fields(state.fields, state.name, {}));
  });
}

cumulet_status cumulet_dynamic_volume_create(const cumulet_dynamic_volume_desc* desc, cumulet_dynamic_volume** out,
                                             char* error, size_t error_size) {
  return make_handle(out, error, error_size, [&] { return live_of(desc); });
}

cumulet_dynamic_volume* cumulet_dynamic_volume_retain(cumulet_dynamic_volume* live) { return retain(live); }

void cumulet_dynamic_volume_release(cumulet_dynamic_volume* live) { release(live); }

cumulet_status cumulet_dynamic_volume_set(cumulet_dynamic_volume* live, const cumulet_volume_fields_desc* desc,
                                          char* error, size_t error_size) {
  return on_live(live, error, error_size, [&](Live& l) {
    HandedState state = state_of(desc);
    cumulet::viewer::MakeLease lease;
    if (state.desc.release != nullptr)
      lease = [&d = state.desc] { return std::make_shared<HostMemory>(d.release, d.release_user); };
    l.set(state.fields, std::move(state.name), lease);
  });
}

cumulet_status cumulet_dynamic_volume_update(cumulet_dynamic_volume* live, const cumulet_volume_fields_desc* desc,
                                             char* error, size_t error_size) {
  return on_live(live, error, error_size, [&](Live& l) {
    HandedState state = state_of(desc);
    require_no_release(state);
    for (MemoryField& field : state.fields) {
      auto* sparse = std::get_if<cumulet::volume::SparseVoxels>(&field.voxels);
      if (sparse == nullptr) continue;  // refused below
      *sparse = {.brick_origins = sparse->brick_origins,
                 .brick_values = sparse->brick_values,
                 .brick_active = sparse->brick_active,
                 .tiles = {}};
    }
    l.update(state.fields, state.name);
  });
}

cumulet_status cumulet_dynamic_volume_set_gl(cumulet_viewer* viewer, cumulet_dynamic_volume* live,
                                             const cumulet_gl_volume_desc* desc) {
  return guarded(viewer, [&](cumulet::viewer::Viewer& v) {
    require(live != nullptr, "the dynamic volume is NULL");
    v.set_live_gl(live->asset, gl_state_of(desc));
  });
}

cumulet_status cumulet_dynamic_volume_get_volume(cumulet_dynamic_volume* live, cumulet_volume** out, char* error,
                                                 size_t error_size) {
  if (out != nullptr) *out = nullptr;
  return on_live(live, error, error_size, [&](Live& l) {
    require(out != nullptr, "out is NULL");
    cumulet::Progress progress;
    Live::State state = l.read(progress);
    if (!state.volume) return;
    if (const auto& in_gl = state.volume->volume().on_device) {
      in_gl->ask_for_values();
      throw cumulet::Error(
          cumulet::ErrorCode::unsupported,
          state.volume->name() + ": its voxels are on the GPU; they are copied to main memory from now on");
    }
    auto handle = std::make_unique<cumulet_volume>();
    handle->asset = std::move(state.volume);
    *out = handle.release();
  });
}
