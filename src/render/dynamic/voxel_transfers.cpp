#include "render/dynamic/voxel_transfers.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <exception>
#include <iterator>
#include <memory>
#include <utility>

#include "base/error.hpp"
#include "base/one_line.hpp"
#include "render/dynamic/product_transfer.hpp"
#include "render/dynamic/transfer_back.hpp"
#include "render/dynamic/transfer_in_gl.hpp"
#include "render/dynamic/transfer_to_memory.hpp"

namespace cumulet::render {

VoxelTransfers::VoxelTransfers(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits,
                               DeviceMemoriesPtr memories)
    : context_{std::move(gl), std::move(programs), std::move(memories), std::nullopt},
      packer_(context_.gl, context_.programs, limits) {}

void VoxelTransfers::begin(const GlState& state, const void* whose, Arrival arrival, Refuse refuse) {
  const auto& gl = *context_.gl;
  const gl::DebugGroup group(gl, "cumulet: dynamic voxels");
  if (state.wait != nullptr && gl.IsSync(state.wait) == GL_FALSE)
    throw Error(ErrorCode::invalid_argument, one_line(state.name + ": `wait` is not a valid GLsync"));
  VoxelTransfer::Info info{whose, !state.changed, state.name, std::move(refuse)};
  auto* stay = std::get_if<StayInGl>(&arrival);
  PackedFields packed = packer_.plan(state, stay != nullptr);
  // The driver can compile the programs while bricks are packed.
  if (stay != nullptr) TransferInGl::ask_for_programs(context_, packed);
  packer_.pack(packed, state.wait);
  gl::Fence fence = context_.fence();
  gl::check(gl, transfer_step);
  if (info.whole) {
    // Superseded transfers are dropped except for the first, so that states arrive however fast they come.
    const auto of_one = [&](const VoxelTransferPtr& other) {
      return other->info().whose == whose && other->is_superseded();
    };
    auto other = std::ranges::find_if(transfers_, of_one);
    if (other != transfers_.end()) ++other;
    while ((other = std::find_if(other, transfers_.end(), of_one)) != transfers_.end()) other = drop(other);
  }
  if (stay != nullptr) {
    transfers_.push_back(std::make_unique<TransferInGl>(context_, std::move(info), std::move(packed), std::move(fence),
                                                        std::move(*stay)));
  } else {
    transfers_.push_back(std::make_unique<TransferToMemory>(context_, std::move(info), std::move(packed),
                                                            std::move(fence), std::get<Arrive>(std::move(arrival))));
  }
}

void VoxelTransfers::bring_back(const void* whose, const std::vector<volume::Channel>& channels, Find find,
                                Arrive arrive, Refuse refuse) {
  transfers_.push_back(std::make_unique<TransferBack>(context_,
                                                      VoxelTransfer::Info{whose, true, "state", std::move(refuse)},
                                                      channels, std::move(find), std::move(arrive)));
}

void VoxelTransfers::make_products(const void* whose, std::string name, StayInGl stay) {
  VoxelTransfer::Info info{whose, false, std::move(name), [] {}};
  transfers_.push_back(std::make_unique<ProductTransfer>(context_, std::move(info), std::move(stay)));
}

std::optional<VoxelTransfers::Announced> VoxelTransfers::announced(const void* whose) const {
  for (std::size_t i = transfers_.size(); i-- > 0;) {
    if (transfers_[i]->info().whose != whose) continue;
    if (std::optional<Announced> state = transfers_[i]->announced()) return state;
  }
  return std::nullopt;
}

VoxelTransfers::Transfers::iterator VoxelTransfers::drop(const Transfers::iterator& transfer) {
  (*transfer)->order();  // another context of the group may have started it
  (*transfer)->recycle(packer_);
  return transfers_.erase(transfer);
}

void VoxelTransfers::refuse_on_top(const VoxelTransfer::Info& whole) {
  for (auto other = transfers_.begin(); other != transfers_.end();) {
    if ((*other)->info().whose != whole.whose) {
      ++other;
      continue;
    }
    if ((*other)->info().whole) break;
    other = (*other)->needs_state_before() ? drop(other) : std::next(other);
  }
  whole.refuse();
}

void VoxelTransfers::follow(Deadline deadline) {
  constexpr int long_time = 300;
  context_.memories->collect();
  if (transfers_.empty()) {
    if (++idle_ == long_time) packer_.clear();
    return;
  }
  idle_ = 0;
  while (!transfers_.empty()) {
    std::exception_ptr failure;
    bool valid = true;
    try {
      VoxelTransfer::Step step = transfers_.front()->advance(deadline);
      if (std::holds_alternative<VoxelTransfer::Waits>(step)) return;
      if (auto* next = std::get_if<VoxelTransferPtr>(&step)) {
        transfers_.front()->recycle(packer_);
        transfers_.front() = std::move(*next);
        continue;
      }
      failure = std::get<VoxelTransfer::Arrived>(step).failure;
    } catch (...) {
      failure = std::current_exception();
      valid = false;
    }
    const VoxelTransferPtr done = std::move(transfers_.front());
    transfers_.pop_front();
    done->recycle(packer_);
    if (!valid && done->info().whole) refuse_on_top(done->info());
    if (failure) std::rethrow_exception(failure);
    if (std::chrono::steady_clock::now() > deadline) return;
  }
}

std::uint64_t VoxelTransfers::bytes() const {
  std::uint64_t sum = packer_.bytes();
  for (const VoxelTransferPtr& transfer : transfers_) sum += transfer->bytes();
  return sum;
}

}  // namespace cumulet::render
