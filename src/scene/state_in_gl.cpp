#include "scene/state_in_gl.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "volume/bricks.hpp"

namespace cumulet::scene {

namespace {

using volume::Channel;

constexpr std::array<Channel, 3> colors{Channel::red, Channel::green, Channel::blue};
constexpr std::array<Channel, 3> velocities{Channel::velocity_x, Channel::velocity_y, Channel::velocity_z};

struct FieldsOf {
  std::vector<Channel> operator()(const Emission& settings) const {
    std::vector<Channel> fields;
    if (settings.is_hot()) fields.push_back(Channel::temperature);
    if (settings.burns()) fields.push_back(Channel::flame);
    return fields;
  }
  std::vector<Channel> operator()(const Scattering& /*unused*/) const { return with(colors); }
  std::vector<Channel> operator()(const Forward& forward) const {
    std::vector<Channel> fields = forward.colored ? with(colors) : std::vector{Channel::density};
    fields.push_back(Channel::anisotropy);
    return fields;
  }
  std::vector<Channel> operator()(const Momentum& /*unused*/) const { return with(velocities); }
  static std::vector<Channel> with(const std::array<Channel, 3>& three) {
    return {Channel::density, three[0], three[1], three[2]};
  }
};

bool any(const volume::DeviceBricksPtr& bricks) { return bricks && !bricks->origins.empty(); }

// Powers of two, so that similar velocities are encoded in the same unit.
float unit_above(double fastest) {
  constexpr double least = 1e-9;
  const double power = std::exp2(std::ceil(std::log2(std::max(fastest, least))));
  return static_cast<float>(std::min(power, volume::fastest_velocity));
}

std::vector<volume::ScalarVolume> volumes_of(const ProductInGl& product, const std::string& name,
                                             const glm::dmat4& index_to_world) {
  std::vector<volume::ScalarVolume> made;
  const std::vector<glm::ivec3>& origins = product.components[0]->origins;
  for (const volume::DeviceBricksPtr& bricks : product.components) {
    volume::ScalarVolume& component = made.emplace_back(volume::volume_on_device(bricks, name, index_to_world));
    // Bounds are whole bricks, as in main memory.
    if (origins.empty()) continue;
    component.bounds_min = glm::ivec3(std::numeric_limits<int>::max());
    component.bounds_max = glm::ivec3(std::numeric_limits<int>::min());
    for (const glm::ivec3& origin : origins) {
      component.bounds_min = glm::min(component.bounds_min, origin);
      component.bounds_max = glm::max(component.bounds_max, origin + (volume::brick_size - 1));
    }
    component.active_voxels = origins.size() * volume::brick_voxels;
  }
  return made;
}

grid::RgbField::Components three(std::vector<volume::ScalarVolume> volumes) {
  return {std::move(volumes[0]), std::move(volumes[1]), std::move(volumes[2])};
}

}  // namespace

std::vector<Channel> fields_of(const Product& product) { return std::visit(FieldsOf(), product); }

volume::DeviceBricksPtr StateInGl::field(Channel channel) const {
  const auto found = std::ranges::find(fields, channel, &Field::channel);
  return found == fields.end() ? nullptr : found->bricks;
}

const ProductInGl* StateInGl::product(const Product& what) const {
  const auto found = std::ranges::find(products, what, &ProductInGl::what);
  return found == products.end() ? nullptr : &*found;
}

StateInGl::Scatters StateInGl::scatters() const {
  if (!any(field(Channel::density))) return {};
  return {.colored = std::ranges::any_of(colors, [&](Channel channel) { return field(channel) != nullptr; }),
          .anisotropic = field(Channel::anisotropy) != nullptr,
          .moves = std::ranges::any_of(velocities, [&](Channel channel) { return any(field(channel)); })};
}

std::vector<Product> StateInGl::wanted(const std::vector<Emission>& settings) const {
  std::vector<Product> wanted;
  std::ranges::copy_if(settings, std::back_inserter(wanted), [&](const Emission& light) { return emits(light); });
  const Scatters how = scatters();
  if (how.colored) wanted.emplace_back(Scattering{});
  if (how.anisotropic) wanted.emplace_back(Forward{how.colored});
  if (how.moves) wanted.emplace_back(Momentum{unit_above(fastest_of({.density = {}, .velocity = velocity()}))});
  return wanted;
}

template <class Kind>
const ProductInGl* StateInGl::made() const {
  const auto found = std::ranges::find_if(
      products, [](const ProductInGl& product) { return std::holds_alternative<Kind>(product.what); });
  return found == products.end() ? nullptr : &*found;
}

bool StateInGl::has_wanted(const std::vector<Emission>& settings) const {
  const Scatters how = scatters();
  return (!how.colored || made<Scattering>()) && (!how.anisotropic || made<Forward>()) &&
         (!how.moves || made<Momentum>()) &&
         std::ranges::all_of(settings, [&](const Emission& light) { return !emits(light) || product(light); });
}

const Emission* StateInGl::some_emission() const {
  const ProductInGl* light = made<Emission>();
  return light != nullptr ? &std::get<Emission>(light->what) : nullptr;
}

bool StateInGl::emits(const Emission& settings) const {
  return std::ranges::any_of(fields_of(settings), [&](Channel channel) { return any(field(channel)); });
}

std::vector<volume::DeviceBricksPtr*> StateInGl::all() {
  std::vector<volume::DeviceBricksPtr*> all;
  for (Field& field : fields) all.push_back(&field.bricks);
  for (ProductInGl& product : products) {
    for (volume::DeviceBricksPtr& component : product.components) all.push_back(&component);
  }
  return all;
}

std::vector<const volume::DeviceBricks*> StateInGl::all() const {
  std::vector<const volume::DeviceBricks*> all;
  for (const Field& field : fields) all.push_back(field.bricks.get());
  for (const ProductInGl& product : products) {
    for (const volume::DeviceBricksPtr& component : product.components) all.push_back(component.get());
  }
  return all;
}

bool StateInGl::gone() const {
  return std::ranges::any_of(all(), [](const volume::DeviceBricks* bricks) { return bricks->gone(); });
}

std::optional<volume::ScalarVolume> StateInGl::volume_of(Channel channel) const {
  const volume::DeviceBricksPtr bricks = field(channel);
  if (!bricks) return std::nullopt;
  return volume::volume_on_device(bricks, channel == Channel::density ? name : volume::name_of(channel),
                                  index_to_world);
}

volume::ScalarVolume StateInGl::none() const {
  volume::ScalarVolume none;
  none.index_to_world = index_to_world;
  none.bounds_max = none.bounds_min;
  return none;
}

std::optional<volume::Velocity> StateInGl::velocity() const {
  std::optional<volume::Velocity> velocity;
  for (std::size_t i = 0; i < 3; ++i) {
    auto part = volume_of(velocities[i]);
    if (!part) continue;
    if (!velocity)
      velocity.emplace(volume::Velocity{{}, volume::Velocity::to_index_of(index_to_world)}).parts.fill(none());
    velocity->parts[2 * i] = std::move(*part);
  }
  return velocity;
}

volume::VolumeFrame StateInGl::frame() const {
  volume::VolumeFrame frame;
  frame.density = *volume_of(Channel::density);
  frame.temperature = volume_of(Channel::temperature);
  frame.flame = volume_of(Channel::flame);
  for (std::size_t i = 0; i < 3; ++i) {
    auto color = volume_of(colors[i]);
    if (!color) continue;
    if (!frame.color) frame.color.emplace().fill(none());
    (*frame.color)[i] = std::move(*color);
  }
  if (auto anisotropy = volume_of(Channel::anisotropy)) frame.anisotropy = {std::move(*anisotropy), none()};
  frame.velocity = velocity();
  return frame;
}

std::optional<grid::RgbField::Components> StateInGl::emission(const Emission& settings) const {
  const ProductInGl* light = product(settings);
  if (light == nullptr || !any(light->components[0])) return std::nullopt;
  return three(volumes_of(*light, "emission", index_to_world));
}

std::optional<grid::RgbField::Components> StateInGl::scattering() const {
  const ProductInGl* scattering = made<Scattering>();
  if (scattering == nullptr) return std::nullopt;
  return three(volumes_of(*scattering, "scattering", index_to_world));
}

std::optional<volume::ScalarVolume> StateInGl::forward() const {
  const ProductInGl* forward = made<Forward>();
  if (forward == nullptr) return std::nullopt;
  return std::move(volumes_of(*forward, "anisotropy", index_to_world)[0]);
}

std::optional<grid::MomentumField::Values> StateInGl::momentum() const {
  const ProductInGl* momentum = made<Momentum>();
  if (momentum == nullptr) return std::nullopt;
  return grid::MomentumField::Values{three(volumes_of(*momentum, "velocity", index_to_world)),
                                     std::get<Momentum>(momentum->what).fastest};
}

}  // namespace cumulet::scene
