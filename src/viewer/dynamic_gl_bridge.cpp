#include "viewer/dynamic_gl_bridge.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>
#include <variant>

#include "base/error.hpp"
#include "base/milliseconds.hpp"
#include "base/one_line.hpp"
#include "viewer/context.hpp"

namespace cumulet::viewer {

namespace {

// Returns the common transform of a state that may stay GPU-resident: density, and other fields with the same lattice.
std::optional<glm::dmat4> lattice_in_gl(const render::GlState& state) {
  bool has_density = false;
  for (const render::GlVoxels& field : state.fields) {
    if (field.index_to_world != state.fields[0].index_to_world) return std::nullopt;
    has_density = has_density || field.channel == volume::Channel::density;
  }
  return has_density || state.changed ? std::optional(state.fields[0].index_to_world) : std::nullopt;
}

std::vector<volume::Channel> channels_of(const scene::StateInGl& state) {
  std::vector<volume::Channel> channels;
  for (const scene::StateInGl::Field& field : state.fields) channels.push_back(field.channel);
  return channels;
}

// Requests of the dynamic volume that apply to any state.
render::VoxelTransfers::StayInGl stay_in_gl(const std::shared_ptr<Live>& live) {
  render::VoxelTransfers::StayInGl stay;
  stay.values_wanted = live->values_wanted();
  stay.wanted = [live] { return live->wanted(); };
  return stay;
}

// For a complete state.
render::VoxelTransfers::StayInGl stay_in_gl(const std::shared_ptr<Live>& live, const std::string& name,
                                            const glm::dmat4& index_to_world) {
  render::VoxelTransfers::StayInGl stay = stay_in_gl(live);
  stay.join = [name, index_to_world](const auto& fields) {
    return scene::StateInGl{.name = name, .fields = fields, .index_to_world = index_to_world, .products = {}};
  };
  stay.arrive = [live](scene::StateInGl state) {
    live->set(std::move(state));
    return true;
  };
  return stay;
}

// Transfer to main memory.
render::VoxelTransfers::Arrive arrive(const std::shared_ptr<Live>& live, const std::string& name, bool boxes) {
  if (!boxes) return [live, name](std::vector<volume::FieldCopy> copies) { live->set(std::move(copies), name); };
  return [live, name](std::vector<volume::FieldCopy> copies) {
    volume::Changes changes;
    for (volume::FieldCopy& copy : copies)
      changes.fields.push_back({copy.channel, std::get<volume::BrickCopy>(std::move(copy.voxels))});
    live->update(std::move(changes), name);
  };
}

// For changed boxes, applied to the state that is the newest when they arrive. gather: called before that state is
// read.
render::VoxelTransfers::StayInGl stay_in_gl(const std::shared_ptr<Live>& live, const std::string& name,
                                            const std::function<void()>& gather) {
  const auto below = std::make_shared<std::uint64_t>(0);
  render::VoxelTransfers::StayInGl stay = stay_in_gl(live);
  stay.join = [live, name, below, gather](const auto& fields) -> std::optional<scene::StateInGl> {
    gather();
    const Live::InGl now = live->in_gl();
    if (!now.state) return std::nullopt;
    *below = now.number;
    return live->with(*now.state, fields, name);
  };
  stay.instead = arrive(live, name, true);
  stay.arrive = [live, below](scene::StateInGl state) { return live->set_if_newest(*below, std::move(state)); };
  return stay;
}

}  // namespace

std::vector<volume::Channel> DynamicGlBridge::check(const render::GlState& state) {
  std::vector<volume::MemoryField> fields;
  std::vector<volume::Channel> channels;
  for (const render::GlVoxels& field : state.fields) {
    fields.push_back({field.channel, volume::SparseVoxels{.brick_origins = {},
                                                          .brick_values = {},
                                                          .brick_active = {},
                                                          .tiles = {},
                                                          .index_to_world = field.index_to_world}});
    channels.push_back(field.channel);
  }
  if (state.changed) {
    volume::check_update(fields, state.name);
  } else {
    volume::check_fields(fields, state.name);
  }
  return channels;
}

std::optional<glm::dmat4> DynamicGlBridge::transform_in_gl(Context& g, const std::shared_ptr<Live>& live,
                                                           const render::GlState& state) {
  const std::optional<glm::dmat4> lattice = lattice_in_gl(state);
  if (!lattice) return std::nullopt;
  if (!state.changed) return live->gpu_resident() ? lattice : std::nullopt;
  // Changed boxes go to where the rest of the state is.
  const auto announced = g.transfers().announced(live.get());
  const scene::StateInGlPtr rest = live->in_gl().state;
  if (announced ? !announced->gpu_resident : !rest) return std::nullopt;
  if (!announced && !g.has(*rest))
    throw Error(ErrorCode::invalid_argument,
                one_line(state.name + ": other fields of it belong to another viewer's context"));
  if (live->gpu_resident()) return announced ? announced->index_to_world : rest->index_to_world;
  bring_back(g, live, announced ? announced->channels : channels_of(*rest));
  return std::nullopt;
}

void DynamicGlBridge::submit(Context& g, const std::shared_ptr<Live>& live, const render::GlState& state,
                             const std::vector<volume::Channel>& channels) {
  if (state.changed) {
    const auto announced = g.transfers().announced(live.get());
    live->require_updatable(channels, announced ? std::optional(announced->channels) : std::nullopt, state.name);
  }
  render::GlState transformed = state;
  render::VoxelTransfers::Arrival arrival = arrive(live, state.name, state.changed.has_value());
  if (const std::optional<glm::dmat4> transform = transform_in_gl(g, live, state)) {
    for (render::GlVoxels& field : transformed.fields) field.index_to_world = *transform;
    arrival = state.changed ? stay_in_gl(live, state.name, [&g, live] { gather(g, *live); })
                            : stay_in_gl(live, state.name, *transform);
    track(live);
  }
  g.transfers().begin(transformed, live.get(), std::move(arrival), [live] { live->refuse_updates(); });
}

void DynamicGlBridge::track(const std::shared_ptr<Live>& live) {
  if (live->values_wanted() == nullptr) return;
  const auto is_it = [&](const InGl& in_gl) { return in_gl.live.lock() == live; };
  const std::scoped_lock lock(mutex_);
  if (std::ranges::any_of(tracked_, is_it) || std::ranges::any_of(added_, is_it)) return;
  added_.push_back({.live = live,
                    .listeners = {live->values_wanted()->listen(notify_), live->listen_to_requests(notify_)},
                    .brought = {},
                    .made = {},
                    .made_by = {}});
}

void DynamicGlBridge::clear() {
  const std::scoped_lock lock(mutex_);
  added_.clear();
  tracked_.clear();
}

bool DynamicGlBridge::empty() const {
  const std::scoped_lock lock(mutex_);
  return tracked_.empty() && added_.empty();
}

void DynamicGlBridge::bring_back(Context& g, const std::shared_ptr<Live>& live,
                                 const std::vector<volume::Channel>& channels) {
  const auto found = std::make_shared<Live::InGl>();
  g.transfers().bring_back(
      live.get(), channels,
      [live, found] {
        *found = live->in_gl();
        return found->state;
      },
      [live, found](std::vector<volume::FieldCopy> copies) {
        live->set_if_newest(found->number, std::move(copies), found->state->name);
      },
      [live] { live->refuse_updates(); });
}

void DynamicGlBridge::make_products(Context& g, const std::shared_ptr<Live>& live) {
  const auto found = std::make_shared<Live::InGl>();
  render::VoxelTransfers::StayInGl stay = stay_in_gl(live);
  stay.join = [live, found](const auto& /*none*/) {
    *found = live->in_gl();
    return found->state ? std::optional(*found->state) : std::nullopt;
  };
  stay.arrive = [live, found](scene::StateInGl state) { return live->set_if_newest(found->number, std::move(state)); };
  g.transfers().make_products(live.get(), "state", std::move(stay));
}

void DynamicGlBridge::gather(Context& g, Live& live) {
  const scene::StateInGlPtr state = live.in_gl().state;
  if (!state || !g.has(*state)) return;
  scene::StateInGl made = *state;
  bool moved = false;
  for (volume::DeviceBricksPtr* bricks : made.all()) {
    if (!(*bricks)->scattered()) continue;
    try {
      auto gathered = g.memories().gather(g.functions(), **bricks);
      if (!gathered) continue;
      *bricks = std::move(gathered);
      moved = true;
    } catch (const Error& error) {
      // The scattered bricks remain usable.
      if (error.code() == ErrorCode::context_lost) throw;
      gl::clear_errors(*g.functions());
    }
  }
  if (moved) live.move_in_gl(state, std::make_shared<const scene::StateInGl>(std::move(made)));
}

bool DynamicGlBridge::InGl::needs_values(Context& g, const scene::StateInGlPtr& state) const {
  const std::shared_ptr<Live> of = live.lock();
  if (!of || of->gpu_resident() || brought.lock() == state) return false;
  const auto announced = g.transfers().announced(of.get());
  return !announced || announced->gpu_resident;
}

bool DynamicGlBridge::InGl::needs_products(const scene::StateInGlPtr& state) const {
  const std::shared_ptr<Live> of = live.lock();
  if (!of || !of->gpu_resident()) return false;
  const std::vector<scene::Emission> wanted = of->wanted();
  return !state->has_wanted(wanted) && (made.lock() != state || made_by != wanted);
}

bool DynamicGlBridge::is_due(Context& g) const {
  return std::ranges::any_of(tracked_, [&](const InGl& in_gl) {
    const std::shared_ptr<Live> live = in_gl.live.lock();
    const scene::StateInGlPtr state = live ? live->in_gl().state : nullptr;
    return state && g.has(*state) && (in_gl.needs_values(g, state) || in_gl.needs_products(state));
  });
}

void DynamicGlBridge::update(Context& g) {
  {
    const std::scoped_lock lock(mutex_);
    std::ranges::move(added_, std::back_inserter(tracked_));
    added_.clear();
    std::erase_if(tracked_, [](const InGl& in_gl) { return in_gl.live.expired(); });
  }
  for (InGl& in_gl : tracked_) {
    const std::shared_ptr<Live> live = in_gl.live.lock();
    const scene::StateInGlPtr state = live ? live->in_gl().state : nullptr;
    if (!state) continue;
    if (state->gone()) live->move_in_gl(state, nullptr);
    if (!g.has(*state)) continue;
    if (in_gl.needs_values(g, state)) {
      in_gl.brought = state;
      bring_back(g, live, channels_of(*state));
    }
    if (in_gl.needs_products(state)) {
      in_gl.made = state;
      in_gl.made_by = live->wanted();
      make_products(g, live);
    }
  }
}

void DynamicGlBridge::follow_transfers(Context& g, double budget_ms) {
  // Transfers share the frame's budget with other work.
  constexpr double part = 0.5;
  constexpr double min_ms = 2.0;
  g.transfers().follow(deadline_after(std::max(part * budget_ms, min_ms)));
}

}  // namespace cumulet::viewer
