#include "render/dynamic/transfer_to_memory.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>
#include <variant>

#include "render/dynamic/voxel_formats.hpp"

namespace cumulet::render {

TransferToMemory::TransferToMemory(TransferContext& context, Info info, PackedFields packed, gl::Fence fence,
                                   Arrive arrive)
    : PackedTransfer(context, std::move(info), std::move(packed), std::move(fence)), arrive_(std::move(arrive)) {}

std::optional<VoxelTransfer::Announced> TransferToMemory::announced() const {
  if (!info_.whole) return std::nullopt;
  return Announced{channels(), false, packed_.index_to_world()};
}

void TransferToMemory::copy_rest() {
  bool copies = false;
  for (PackedPiece& piece : packed_.pieces) {
    PackBuffers& buffers = piece.buffers;
    const std::size_t filled = packed_.bricks_of(piece).filled();
    buffers.expected = filled;
    if (filled <= piece.copied) continue;
    const std::size_t each = brick_bytes(packed_.format_of(piece));
    if (buffers.back_bytes < filled * each) {
      buffers.make_values_back(context_.gl, std::min<std::size_t>(filled + filled / 4, piece.count) * each);
      piece.copied = 0;
    }
    const auto from = static_cast<GLintptr>(piece.copied * each);
    context_.gl->CopyNamedBufferSubData(buffers.values.name(), buffers.values_back.name(), from, from,
                                        static_cast<GLsizeiptr>(filled * each) - from);
    copies = true;
  }
  if (copies) fence_ = context_.fence();
  gl::check(*context_.gl, transfer_step);
}

bool TransferToMemory::take(Deadline deadline) {
  constexpr int at_a_time = 256;
  int bricks_since = 0;
  std::array<float, volume::brick_voxels> values{};
  for (; piece_ < packed_.pieces.size(); ++piece_, taken_ = 0) {
    const PackedPiece& piece = packed_.pieces[piece_];
    const VoxelFormat format = packed_.format_of(piece);
    auto& copy = std::get<volume::BrickCopy>(packed_.fields[piece.field].voxels);
    const PackedBricks bricks = packed_.bricks_of(piece);
    if (taken_ == 0) copy.reserve(copy.count() + bricks.all());
    for (; taken_ < bricks.all(); ++taken_) {
      if (bricks_since++ == at_a_time) {
        bricks_since = 0;
        if (std::chrono::steady_clock::now() > deadline) return false;
      }
      if (taken_ >= bricks.filled()) {
        values.fill(0.0F);
      } else {
        unpack(format, piece.buffers.values_back.data() + taken_ * brick_bytes(format), values);
      }
      if (!copy.add(bricks.origin(taken_), values)) finite_ = false;
    }
  }
  return true;
}

VoxelTransfer::Step TransferToMemory::advance(Deadline deadline) {
  if (!fence_.passed()) return Waits{};
  if (!counted_) {
    copy_rest();
    counted_ = true;
    if (!fence_.passed()) return Waits{};
  }
  if (!take(deadline)) return Waits{};
  if (!finite_) {
    for (const volume::FieldCopy& field : packed_.fields) volume::require_finite(field.view(), info_.name);
  }
  arrive_(std::move(packed_.fields));
  return Arrived{};
}

}  // namespace cumulet::render
