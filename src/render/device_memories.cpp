#include "render/device_memories.hpp"

#include <algorithm>
#include <numeric>
#include <string>

#include "gl/bindings.hpp"
#include "grid/cell.hpp"
#include "grid/statistics.hpp"
#include "volume/brick_values.hpp"

namespace cumulet::render {

DeviceMemories::~DeviceMemories() {
  for (const Kept& kept : kept_) {
    if (const volume::DeviceMemoryPtr memory = kept.held.lock()) memory->gone = true;
  }
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

volume::DeviceBricksPtr DeviceMemories::gather(const gl::FunctionsPtr& gl, gl::Programs& programs,
                                               const volume::DeviceBricks& bricks) {
  const bool halves = bricks.are_halves();
  const std::uint64_t bytes = volume::DeviceMemory::bytes_of(bricks.origins.size(), halves);
  if (bytes > most_bytes_) return nullptr;
  for (const bool from : {false, true}) {
    if (!programs.ask(BrickCopies{.from_halves = from, .to_halves = halves}.program()).usable()) return nullptr;
  }
  const std::shared_ptr<volume::DeviceMemory> memory = make(std::max<std::size_t>(bricks.origins.size(), 1), halves);
  auto made = std::make_shared<volume::DeviceBricks>(bricks);
  std::vector<std::uint32_t> order(bricks.places.size());
  std::iota(order.begin(), order.end(), 0U);
  for (const std::uint32_t i : order) {
    made->places[i] = {0, i};
    memory->summaries[i] = bricks.summary(i);
  }
  gl::memory_barrier(*gl, GL_SHADER_STORAGE_BARRIER_BIT);
  const std::vector<std::vector<MovedBrick>> moves = moves_of(bricks, order);
  for (std::size_t m = 0; m < moves.size(); ++m) {
    if (moves[m].empty()) continue;
    const gl::Object moved = gl::make_buffer(gl, moves[m].size() * sizeof(MovedBrick), moves[m].data(), 0,
                                             "creating the list of a volume's bricks");
    const volume::DeviceMemory& from = *bricks.memories[m];
    const BrickCopies copies{find(from), from.halves, find(*memory), memory->halves, 0, &moved};
    copies.dispatch(*gl, programs.ask(copies.program()), 0, static_cast<std::uint32_t>(moves[m].size()));
  }
  gl::memory_barrier(*gl, GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  kept_.back().written = gl::Fence(gl_);
  made->memories = {memory};
  return made;
}

std::vector<std::vector<MovedBrick>> moves_of(const volume::DeviceBricks& bricks,
                                              std::span<const std::uint32_t> order) {
  std::vector<std::vector<MovedBrick>> moves(bricks.memories.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    const volume::DeviceBricks::Place& place = bricks.places[order[i]];
    moves[place.memory].emplace_back(place.brick, i);
  }
  return moves;
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

gl::Object make_brick_tree(const gl::FunctionsPtr& gl, const std::array<float, CM_BRICK_EDGES>& edges_squared) {
  struct Words {
    std::array<std::uint32_t, 1024> cells{};
    std::array<float, 56> edges{};
  };
  Words words;
  const grid::BrickTree& tree = grid::brick_tree(grid::kuhn_frame(glm::ivec3(0), 8, 0));
  const auto centroid = [](const glm::vec3& at) {
    const glm::uvec3 quarters(4.0F * at);
    return quarters.x | (quarters.y << 6U) | (quarters.z << 12U);
  };
  for (std::size_t i = 1; i < 512; ++i) {
    const std::uint32_t shape = tree.shape[i];
    words.cells[i] = centroid(tree.node_centroid[i]) | ((shape & 0x1ffU) << 18U) |
                     (core::cm_shape_class(shape) << 27U) | (core::cm_shape_exponent(shape) << 29U);
  }
  for (std::size_t i = 0; i < 512; ++i)
    words.cells[512 + i] = centroid({tree.centroid[0][i], tree.centroid[1][i], tree.centroid[2][i]});
  std::ranges::copy(edges_squared, words.edges.begin());
  return gl::make_buffer(gl, sizeof words, &words, 0, "creating the tree of a brick's cells");
}

gl::ProgramKey BrickCopies::program() const {
  return {"copy_bricks.comp",
          {std::string("CM_FROM_HALVES ") + (from_halves ? "1" : "0"),
           std::string("CM_TO_HALVES ") + (to_halves ? "1" : "0")}};
}

void BrickCopies::dispatch(const gl::Functions& gl, const gl::Program& program, std::uint32_t first,
                           std::uint32_t end) const {
  gl.ProgramUniform2ui(program.name(), 0, first, end);
  gl.ProgramUniform1ui(program.name(), 1, to_first);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_BRICKS_FROM, from->name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_BRICKS_TO, to->name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_BRICKS_MOVED, moved->name());
  program.use(gl);
  dispatch_groups(gl, end - first);
}

void dispatch_groups(const gl::Functions& gl, std::uint32_t groups) {
  constexpr std::uint32_t most = 65535;
  const std::uint32_t across = std::min(groups, most);
  gl.DispatchCompute(across, (groups + across - 1) / across, 1);
}

}  // namespace cumulet::render
