#include "surface/rig.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>

#include "base/progress_part.hpp"
#include "surface/accessors.hpp"

namespace cumulet::surface::detail {

namespace {

void expect(const std::vector<double>& values, std::size_t count, const std::string& what, const char* name) {
  if (!values.empty() && values.size() != count) {
    malformed(what + ": " + name + " does not have " + std::to_string(count) + " numbers");
  }
}

class Importer {
 public:
  Importer(const GltfFile& file, const Log& log, const std::string& name, Budget& budget, Progress* progress,
           Scene& scene)
      : file_(file),
        model_(file.model),
        log_(log),
        name_(name),
        budget_(budget),
        progress_(progress),
        scene_(scene),
        accessors_(file, budget) {}

  Rig import() {
    for (std::size_t i = 0; i < model_.nodes.size(); ++i) rig_.nodes.push_back(node(i));
    link();
    display();
    for (std::size_t i = 0; i < model_.skins.size(); ++i) rig_.skins.push_back(skin(i));
    for (std::size_t i = 0; i < model_.animations.size(); ++i) animation(i);
    hide();
    if (unmatched_ > 0) {
      log_.warning(name_ + ": " + std::to_string(unmatched_) + " nodes have a wrong number of morph weights");
    }
    if (without_data_ > 0) {
      log_.warning(name_ + ": " + std::to_string(without_data_) +
                   " skins and animation channels are ignored: their buffer has no data");
    }
    if (without_elements_ > 0) {
      log_.warning(name_ + ": " + std::to_string(without_elements_) +
                   " skins and animation channels are ignored: an accessor has a count of 0");
    }
    if (frozen_ > 0) {
      log_.warning(name_ + ": " + std::to_string(frozen_) +
                   " animation channels of nodes that have a matrix, or no morph targets, are ignored");
    }
    if (not_followed_ > 0) {
      const std::string others = not_followed_ == 1 ? "" : " and " + std::to_string(not_followed_ - 1) + " more";
      log_.warning(name_ + ": unsupported animated pointers: " + first_not_followed_ + others);
    }
    return std::move(rig_);
  }

 private:
  Node node(std::size_t i) {
    const tinygltf::Node& from = model_.nodes[i];
    const std::string what = numbered("node", i);
    expect(from.matrix, 16, what, "matrix");
    expect(from.translation, 3, what, "translation");
    expect(from.rotation, 4, what, "rotation");
    expect(from.scale, 3, what, "scale");
    Node to;
    if (!from.matrix.empty()) to.matrix = glm::make_mat4(from.matrix.data());
    if (!from.translation.empty()) to.translation = glm::make_vec3(from.translation.data());
    if (!from.scale.empty()) to.scale = glm::make_vec3(from.scale.data());
    if (!from.rotation.empty()) {
      const auto& r = from.rotation;
      const glm::dquat rotation(r[3], r[0], r[1], r[2]);
      const double length = glm::length(rotation);
      if (length > 0.0 && std::isfinite(length)) to.rotation = rotation / length;
    }
    std::size_t targets = 0;
    const std::vector<double>* weights = &from.weights;
    if (from.mesh >= 0) {
      if (static_cast<std::size_t>(from.mesh) >= model_.meshes.size()) {
        malformed(what + ": there is no mesh " + std::to_string(from.mesh));
      }
      const tinygltf::Mesh& mesh = model_.meshes[static_cast<std::size_t>(from.mesh)];
      for (const auto& primitive : mesh.primitives) targets = std::max(targets, primitive.targets.size());
      if (from.weights.empty()) weights = &mesh.weights;
    }
    if (!weights->empty() && weights->size() != targets) ++unmatched_;
    budget_.take(targets, sizeof(float), what);
    to.weights.resize(targets, 0.0F);
    for (std::size_t t = 0; t < std::min(targets, weights->size()); ++t) to.weights[t] = narrow((*weights)[t]);
    const auto visibility = from.extensions.find("KHR_node_visibility");
    if (visibility != from.extensions.end() && visibility->second.Has("visible")) {
      to.visible = visibility->second.Get("visible").Get<bool>();
    }
    return to;
  }

