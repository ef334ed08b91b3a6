#include "render/dynamic/transfer_in_gl.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <string>
#include <utility>

#include "base/error.hpp"
#include "base/one_line.hpp"
#include "grid/evaluation.hpp"
#include "render/dynamic/transfer_back.hpp"
#include "render/dynamic/voxel_formats.hpp"

namespace cumulet::render {

namespace {

// Cells are refined only by density.
BrickSummaries::Field field_of(volume::Channel channel) {
  using Field = BrickSummaries::Field;
  if (channel == volume::Channel::density) return Field::cells;
  return channel >= volume::Channel::anisotropy ? Field::as_is : Field::not_negative;
}

void require_finite(const volume::DeviceBricks& bricks, volume::Channel channel, const std::string& name) {
  std::size_t bad = 0;
  while (bad < bricks.origins.size() && (bricks.summary(bad).voxels & CM_BRICK_NOT_FINITE) == 0) ++bad;
  if (bad == bricks.origins.size()) return;
  const glm::ivec3 origin = bricks.origins[bad];
  throw Error(ErrorCode::file, one_line(name + ": " + name_of(channel) + ": non-finite value in the 8x8x8 brick at (" +
                                        std::to_string(origin.x) + ", " + std::to_string(origin.y) + ", " +
                                        std::to_string(origin.z) + ")"));
}

BrickSummaries summaries_of_field(const PackedFields& packed, const PackedPiece& piece) {
  const HostVoxels& source = packed.sources[piece.field];
  return {.format = source.format,
          .field = field_of(packed.fields[piece.field].channel),
          .packed_bricks = &piece.buffers.packed_bricks,
          .bricks = glm::uvec3(bricks_of(source.size)),
          .values = &piece.buffers.values,
          .kept = nullptr,
          .summaries = &piece.buffers.summaries,
          .tree = nullptr};
}

}  // namespace

void TransferInGl::ask_for_programs(const TransferContext& context, const PackedFields& packed) {
  for (const PackedPiece& piece : packed.pieces) context.programs->ask(summaries_of_field(packed, piece).program());
}

TransferInGl::TransferInGl(TransferContext& context, Info info, PackedFields packed, gl::Fence fence, StayInGl stay)
    : PackedTransfer(context, std::move(info), std::move(packed), std::move(fence)), stay_(std::move(stay)) {}

std::optional<VoxelTransfer::Announced> TransferInGl::announced() const {
  if (!info_.whole) return std::nullopt;
  return Announced{channels(), true, packed_.index_to_world()};
}

void TransferInGl::begin_summaries() {
  brick_tree_ = make_brick_tree(context_.gl, grid::brick_edges(packed_.index_to_world()));
  kept_.resize(packed_.pieces.size());
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    PackedPiece& piece = packed_.pieces[i];
    PackBuffers& buffers = piece.buffers;
    const std::uint32_t filled = packed_.bricks_of(piece).filled();
    kept_[i].filled = filled;
    if (filled == 0) continue;
    if (buffers.summed < filled) {
      const std::size_t with_more = std::min<std::size_t>(filled + filled / 4, piece.count);
      const std::size_t bytes = with_more * sizeof(volume::BrickSummary);
      buffers.summaries =
          gl::make_buffer(context_.gl, bytes, nullptr, 0, "creating the statistics of the host's bricks");
      buffers.summaries_back =
          gl::ReadBack::unfilled(context_.gl, bytes, "creating the read-back of the statistics of the host's bricks");
      buffers.summed = with_more;
    }
    kept_[i].memory = context_.memories->make(filled, packed_.format_of(piece) == VoxelFormat::halves);
  }
}

BrickSummaries TransferInGl::summaries_of(std::size_t piece) const {
  BrickSummaries summaries = summaries_of_field(packed_, packed_.pieces[piece]);
  if (kept_[piece].memory) summaries.kept = context_.memories->find(*kept_[piece].memory);
  summaries.tree = &brick_tree_;
  return summaries;
}

