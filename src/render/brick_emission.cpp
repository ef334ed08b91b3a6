#include "render/brick_emission.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <utility>

#include "gl/bindings.hpp"
#include "grid/evaluation.hpp"
#include "volume/bricks.hpp"

namespace cumulet::render {

namespace {

using volume::lexicographic;

// Of the brick at this origin; none: the field has none.
std::optional<volume::DeviceBricks::Place> place_of(const volume::DeviceBricksPtr& field, const glm::ivec3& origin) {
  if (!field) return std::nullopt;
  const auto found = std::ranges::lower_bound(field->origins, origin, lexicographic);
  if (found == field->origins.end() || *found != origin) return std::nullopt;
  return field->places[static_cast<std::size_t>(found - field->origins.begin())];
}

}  // namespace

BrickEmission::BrickEmission(gl::FunctionsPtr gl, gl::ProgramsPtr programs, DeviceMemoriesPtr memories,
                             const light::BlackBody& body, const scene::StateInGl& state, scene::Emission settings,
                             const std::optional<std::vector<glm::ivec3>>& changed)
    : gl_(std::move(gl)),
      programs_(std::move(programs)),
      memories_(std::move(memories)),
      body_(body),
      settings_(std::move(settings)),
      index_to_world_(state.index_to_world),
      temperature_(settings_.is_hot() ? state.field(volume::Channel::temperature) : nullptr),
      flame_(settings_.burns() ? state.field(volume::Channel::flame) : nullptr),
      values_wanted_(state.fields.front().bricks->wanted),
      upload_(gl_, "finding what bricks give off") {
  const auto sort = [](std::vector<glm::ivec3>& origins) {
    std::ranges::sort(origins, lexicographic);
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
  };
  if (changed) {
    changed_ = *changed;
    sort(changed_);
    std::ranges::copy_if(changed_, std::back_inserter(origins_), [&](const glm::ivec3& origin) {
      return place_of(temperature_, origin) || place_of(flame_, origin);
    });
  } else {
    for (const volume::DeviceBricksPtr& field : {temperature_, flame_}) {
      if (field) origins_.insert(origins_.end(), field->origins.begin(), field->origins.end());
    }
    sort(origins_);
  }
  for (const glm::ivec3& origin : origins_) bricks_ = glm::max(bricks_, origin / volume::brick_size + 1);
  if (origins_.empty()) return;
  upload_.add([this] {
    // Of whole vectors, as blocks of shaders are.
    struct alignas(16) Block {
      core::CmBrickGlow glow;
    };
    const Block block{scene::shader_glow(settings_, body_)};
    glow_ = gl::make_buffer(gl_, sizeof block, &block, 0, "creating what bricks give off by");
    tree_ = make_brick_tree(gl_, grid::brick_edges(index_to_world_));
  });
  const std::size_t most = std::max<std::size_t>(memories_->most_bytes() / volume::DeviceMemory::bytes_of(1, false), 1);
  for (std::size_t first = 0; first < origins_.size(); first += most) {
    Part& part = parts_.emplace_back();
    part.first = first;
    part.count = std::min(most, origins_.size() - first);
    plan(part);
  }
  upload_.add([this] { fence_ = gl_->dispatches_in_call ? gl::Fence() : gl::Fence(gl_); });
}

void BrickEmission::plan(Part& part) {
  using Memories = std::pair<std::optional<std::uint32_t>, std::optional<std::uint32_t>>;
  std::map<Memories, std::vector<glm::uvec3>> by_memory;
  for (std::uint32_t i = 0; i < part.count; ++i) {
    const glm::ivec3& origin = origins_[part.first + i];
    const auto temperature = place_of(temperature_, origin);
    const auto flame = place_of(flame_, origin);
    Memories memories;
    if (temperature) memories.first = temperature->memory;
    if (flame) memories.second = flame->memory;
    by_memory[memories].emplace_back(i, temperature ? temperature->brick : 0, flame ? flame->brick : 0);
  }
  for (auto& [memories, bricks] : by_memory)
    part.burning.push_back({memories.first, memories.second, std::move(bricks), {}});
  upload_.add([this, &part] { make(part); });
  const std::uint32_t a_step = bricks_a_step(*gl_);
  for (const Burning& burning : part.burning) {
    const auto kind = [](const std::optional<std::uint32_t>& memory, const volume::DeviceBricksPtr& field) {
      return std::string(!memory ? " 0" : field->memories[*memory]->halves ? " 1" : " 2");
    };
    upload_.add_dispatches(
        programs_,
        {"emit_bricks.comp",
         {"CM_TEMPERATURE" + kind(burning.temperature, temperature_), "CM_FLAME" + kind(burning.flame, flame_)}},
        static_cast<std::uint32_t>(burning.bricks.size()), a_step,
        [this, &part, &burning](const gl::Program& program, std::uint32_t first, std::uint32_t end) {
          emit(part, burning, program, first, end);
        });
  }
  upload_.add([this] { gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT); });
  for (std::size_t c = 0; c < 3; ++c) {
    upload_.add_dispatches(programs_, BrickSummaries{}.program(), static_cast<std::uint32_t>(part.count), a_step,
                           [this, &part, c](const gl::Program& program, std::uint32_t first, std::uint32_t end) {
                             const gl::Object* values = memories_->find(*part.kept[c]);
                             const BrickSummaries work{.places = &part.places,
                                                       .bricks = glm::uvec3(bricks_),
                                                       .values = values,
                                                       .kept = values,
                                                       .summaries = &part.summaries[c],
                                                       .tree = &tree_};
                             work.dispatch(*gl_, program, first, end);
                           });
  }
  upload_.add([this, &part] {
    gl::memory_barrier(*gl_, GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    for (std::size_t c = 0; c < 3; ++c)
      gl_->CopyNamedBufferSubData(part.summaries[c].name(), part.back[c].name(), 0, 0,
                                  static_cast<GLsizeiptr>(part.count * sizeof(volume::BrickSummary)));
  });
}

void BrickEmission::make(Part& part) {
  std::vector<std::uint32_t> places{static_cast<std::uint32_t>(part.count), 0};
  for (std::size_t i = 0; i < part.count; ++i) {
    const glm::ivec3 brick = origins_[part.first + i] / volume::brick_size;
    places.push_back(static_cast<std::uint32_t>((brick.z * bricks_.y + brick.y) * bricks_.x + brick.x));
  }
  part.places = gl::make_buffer(gl_, places.size() * 4, places.data(), 0, "creating the places of glowing bricks");
  for (Burning& burning : part.burning)
    burning.list = gl::make_buffer(gl_, burning.bricks.size() * sizeof(glm::uvec3), burning.bricks.data(), 0,
                                   "creating the list of glowing bricks");
  const std::size_t bytes = part.count * sizeof(volume::BrickSummary);
  for (std::size_t c = 0; c < 3; ++c) {
    part.kept[c] = memories_->make(part.count, false);
    part.summaries[c] = gl::make_buffer(gl_, bytes, nullptr, 0, "creating what is known of glowing bricks");
    part.back[c] = gl::ReadBack::unfilled(gl_, bytes, "creating what is known of glowing bricks in memory");
  }
}

void BrickEmission::emit(const Part& part, const Burning& burning, const gl::Program& program, std::uint32_t first,
                         std::uint32_t end) const {
  const auto bind = [&](int place, const gl::Object& buffer) {
    gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, static_cast<GLuint>(place), buffer.name());
  };
  gl_->ProgramUniform2ui(program.name(), 0, first, end);
  bind(core::CM_STORAGE_BRICKS_BURNING, burning.list);
  if (burning.temperature)
    bind(core::CM_STORAGE_BRICKS_TEMPERATURE, *memories_->find(*temperature_->memories[*burning.temperature]));
  if (burning.flame) bind(core::CM_STORAGE_BRICKS_FLAME, *memories_->find(*flame_->memories[*burning.flame]));
  bind(core::CM_STORAGE_BRICKS_GLOW, glow_);
  bind(core::CM_STORAGE_BRICKS_RED, *memories_->find(*part.kept[0]));
  bind(core::CM_STORAGE_BRICKS_GREEN, *memories_->find(*part.kept[1]));
  bind(core::CM_STORAGE_BRICKS_BLUE, *memories_->find(*part.kept[2]));
  program.use(*gl_);
  dispatch_groups(*gl_, end - first);
}