  /// Finds parents, and an order in which parents come first.
  void link() {
    const std::size_t count = rig_.nodes.size();
    for (std::size_t i = 0; i < count; ++i) {
      for (const int child : model_.nodes[i].children) {
        if (static_cast<std::size_t>(child) >= count) {
          malformed(numbered("node", i) + ": there is no node " + std::to_string(child));
        }
        std::int32_t& parent = rig_.nodes[static_cast<std::size_t>(child)].parent;
        if (parent >= 0) malformed(numbered("node", static_cast<std::size_t>(child)) + " has two parents");
        parent = static_cast<std::int32_t>(i);
      }
    }
    std::vector<bool> seen(count, false);
    for (std::uint32_t i = 0; i < count; ++i) {
      if (rig_.nodes[i].parent < 0) descend(i, seen, rig_.order);
    }
    if (rig_.order.size() == count) return;
    // Each node has at most one parent, so a node that no root reaches is in a cycle.
    const auto lost = std::find(seen.begin(), seen.end(), false) - seen.begin();
    malformed(numbered("node", static_cast<std::size_t>(lost)) + " is its own ancestor");
  }

  /// Appends the descendants of a root, parents first. Nodes already seen are skipped with their descendants.
  void descend(std::uint32_t root, std::vector<bool>& seen, std::vector<std::uint32_t>& to) const {
    std::vector<std::uint32_t> open = {root};
    while (!open.empty()) {
      const std::uint32_t i = open.back();
      open.pop_back();
      if (seen[i]) continue;
      seen[i] = true;
      to.push_back(i);
      const auto& children = model_.nodes[i].children;
      open.insert(open.end(), children.rbegin(), children.rend());
    }
  }

  /// Selects the nodes of the default scene, else of the first scene, else all.
  void display() {
    if (model_.scenes.empty()) {
      if (model_.defaultScene > 0) malformed("there is no scene " + std::to_string(model_.defaultScene));
      rig_.displayed = rig_.order;
      return;
    }
    const auto index = static_cast<std::size_t>(std::max(model_.defaultScene, 0));
    if (index >= model_.scenes.size()) malformed("there is no scene " + std::to_string(index));
    std::vector<bool> seen(rig_.nodes.size(), false);
    for (const int root : model_.scenes[index].nodes) {
      if (static_cast<std::size_t>(root) >= rig_.nodes.size()) {
        malformed(numbered("scene", index) + ": there is no node " + std::to_string(root));
      }
      // A root that descends from another root, or is named twice, is drawn once.
      descend(static_cast<std::uint32_t>(root), seen, rig_.displayed);
    }
  }

  void hide() {
    std::vector<bool> shown(rig_.nodes.size(), false);  // by an animation
    for (const Track& track : rig_.tracks) {
      for (const Channel& channel : track.channels) {
        if (channel.property == Property::visibility) shown[channel.target] = true;
      }
    }
    rig_.hidden.resize(rig_.nodes.size(), false);
    for (const std::uint32_t i : rig_.order) {
      const Node& node = rig_.nodes[i];
      rig_.hidden[i] =
          (!node.visible && !shown[i]) || (node.parent >= 0 && rig_.hidden[static_cast<std::size_t>(node.parent)]);
    }
  }

  Skin skin(std::size_t i) {
    const tinygltf::Skin& from = model_.skins[i];
    const std::string what = numbered("skin", i);
    if (from.joints.empty()) malformed(what + " has no joints");
    Skin to;
    for (const int joint : from.joints) {
      if (static_cast<std::size_t>(joint) >= rig_.nodes.size()) {
        malformed(what + ": there is no node " + std::to_string(joint));
      }
      to.joints.push_back(static_cast<std::uint32_t>(joint));
    }
    if (file_.without_data(from.inverseBindMatrices)) {
      ++without_data_;
    } else if (file_.without_elements(from.inverseBindMatrices)) {
      ++without_elements_;
    } else if (from.inverseBindMatrices >= 0) {
      to.inverse_bind = accessors_.matrices(from.inverseBindMatrices, what + ", inverseBindMatrices");
      if (to.inverse_bind.size() < to.joints.size()) {
        malformed(what + " has " + std::to_string(to.inverse_bind.size()) + " matrices for " +
                  std::to_string(to.joints.size()) + " joints");
      }
      for (const glm::mat4& matrix : to.inverse_bind) {
        for (int n = 0; n < 16; ++n) {
          if (!std::isfinite(matrix[n / 4][n % 4])) malformed(what + ", inverseBindMatrices is not finite");
        }
      }
    }
    to.inverse_bind.resize(to.joints.size(), glm::mat4(1.0F));
    return to;
  }

