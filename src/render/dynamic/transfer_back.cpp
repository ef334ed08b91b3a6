#include "render/dynamic/transfer_back.hpp"

#include <array>
#include <chrono>
#include <utility>
#include <variant>

#include "render/dynamic/voxel_formats.hpp"

namespace cumulet::render {

using volume::brick_voxels;

TransferBack::TransferBack(TransferContext& context, Info info, std::vector<volume::Channel> channels, FindState find,
                           Arrive arrive)
    : VoxelTransfer(context, std::move(info)),
      channels_(std::move(channels)),
      find_(std::move(find)),
      arrive_(std::move(arrive)) {}

std::optional<VoxelTransfer::Announced> TransferBack::announced() const {
  if (!info_.whole) return std::nullopt;
  return Announced{channels_, false, state_ ? state_->index_to_world : glm::dmat4(1.0)};
}

std::uint64_t TransferBack::bytes() const {
  std::uint64_t sum = 0;
  if (!state_) return sum;
  for (const scene::StateInGl::Field& field : state_->fields) {
    for (const volume::DeviceMemoryPtr& memory : field.bricks->memories) sum += memory->bytes();
  }
  return sum;
}

void TransferBack::read(const scene::StateInGlPtr& state) {
  channels_.clear();
  for (const scene::StateInGl::Field& field : state->fields) {
    auto& memories = memories_.emplace_back();
    for (const volume::DeviceMemoryPtr& memory : field.bricks->memories) {
      memories.push_back(
          gl::ReadBack::unfilled(context_.gl, memory->bytes(), "creating the read-back of the host's bricks"));
      context_.gl->CopyNamedBufferSubData(context_.memories->find(*memory)->name(), memories.back().name(), 0, 0,
                                          static_cast<GLsizeiptr>(memory->bytes()));
    }
    volume::BrickCopy copy(state->index_to_world);
    copy.reserve(field.bricks->origins.size() + field.bricks->emptied.size());
    for (const glm::ivec3& origin : field.bricks->emptied) copy.add(origin, std::array<float, brick_voxels>{});
    channels_.push_back(field.channel);
    fields_.push_back({field.channel, std::move(copy)});
  }
  fence_ = context_.fence();
  gl::check(*context_.gl, transfer_step);
  state_ = state;
}

bool TransferBack::take(Deadline deadline) {
  constexpr std::size_t at_a_time = 256;
  std::array<float, brick_voxels> values{};
  for (; field_ < state_->fields.size(); ++field_, taken_ = 0) {
    const volume::DeviceBricks& bricks = *state_->fields[field_].bricks;
    auto& copy = std::get<volume::BrickCopy>(fields_[field_].voxels);
    while (taken_ < bricks.origins.size()) {
      const volume::DeviceBricks::Location& location = bricks.locations[taken_];
      const VoxelFormat format = bricks.memories[location.memory]->halves ? VoxelFormat::halves : VoxelFormat::floats;
      unpack(format, memories_[field_][location.memory].data() + location.brick * brick_bytes(format), values);
      copy.add(bricks.origins[taken_], values);
      if (++taken_ % at_a_time == 0 && std::chrono::steady_clock::now() > deadline) return false;
    }
  }
  return true;
}

VoxelTransfer::Step TransferBack::advance(Deadline deadline) {
  if (!state_) {
    const scene::StateInGlPtr state = find_();
    if (!state || !context_.has(*state)) return Arrived{};
    read(state);
  }
  if (!fence_.passed() || !take(deadline)) return Waits{};
  arrive_(std::move(fields_));
  return Arrived{};
}

}  // namespace cumulet::render
