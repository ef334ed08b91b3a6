#include "render/dynamic/brick_products.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <string>
#include <utility>

#include "gl/bindings.hpp"
#include "grid/evaluation.hpp"
#include "shader_macros.hpp"
#include "volume/bricks.hpp"

namespace cumulet::render {

namespace {

gl::ProgramKey program_of(const scene::Product& product) {
  struct Number {
    int operator()(const scene::Emission& /*unused*/) const { return 0; }
    int operator()(const scene::Scattering& /*unused*/) const { return 1; }
    int operator()(const scene::Forward& forward) const { return forward.colored ? 3 : 2; }
    int operator()(const scene::Momentum& /*unused*/) const { return 4; }
  };
  return {"brick_products.comp", {gl::macros::product(std::visit(Number(), product))}};
}

}  // namespace

BrickProducts::BrickProducts(gl::FunctionsPtr gl, gl::ProgramsPtr programs, DeviceMemoriesPtr memories,
                             const light::BlackBody& body, const scene::StateInGl& state, scene::Product product,
                             const std::optional<std::vector<glm::ivec3>>& changed)
    : gl_(std::move(gl)),
      programs_(std::move(programs)),
      memories_(std::move(memories)),
      product_(std::move(product)),
      values_wanted_(state.fields.front().bricks->wanted),
      moves_(gl_, programs_, memories_),
      upload_(gl_, "computing derived brick data") {
  const auto* light = std::get_if<scene::Emission>(&product_);
  if (light != nullptr) {
    fields_ = {light->is_hot() ? state.field(volume::Channel::temperature) : nullptr,
               light->burns() ? state.field(volume::Channel::flame) : nullptr};
  } else {
    for (const volume::Channel channel : scene::fields_of(product_)) fields_.push_back(state.field(channel));
  }
  find_origins(changed);
  if (origins_.empty()) return;
  prepare(body, state.index_to_world);
  const std::size_t most = std::max<std::size_t>(memories_->max_bytes() / volume::DeviceMemory::bytes_of(1, false), 1);
  for (std::size_t first = 0; first < origins_.size(); first += most) {
    Part& part = parts_.emplace_back();
    part.first = first;
    part.count = std::min(most, origins_.size() - first);
    plan(part);
  }
  upload_.add([this] {
    moves_.drop();
    fence_ = gl_->dispatches_in_call ? gl::Fence() : gl::Fence(gl_);
  });
}

std::size_t BrickProducts::components() const { return std::holds_alternative<scene::Forward>(product_) ? 1 : 3; }

void BrickProducts::find_origins(const std::optional<std::vector<glm::ivec3>>& changed) {
  const auto sort = [](std::vector<glm::ivec3>& origins) {
    std::ranges::sort(origins, volume::lexicographic);
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
  };
  // Emission is computed where any of its fields has a brick, the other products where density has one.
  std::vector<volume::DeviceBricksPtr> where = fields_;
  if (!std::holds_alternative<scene::Emission>(product_)) where.resize(1);
  std::erase(where, nullptr);
  if (changed) {
    changed_ = *changed;
    sort(changed_);
    std::ranges::copy_if(changed_, std::back_inserter(origins_), [&](const glm::ivec3& origin) {
      return std::ranges::any_of(where, [&](const auto& field) { return field->find(origin).has_value(); });
    });
  } else {
    for (const volume::DeviceBricksPtr& field : where)
      origins_.insert(origins_.end(), field->origins.begin(), field->origins.end());
    sort(origins_);
  }
  for (const glm::ivec3& origin : origins_) bricks_ = glm::max(bricks_, origin / volume::brick_size + 1);
}

void BrickProducts::prepare(const light::BlackBody& body, const glm::dmat4& index_to_world) {
  if (const auto* momentum = std::get_if<scene::Momentum>(&product_)) {
    const volume::Velocity velocity{{}, volume::Velocity::to_index_of(index_to_world)};
    to_relative_ = glm::mat3(velocity.to_index / double{momentum->fastest});
    most_ = velocity.most();
  }
  upload_.add([this, &body, index_to_world] {
    if (const auto* light = std::get_if<scene::Emission>(&product_)) {
      // Padded to a multiple of 16 bytes, as uniform blocks are.
      struct alignas(16) Block {
        core::CmBrickEmissive emissive;
      };
      const Block block{scene::shader_emissive(*light, body)};
      emissive_ = gl::make_buffer(gl_, sizeof block, &block, 0, "creating the emission data of bricks");
    }
    tree_ = make_brick_tree(gl_, grid::brick_edges(index_to_world));
  });
}

void BrickProducts::plan(Part& part) {
  upload_.add([this, &part] { make(part); });
  const std::uint32_t a_step = bricks_per_step(*gl_);
  moves_.plan_together(
      upload_, fields_, std::span(origins_).subspan(part.first, part.count), [&](std::size_t to, std::uint32_t count) {
        upload_.add_dispatches(programs_, program_of(product_), count, a_step,
                               [this, &part, to](const gl::Program& program, std::uint32_t first, std::uint32_t end) {
                                 multiply(part, to, program, first, end);
                               });
      });
  for (std::size_t c = 0; c < components(); ++c) {
    upload_.add_dispatches(programs_, BrickSummaries{}.program(), static_cast<std::uint32_t>(part.count), a_step,
                           [this, &part, c](const gl::Program& program, std::uint32_t first, std::uint32_t end) {
                             const gl::Object* values = memories_->find(*part.kept[c]);
                             const BrickSummaries work{.packed_bricks = &part.packed_bricks,
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
    for (std::size_t c = 0; c < components(); ++c)
      gl_->CopyNamedBufferSubData(part.summaries[c].name(), part.back[c].name(), 0, 0,
                                  static_cast<GLsizeiptr>(part.count * sizeof(volume::BrickSummary)));
  });
}

void BrickProducts::make(Part& part) {
  std::vector<std::uint32_t> packed_bricks{static_cast<std::uint32_t>(part.count), 0};
  for (std::size_t i = 0; i < part.count; ++i) {
    const glm::ivec3 brick = origins_[part.first + i] / volume::brick_size;
    packed_bricks.push_back(static_cast<std::uint32_t>((brick.z * bricks_.y + brick.y) * bricks_.x + brick.x));
  }
  part.packed_bricks =
      gl::make_buffer(gl_, packed_bricks.size() * 4, packed_bricks.data(), 0, "creating the brick index");
  const std::size_t bytes = part.count * sizeof(volume::BrickSummary);
  for (std::size_t c = 0; c < components(); ++c) {
    part.kept.push_back(memories_->make(part.count, false));
    part.summaries.push_back(gl::make_buffer(gl_, bytes, nullptr, 0, "creating the brick statistics"));
    part.back.push_back(gl::ReadBack::unfilled(gl_, bytes, "creating the read-back of brick statistics"));
  }
}

void BrickProducts::multiply(const Part& part, std::size_t to, const gl::Program& program, std::uint32_t first,
                             std::uint32_t end) const {
  const auto bind = [&](int binding, const gl::Object& buffer) {
    gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, static_cast<GLuint>(binding), buffer.name());
  };
  const GLuint name = program.name();
  gl_->ProgramUniform2ui(name, 0, first, end);
  gl_->ProgramUniform1ui(name, 1, static_cast<GLuint>(to));
  if (std::holds_alternative<scene::Momentum>(product_)) {
    for (int i = 0; i < 3; ++i)
      gl_->ProgramUniform3f(name, 2 + i, to_relative_[i].x, to_relative_[i].y, to_relative_[i].z);
    gl_->ProgramUniform1f(name, 5, most_);
  }
  bind(core::CM_STORAGE_BRICKS_TOGETHER, moves_.together());
  if (emissive_) bind(core::CM_STORAGE_BRICKS_EMISSIVE, emissive_);
  constexpr std::array<int, 3> bindings{core::CM_STORAGE_BRICKS_FIRST, core::CM_STORAGE_BRICKS_SECOND,
                                        core::CM_STORAGE_BRICKS_THIRD};
  for (std::size_t c = 0; c < components(); ++c) bind(bindings[c], *memories_->find(*part.kept[c]));
  program.use(*gl_);
  dispatch_groups(*gl_, end - first);
}

bool BrickProducts::advance(Deadline deadline) { return upload_.advance(deadline) && fence_.passed(); }

scene::ProductInGl BrickProducts::take(const scene::ProductInGl* before) {
  std::vector<volume::DeviceBricks> made(components());
  for (Part& part : parts_) {
    for (std::size_t c = 0; c < components(); ++c)
      std::memcpy(part.kept[c]->summaries.data(), part.back[c].data(), part.count * sizeof(volume::BrickSummary));
    for (std::uint32_t i = 0; i < part.count; ++i) {
      // Bricks that are 0 in all components are left out.
      const auto is_zero = [&](const auto& kept) { return kept->summaries[i].voxels == 0; };
      if (std::ranges::all_of(part.kept, is_zero)) continue;
      for (volume::DeviceBricks& component : made) {
        component.origins.push_back(origins_[part.first + i]);
        component.locations.push_back({static_cast<std::uint32_t>(component.memories.size()), i});
      }
    }
    for (std::size_t c = 0; c < components(); ++c) made[c].memories.push_back(part.kept[c]);
  }
  scene::ProductInGl product{product_, {}};
  for (std::size_t c = 0; c < components(); ++c) {
    made[c].wanted = values_wanted_;
    made[c].emptied = changed_;
    if (before != nullptr) {
      made[c] = before->components[c]->with(made[c]);
    } else {
      made[c].tidy();
    }
    product.components.push_back(std::make_shared<const volume::DeviceBricks>(std::move(made[c])));
  }
  return product;
}

}  // namespace cumulet::render