  void animation(std::size_t i) {
    check(progress_);
    const tinygltf::Animation& from = model_.animations[i];
    Track track;
    const auto add = [&](std::optional<Channel> made) {
      if (!made) return;
      track.duration = std::max(track.duration, double{made->times.back()});
      track.channels.push_back(std::move(*made));
    };
    for (std::size_t c = 0; c < from.channels.size(); ++c) {
      const std::string what = numbered("animation", i) + ", " + numbered("channel", c);
      const auto target = target_of(from.channels[c], what);
      if (target) add(channel(from, from.channels[c].sampler, *target, what));
    }
    for (const PointerChannel& pointing : file_.pointers) {
      if (pointing.animation != i) continue;
      const std::string what = numbered("animation", i) + ", " + one_line(pointing.pointer);
      const auto target = target_of(pointing.pointer, what);
      if (target) {
        add(channel(from, pointing.sampler, *target, what));
      } else if (not_followed_++ == 0) {
        first_not_followed_ = one_line(pointing.pointer);
      }
    }
    scene_.animations.push_back({one_line(from.name), track.duration});
    rig_.tracks.push_back(std::move(track));
  }

  /// Returns nullopt if the channel changes nothing.
  std::optional<Channel> target_of(const tinygltf::AnimationChannel& from, const std::string& what) const {
    if (from.target_node < 0) return std::nullopt;
    return node_target(static_cast<std::size_t>(from.target_node), from.target_path, what);
  }

  /// Returns the target of a pointer of KHR_animation_pointer; nullopt if it is not supported.
  std::optional<Channel> target_of(std::string_view pointer, const std::string& what) const {
    std::size_t number = 0;
    std::string_view rest = pointer;
    if (below("/nodes/", rest, number)) {
      return node_target(number, rest == "extensions/KHR_node_visibility/visible" ? "visible" : rest, what);
    }
    Channel to;
    if (below("/materials/", rest, number)) {
      const auto member = material_member(rest);
      if (!member) return std::nullopt;
      if (number >= model_.materials.size()) malformed(what + ": there is no material " + std::to_string(number));
      to.property = Property::material;
      to.width = member->width;
      to.of_material = *member;
    } else if (below("/extensions/KHR_lights_punctual/lights/", rest, number)) {
      const auto member = light_member(rest);
      if (!member) return std::nullopt;
      if (number >= model_.lights.size()) malformed(what + ": there is no light " + std::to_string(number));
      to.property = Property::light;
      to.width = member->width;
      to.of_light = *member;
    } else {
      return std::nullopt;
    }
    to.target = static_cast<std::uint32_t>(number);
    return to;
  }

  /// Returns true if `text` begins with `head`, a number and a slash, and removes them.
  static bool below(std::string_view head, std::string_view& text, std::size_t& number) {
    if (!text.starts_with(head)) return false;
    std::string_view rest = text.substr(head.size());
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    if (error != std::errc()) return false;
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    if (!rest.starts_with('/')) return false;
    text = rest.substr(1);
    return true;
  }

  std::optional<Channel> node_target(std::size_t node, std::string_view path, const std::string& what) const {
    if (node >= rig_.nodes.size()) malformed(what + ": there is no node " + std::to_string(node));
    Channel to;
    to.target = static_cast<std::uint32_t>(node);
    if (path == "translation") {
      to.property = Property::translation;
    } else if (path == "rotation") {
      to.property = Property::rotation;
      to.width = 4;
    } else if (path == "scale") {
      to.property = Property::scale;
    } else if (path == "weights") {
      to.property = Property::weights;
      to.width = rig_.nodes[node].weights.size();
    } else if (path == "visible") {
      to.property = Property::visibility;
      to.width = 1;
    } else {
      return std::nullopt;  // target of an extension
    }
    return to;
  }

  /// Returns true if an animation can move the property. A node with a matrix cannot be moved, nor can weights without
  /// targets.
  [[nodiscard]] bool moves(const Channel& channel) const {
    switch (channel.property) {
      case Property::translation:
      case Property::rotation:
      case Property::scale:
        return !rig_.nodes[channel.target].matrix.has_value();
      case Property::weights:
        return channel.width > 0;
      default:
        return true;
    }
  }

