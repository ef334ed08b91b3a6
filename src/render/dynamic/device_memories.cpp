#include "render/dynamic/device_memories.hpp"

#include <algorithm>

#include "render/dynamic/brick_kernels.hpp"

namespace cumulet::render {

DeviceMemories::~DeviceMemories() {
  for (const Kept& kept : kept_) {
    if (const volume::DeviceMemoryPtr memory = kept.held.lock()) memory->gone = true;
  }
  if (!gl_->abandoned && !programs_->is_current()) abandon();
}

std::shared_ptr<volume::DeviceMemory> DeviceMemories::make(std::size_t bricks, bool halves) {
  auto memory = std::make_shared<volume::DeviceMemory>(bricks, halves);
  Kept made{memory,
            memory.get(),
            gl::make_buffer(gl_, memory->bytes(), nullptr, 0, "creating a host's bricks"),
            memory->bytes(),
            {}};
  const std::scoped_lock lock(mutex_);
  kept_.push_back(std::move(made));
  return memory;
}

const DeviceMemories::Kept* DeviceMemories::kept(const volume::DeviceMemory& memory) const {
  const auto found = std::ranges::find(kept_, &memory, &Kept::address);
  return found == kept_.end() ? nullptr : &*found;
}

const gl::Object* DeviceMemories::find(const volume::DeviceMemory& memory) const {
  const Kept* found = kept(memory);
  if (found == nullptr) return nullptr;
  found->written.order();
  return &found->buffer;
}

bool DeviceMemories::has(const volume::DeviceBricks& bricks) const {
  return std::ranges::all_of(bricks.memories, [&](const auto& memory) { return kept(*memory) != nullptr; });
}

volume::DeviceBricksPtr DeviceMemories::gather(const gl::FunctionsPtr& gl, const volume::DeviceBricks& bricks) {
  const bool halves = bricks.are_halves();
  const std::uint64_t bytes = volume::DeviceMemory::bytes_of(bricks.origins.size(), halves);
  if (bytes > max_bytes_) return nullptr;
  for (const bool from : {false, true}) {
    if (!programs_->ask(BrickCopies{.from_halves = from, .to_halves = halves}.program()).usable()) return nullptr;
  }
  const std::shared_ptr<volume::DeviceMemory> memory = make(std::max<std::size_t>(bricks.origins.size(), 1), halves);
  auto made = std::make_shared<volume::DeviceBricks>(bricks);
  std::vector<MovedBrick> moved;
  for (std::uint32_t i = 0; i < bricks.locations.size(); ++i) {
    moved.emplace_back(i, i);
    made->locations[i] = {0, i};
    memory->summaries[i] = bricks.summary(i);
  }
  gl::memory_barrier(*gl, GL_SHADER_STORAGE_BARRIER_BIT);
  const std::vector<std::vector<MovedBrick>> moves = moves_of(bricks, moved);
  for (std::size_t m = 0; m < moves.size(); ++m) {
    if (moves[m].empty()) continue;
    const gl::Object list = gl::make_buffer(gl, moves[m].size() * sizeof(MovedBrick), moves[m].data(), 0,
                                            "creating the brick list of a volume");
    const volume::DeviceMemory& from = *bricks.memories[m];
    const BrickCopies copies{find(from), from.halves, find(*memory), memory->halves, 0, &list};
    copies.dispatch(*gl, programs_->ask(copies.program()), 0, static_cast<std::uint32_t>(moves[m].size()));
  }
  gl::memory_barrier(*gl, GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  kept_.back().written = gl::Fence(gl_);
  made->memories = {memory};
  return made;
}

void DeviceMemories::collect() {
  const std::scoped_lock lock(mutex_);
  std::erase_if(kept_, [](const Kept& kept) { return kept.held.expired(); });
}

std::uint64_t DeviceMemories::bytes() const {
  const std::scoped_lock lock(mutex_);
  std::uint64_t sum = 0;
  for (const Kept& kept : kept_) sum += kept.bytes;
  return sum;
}

}  // namespace cumulet::render
