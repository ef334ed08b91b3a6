#pragma once

// What the C ABI's handles are, apart from the viewer's.

#include <atomic>
#include <memory>

#include "viewer/volume_asset.hpp"

struct cumulet_volume {
  cumulet::viewer::VolumePtr asset;
  std::atomic<int> references = 1;
};

namespace cumulet::viewer {
class Camera;
}

struct cumulet_camera {
  std::shared_ptr<cumulet::viewer::Camera> camera;
};