  /// Returns nullopt if the channel changes nothing.
  std::optional<Channel> channel(const tinygltf::Animation& animation, int sampler_number, Channel to,
                                 const std::string& what) {
    if (sampler_number < 0 || static_cast<std::size_t>(sampler_number) >= animation.samplers.size()) {
      malformed(what + ": there is no sampler " + std::to_string(sampler_number));
    }
    const tinygltf::AnimationSampler& sampler = animation.samplers[static_cast<std::size_t>(sampler_number)];
    if (!moves(to)) {
      ++frozen_;
      return std::nullopt;
    }
    if (sampler.interpolation == "STEP") {
      to.interpolation = Interpolation::step;
    } else if (sampler.interpolation == "CUBICSPLINE") {
      to.interpolation = Interpolation::cubic_spline;
    } else if (sampler.interpolation != "LINEAR") {
      malformed(what + ": interpolation \"" + one_line(sampler.interpolation) + "\" is unknown");
    }
    if (to.property == Property::visibility && to.interpolation != Interpolation::step) {
      malformed(what + ": a boolean can only be animated with STEP interpolation");
    }
    if (file_.without_data(sampler.input) || file_.without_data(sampler.output)) {
      ++without_data_;
      return std::nullopt;
    }
    if (file_.without_elements(sampler.input) || file_.without_elements(sampler.output)) {
      ++without_elements_;
      return std::nullopt;
    }
    to.times = accessors_.scalars(sampler.input, what + ", input");
    for (std::size_t k = 0; k < to.times.size(); ++k) {
      if (!std::isfinite(to.times[k]) || to.times[k] < 0.0F || (k > 0 && to.times[k] < to.times[k - 1])) {
        malformed(what + ": its times are not increasing");
      }
    }
    read_values(sampler.output, what + ", output", to);
    const std::size_t wanted = to.times.size() * to.width * (to.interpolation == Interpolation::cubic_spline ? 3 : 1);
    if (to.values.size() != wanted) {
      malformed(what + " has " + std::to_string(to.values.size()) + " numbers, not " + std::to_string(wanted));
    }
    for (float& value : to.values) {
      if (!std::isfinite(value)) malformed(what + ", output is not finite");
      value = narrow(value);
    }
    return to;
  }

  void read_values(int accessor, const std::string& what, Channel& to) {
    const auto flatten = [&to](const auto& vectors) {
      to.values.reserve(vectors.size() * to.width);
      for (const auto& vector : vectors) {
        for (std::size_t c = 0; c < to.width; ++c) to.values.push_back(vector[static_cast<int>(c)]);
      }
    };
    if (to.property == Property::weights || to.width == 1) {
      to.values = accessors_.scalars(accessor, what);
    } else if (to.width == 4) {
      if (accessors_.type(accessor, what) != TINYGLTF_TYPE_VEC4) malformed(what + " has the wrong type of element");
      flatten(accessors_.vectors<4>(accessor, what));
    } else if (to.width == 2) {
      flatten(accessors_.vectors<2>(accessor, what));
    } else {
      flatten(accessors_.vectors<3>(accessor, what));
    }
  }

