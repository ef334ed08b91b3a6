#pragma once

// Handle types of the C ABI, except cumulet_viewer.

#include <atomic>
#include <memory>

#include "assets/instance.hpp"
#include "assets/live.hpp"
#include "assets/sequence.hpp"
#include "assets/surface_asset.hpp"
#include "assets/volume_asset.hpp"
#include "light/environment.hpp"
#include "viewer/c_support.hpp"
#include "viewer/sharing.hpp"

struct cumulet_volume {
  cumulet::viewer::VolumeAssetPtr asset;
  std::atomic<int> references = 1;
};

struct cumulet_surfaces {
  cumulet::viewer::SurfaceAssetPtr asset;
  std::atomic<int> references = 1;
};

struct cumulet_environment {
  cumulet::light::EnvironmentPtr asset;
  std::atomic<int> references = 1;
};

struct cumulet_instance {
  std::shared_ptr<cumulet::viewer::Instance> asset;
  std::atomic<int> references = 1;
};

struct cumulet_model {
  std::shared_ptr<cumulet::viewer::ModelInstance> asset;
  std::atomic<int> references = 1;
};

struct cumulet_sequence {
  std::shared_ptr<cumulet::viewer::Sequence> asset;
  std::atomic<int> references = 1;
};

struct cumulet_dynamic_volume {
  std::shared_ptr<cumulet::viewer::Live> asset;
  std::atomic<int> references = 1;
};

struct cumulet_shader_cache {
  std::shared_ptr<cumulet::viewer::Sharing> asset;
  std::atomic<int> references = 1;
};

namespace cumulet::viewer {
class Camera;
}

struct cumulet_camera {
  std::shared_ptr<cumulet::viewer::Camera> asset;
};

namespace cumulet::c_abi {

/// Convert and check a host's descriptors.
volume::DenseVoxels to_dense(const cumulet_dense_desc* desc, const std::string& name);
volume::SparseVoxels to_sparse(const cumulet_sparse_desc* desc, const std::string& name);
/// name: appears in messages.
viewer::VolumeAssetPtr asset_of(const std::string& name, volume::VolumeFrame frame);
viewer::VolumeFile to_volume_file(const cumulet_volume_file_desc* desc);

/// Runs a call on a handle's object. what: kind of object, for messages.
template <class Handle, class Call>
cumulet_status on(Handle* handle, const char* what, Call&& call) noexcept {
  return guarded(nullptr, 0, [&] {
    if (handle == nullptr) refuse(std::string("the ") + what + " is NULL");
    const auto kept = handle->asset;  // the callbacks of this call may release the handle
    call(*kept);
  });
}

// Reference-counted handles of one asset each.

template <class Handle>
Handle* retain(Handle* handle) {
  if (handle != nullptr) handle->references.fetch_add(1, std::memory_order_relaxed);
  return handle;
}

template <class Handle>
void release(Handle* handle) {
  const HostCall host_call;
  if (handle != nullptr && handle->references.fetch_sub(1, std::memory_order_acq_rel) == 1) delete handle;
}

/// Returns the handle of the asset that make() returns; on failure null and the cause.
template <class Handle, class Make>
cumulet_status make_handle(Handle** out, char* error, size_t error_size, Make&& make) noexcept {
  if (out != nullptr) *out = nullptr;
  return guarded(error, error_size, [&] {
    require(out != nullptr, "out is NULL");
    auto handle = std::make_unique<Handle>();
    handle->asset = make();
    *out = handle.release();
  });
}

/// Keeps the handle of a displayed object, so that repeated queries return the same handle.
template <class Handle>
class KeptHandle {
 public:
  void keep(Handle* handle) { handle_.reset(retain(handle)); }
  /// Returns a handle retained for the caller; null for no asset.
  template <class Asset>
  Handle* of(Asset asset) {
    if (!asset) return nullptr;
    if (!handle_ || handle_->asset != asset) {
      handle_.reset(new Handle);
      handle_->asset = std::move(asset);
    }
    return retain(handle_.get());
  }

 private:
  struct End {
    void operator()(Handle* handle) const { release(handle); }
  };
  std::unique_ptr<Handle, End> handle_;
};

}  // namespace cumulet::c_abi
