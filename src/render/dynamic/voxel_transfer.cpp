#include "render/dynamic/voxel_transfer.hpp"

#include <algorithm>
#include <utility>

namespace cumulet::render {

bool TransferContext::has(const scene::StateInGl& state) const {
  return std::ranges::all_of(state.all(), [&](const volume::DeviceBricks* bricks) { return memories->has(*bricks); });
}

PackedTransfer::PackedTransfer(TransferContext& context, Info info, PackedFields packed, gl::Fence fence)
    : VoxelTransfer(context, std::move(info)), packed_(std::move(packed)) {
  fence_ = std::move(fence);
}

std::vector<volume::Channel> PackedTransfer::channels() const {
  std::vector<volume::Channel> channels;
  for (const volume::FieldCopy& field : packed_.fields) channels.push_back(field.channel);
  return channels;
}

}  // namespace cumulet::render