bool TransferInGl::summarize(Deadline deadline) {
  const auto& gl = *context_.gl;
  gl::Programs& programs = *context_.programs;
  for (const PackedPiece& piece : packed_.pieces) {
    if (!programs.ask(summaries_of_field(packed_, piece).program()).usable()) return false;
  }
  if (!brick_tree_) begin_summaries();
  const std::uint32_t a_step = bricks_per_step(gl);
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    Kept& kept = kept_[i];
    const BrickSummaries work = summaries_of(i);
    while (kept.summarized < kept.filled) {
      const std::uint32_t left = kept.filled - kept.summarized;
      const std::uint32_t end = kept.summarized + std::min(left, a_step);
      work.dispatch(gl, programs.ask(work.program()), kept.summarized, end);
      kept.summarized = end;
      if (std::chrono::steady_clock::now() > deadline) return false;
    }
  }
  gl::memory_barrier(gl, GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    const PackBuffers& buffers = packed_.pieces[i].buffers;
    const std::size_t bytes = kept_[i].filled * sizeof(volume::BrickSummary);
    if (bytes > 0)
      gl.CopyNamedBufferSubData(buffers.summaries.name(), buffers.summaries_back.name(), 0, 0,
                                static_cast<GLsizeiptr>(bytes));
  }
  brick_tree_ = {};
  fence_ = context_.fence();
  gl::check(gl, transfer_step);
  return true;
}

StateProducts::Fields TransferInGl::take_fields() const {
  std::vector<volume::DeviceBricks> made(packed_.fields.size());
  for (std::size_t p = 0; p < packed_.pieces.size(); ++p) {
    const PackedPiece& piece = packed_.pieces[p];
    const Kept& kept = kept_[p];
    volume::DeviceBricks& field = made[piece.field];
    const PackedBricks bricks = packed_.bricks_of(piece);
    if (kept.memory) {
      std::memcpy(kept.memory->summaries.data(), piece.buffers.summaries_back.data(),
                  kept.filled * sizeof(volume::BrickSummary));
      field.memories.push_back(kept.memory);
    }
    for (std::uint32_t i = 0; i < bricks.filled(); ++i) {
      field.origins.push_back(bricks.origin(i));
      field.locations.push_back({static_cast<std::uint32_t>(field.memories.size() - 1), i});
    }
    for (std::size_t i = bricks.filled(); i < bricks.all(); ++i) field.emptied.push_back(bricks.origin(i));
  }
  StateProducts::Fields fields;
  for (std::size_t i = 0; i < made.size(); ++i) {
    const volume::Channel channel = packed_.fields[i].channel;
    require_finite(made[i], channel, info_.name);
    made[i].drop_empty();
    if (info_.whole) made[i].tidy();
    made[i].wanted = stay_.values_wanted;
    fields.push_back({channel, std::make_shared<const volume::DeviceBricks>(std::move(made[i]))});
  }
  return fields;
}

VoxelTransferPtr TransferInGl::join() {
  products_.reset();
  std::optional<scene::StateInGl> state = stay_.join(fields_);
  if (state) {
    if (!context_.has(*state)) {
      throw Error(ErrorCode::invalid_argument,
                  one_line(info_.name + ": other fields of it belong to another viewer's context"));
    }
    products_.emplace(context_, stay_, std::move(*state), fields_);
    return nullptr;
  }
  if (!stay_.instead) return nullptr;
  // The state that it updates is in main memory.
  auto update = std::make_shared<scene::StateInGl>();
  update->name = info_.name;
  update->fields = std::move(fields_);
  update->index_to_world = packed_.index_to_world();
  return std::make_unique<TransferBack>(
      context_, info_, channels(), [update] { return update; }, stay_.instead);
}

VoxelTransfer::Step TransferInGl::advance(Deadline deadline) {
  if (stage_ == Stage::summaries) {
    if (!fence_.passed() || !summarize(deadline)) return Waits{};
    stage_ = Stage::read_back;
  }
  if (stage_ == Stage::read_back) {
    if (!fence_.passed()) return Waits{};
    fields_ = take_fields();
    stage_ = Stage::products;
    if (VoxelTransferPtr back = join()) return back;
  }
  while (products_) {
    if (!products_->advance(deadline)) return Waits{};
    if (products_->failure()) failure_ = products_->failure();
    if (failure_ && stay_.values_wanted) stay_.values_wanted->ask();
    if (stay_.arrive(products_->take())) break;
    // The state that it updates has changed in the meantime.
    if (VoxelTransferPtr back = join()) return back;
  }
  return Arrived{failure_};
}

}  // namespace cumulet::render