bool BrickEmission::advance(Deadline deadline) { return upload_.advance(deadline) && fence_.passed(); }

scene::EmissionInGl BrickEmission::take(const scene::EmissionInGl* before) {
  std::array<volume::DeviceBricks, 3> made;
  for (Part& part : parts_) {
    for (std::size_t c = 0; c < 3; ++c)
      std::memcpy(part.kept[c]->summaries.data(), part.back[c].data(), part.count * sizeof(volume::BrickSummary));
    for (std::uint32_t i = 0; i < part.count; ++i) {
      // Those that are black in all of them are in none.
      const auto is_black = [&](const auto& kept) { return kept->summaries[i].voxels == 0; };
      if (std::ranges::all_of(part.kept, is_black)) continue;
      for (volume::DeviceBricks& component : made) {
        component.origins.push_back(origins_[part.first + i]);
        component.places.push_back({static_cast<std::uint32_t>(component.memories.size()), i});
      }
    }
    for (std::size_t c = 0; c < 3; ++c) made[c].memories.push_back(part.kept[c]);
  }
  scene::EmissionInGl emission{settings_, {}};
  for (std::size_t c = 0; c < 3; ++c) {
    made[c].wanted = values_wanted_;
    made[c].emptied = changed_;
    if (before != nullptr) {
      made[c] = before->components[c]->with(made[c]);
    } else {
      made[c].tidy();
    }
    emission.components[c] = std::make_shared<const volume::DeviceBricks>(std::move(made[c]));
  }
  return emission;
}

}  // namespace cumulet::render