  const GltfFile& file_;
  const tinygltf::Model& model_;
  const Log& log_;
  const std::string& name_;
  Budget& budget_;
  Progress* progress_;
  Scene& scene_;
  Accessors accessors_;
  Rig rig_;
  std::size_t unmatched_ = 0;
  std::size_t without_data_ = 0;
  std::size_t without_elements_ = 0;
  std::size_t frozen_ = 0;
  std::size_t not_followed_ = 0;
  std::string first_not_followed_;
};

glm::dquat quaternion(const float* from) {
  return {double{from[3]}, double{from[0]}, double{from[1]}, double{from[2]}};
}

void store(glm::dquat from, std::span<float> to) {
  const double length = glm::length(from);
  from = length > 0.0 && std::isfinite(length) ? from / length : glm::dquat(1.0, 0.0, 0.0, 0.0);
  to[0] = static_cast<float>(from.x);
  to[1] = static_cast<float>(from.y);
  to[2] = static_cast<float>(from.z);
  to[3] = static_cast<float>(from.w);
}

}  // namespace

void sample(const Channel& channel, double time, std::span<float> to) {
  const std::size_t keys = channel.times.size();
  const bool cubic = channel.interpolation == Interpolation::cubic_spline;
  const std::size_t per_key = channel.width * (cubic ? 3 : 1);
  const auto value = [&](std::size_t key) { return &channel.values[key * per_key + (cubic ? channel.width : 0)]; };
  const bool rotation = channel.property == Property::rotation;
  const auto after = std::upper_bound(channel.times.begin(), channel.times.end(), time,
                                      [](double t, float key) { return t < double{key}; });
  const auto next = static_cast<std::size_t>(after - channel.times.begin());
  if (next == 0 || next == keys || channel.interpolation == Interpolation::step) {
    const float* from = value(next == 0 ? 0 : next - 1);
    if (rotation) {
      store(quaternion(from), to);
    } else {
      std::copy_n(from, channel.width, to.begin());
    }
    return;
  }
  const std::size_t last = next - 1;
  const double span = double{channel.times[next]} - double{channel.times[last]};  // positive, because `after` is beyond
                                                                                  // time
  const double u = (time - double{channel.times[last]}) / span;
  const float* v0 = value(last);
  const float* v1 = value(next);
  if (!cubic) {
    if (rotation) {
      store(glm::slerp(quaternion(v0), quaternion(v1), u), to);
    } else {
      for (std::size_t c = 0; c < channel.width; ++c) to[c] = narrow(v0[c] * (1.0 - u) + v1[c] * u);
    }
    return;
  }
  // Hermite: the out-tangent of the last key and the in-tangent of the next, per second.
  const float* out = v0 + channel.width;
  const float* in = v1 - channel.width;
  const double u2 = u * u;
  const double u3 = u2 * u;
  for (std::size_t c = 0; c < channel.width; ++c) {
    // Finite tangents may still overflow.
    to[c] = narrow((2.0 * u3 - 3.0 * u2 + 1.0) * v0[c] + span * (u3 - 2.0 * u2 + u) * out[c] +
                   (-2.0 * u3 + 3.0 * u2) * v1[c] + span * (u3 - u2) * in[c]);
  }
  if (rotation) store(quaternion(to.data()), to);
}

Rig import_rig(const GltfFile& file, const Log& log, const std::string& name, Budget& budget, Progress* progress,
               Scene& scene) {
  return Importer(file, log, name, budget, progress, scene).import();
}

Stance stance(const Rig& rig, const Track* track, double time) {
  struct Moved {
    glm::dvec3 translation;
    glm::dquat rotation;
    glm::dvec3 scale;
  };
  Stance result;
  std::vector<Moved> local;
  local.reserve(rig.nodes.size());
  result.weights.reserve(rig.nodes.size());
  for (const Node& node : rig.nodes) {
    local.push_back({node.translation, node.rotation, node.scale});
    result.weights.push_back(node.weights);
    result.visible.push_back(node.visible);
  }
  if (track != nullptr) {
    std::vector<float> values;
    for (const Channel& channel : track->channels) {
      if (channel.property == Property::material || channel.property == Property::light) continue;
      values.resize(channel.width);
      sample(channel, time, values);
      Moved& moved = local[channel.target];
      switch (channel.property) {
        case Property::translation:
          moved.translation = glm::make_vec3(values.data());
          break;
        case Property::rotation:
          moved.rotation = quaternion(values.data());
          break;
        case Property::scale:
          moved.scale = glm::make_vec3(values.data());
          break;
        case Property::weights:
          result.weights[channel.target] = values;
          break;
        case Property::visibility:
          result.visible[channel.target] = values[0] != 0.0F;
          break;
        default:
          break;
      }
    }
  }
  result.to_world.resize(rig.nodes.size());
  for (const std::uint32_t i : rig.order) {
    const Node& node = rig.nodes[i];
    glm::dmat4 matrix(1.0);
    if (node.matrix) {
      matrix = *node.matrix;
    } else {
      matrix = glm::mat4_cast(local[i].rotation);
      for (int c = 0; c < 3; ++c) matrix[c] *= local[i].scale[c];
      matrix[3] = glm::dvec4(local[i].translation, 1.0);
    }
    if (node.parent >= 0 && !result.visible[static_cast<std::size_t>(node.parent)]) result.visible[i] = false;
    result.to_world[i] = node.parent < 0 ? matrix : result.to_world[static_cast<std::size_t>(node.parent)] * matrix;
  }
  return result;
}

}  // namespace cumulet::surface::detail
