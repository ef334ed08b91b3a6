#include "exposure_meter.hpp"

#include <cstddef>
#include <utility>
#include <vector>

namespace cumulet::demo {

std::optional<Metered> ExposureMeter::follow(cumulet_viewer* viewer, bool complete, std::uint32_t flags,
                                             image::Curve curve) {
  if ((flags & (CUMULET_RENDER_NEW_IMAGE | CUMULET_RENDER_CONVERGED)) != 0) fresh_ = true;
  if (turns_ && complete && fresh_) {
    // Each of these frames begins a read, so that reads() asks for the next one. The last read counts.
    if (--*turns_ <= 0) turns_.reset();
    if (read_ != 0) static_cast<void>(cumulet_cancel_read(viewer, std::exchange(read_, 0)));
    cumulet_read_desc desc{};
    desc.struct_size = sizeof desc;
    desc.source = CUMULET_READ_LINEAR;
    if (cumulet_begin_read(viewer, &desc, &read_) != CUMULET_OK) read_ = 0;
    return std::nullopt;
  }
  if (turns_ || read_ == 0) return std::nullopt;
  cumulet_read_info info{};
  info.struct_size = sizeof info;
  if (cumulet_finish_read(viewer, read_, nullptr, 0, &info) != CUMULET_OK) {
    read_ = 0;
    return std::nullopt;
  }
  if (info.ready == 0) return std::nullopt;
  std::vector<float> rgba(std::size_t{info.channels} * info.width * info.height);
  const std::uint64_t read = std::exchange(read_, 0);
  if (cumulet_finish_read(viewer, read, rgba.data(), rgba.size(), &info) != CUMULET_OK) return std::nullopt;
  return Metered{image::suitable_exposure(rgba, info.width, info.height, curve)};
}

}  // namespace cumulet::demo
