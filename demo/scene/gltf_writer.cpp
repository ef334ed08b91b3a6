#include "gltf_writer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <glm/gtc/quaternion.hpp>
#include <sstream>
#include <stdexcept>
#include <type_traits>

namespace cumulet::scene {

namespace {

template <class T>
int append(std::vector<T>& list, T element) {
  list.push_back(std::move(element));
  return static_cast<int>(list.size()) - 1;
}

std::vector<double> numbers(const glm::vec3& v) { return {v.x, v.y, v.z}; }

}  // namespace

GltfWriter::GltfWriter() {
  model_.asset.version = "2.0";
  model_.asset.generator = "cumulet-scene";
  model_.buffers.emplace_back();
  model_.scenes.emplace_back();
  model_.defaultScene = 0;
  tinygltf::Sampler repeat;
  repeat.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
  repeat.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
  model_.samplers.push_back(repeat);
}

void GltfWriter::use(const std::string& extension) {
  std::vector<std::string>& used = model_.extensionsUsed;
  if (std::find(used.begin(), used.end(), extension) == used.end()) used.push_back(extension);
}

int GltfWriter::texture(const std::string& name, int size, const std::vector<std::uint8_t>& rgb) {
  tinygltf::Image image;
  image.name = name;
  image.mimeType = "image/png";
  image.width = image.height = size;
  image.component = 3;
  image.bits = 8;
  image.pixel_type = TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE;
  image.image = rgb;
  tinygltf::Texture made;
  made.sampler = 0;
  made.source = append(model_.images, std::move(image));
  return append(model_.textures, std::move(made));
}

int GltfWriter::material(const std::string& name, const glm::vec3& color, double metallic, double roughness) {
  tinygltf::Material made;
  made.name = name;
  made.pbrMetallicRoughness.baseColorFactor = {color.r, color.g, color.b, 1.0};
  made.pbrMetallicRoughness.metallicFactor = metallic;
  made.pbrMetallicRoughness.roughnessFactor = roughness;
  return append(model_.materials, std::move(made));
}

int GltfWriter::glowing(const std::string& name, const glm::vec3& color, const glm::vec3& radiance) {
  const int made = material(name, color, 0.0, 0.4);
  const float strength = std::max({radiance.r, radiance.g, radiance.b, 1.0F});
  at(made).emissiveFactor = numbers(radiance / strength);
  if (strength > 1.0F) {
    at(made).extensions["KHR_materials_emissive_strength"] =
        tinygltf::Value(tinygltf::Value::Object{{"emissiveStrength", tinygltf::Value(double{strength})}});
    use("KHR_materials_emissive_strength");
  }
  return made;
}

template <class T>
int GltfWriter::accessor(const std::vector<T>& values, int type, int component_type, int target) {
  std::vector<unsigned char>& data = model_.buffers[0].data;
  data.resize((data.size() + 3) / 4 * 4);
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = data.size();
  view.byteLength = values.size() * sizeof(T);
  view.target = target;
  data.resize(view.byteOffset + view.byteLength);
  std::memcpy(data.data() + view.byteOffset, values.data(), view.byteLength);
  tinygltf::Accessor made;
  made.bufferView = append(model_.bufferViews, std::move(view));
  made.type = type;
  made.componentType = component_type;
  made.count = values.size();
  if constexpr (std::is_same_v<T, glm::vec3>) {
    glm::vec3 low = values[0];
    glm::vec3 high = values[0];
    for (const glm::vec3& v : values) {
      low = glm::min(low, v);
      high = glm::max(high, v);
    }
    made.minValues = numbers(low);
    made.maxValues = numbers(high);
  } else if constexpr (std::is_same_v<T, float>) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    made.minValues = {*low};
    made.maxValues = {*high};
  }
  return append(model_.accessors, std::move(made));
}

int GltfWriter::mesh(const std::string& name, const std::vector<std::pair<const Mesh*, int>>& parts) {
  tinygltf::Mesh made;
  made.name = name;
  for (const auto& [part, material] : parts) {
    constexpr int vertices = TINYGLTF_TARGET_ARRAY_BUFFER;
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.material = material;
    primitive.attributes["POSITION"] =
        accessor(part->position, TINYGLTF_TYPE_VEC3, TINYGLTF_COMPONENT_TYPE_FLOAT, vertices);
    primitive.attributes["NORMAL"] =
        accessor(part->normal, TINYGLTF_TYPE_VEC3, TINYGLTF_COMPONENT_TYPE_FLOAT, vertices);
    if (!part->uv.empty()) {
      primitive.attributes["TEXCOORD_0"] =
          accessor(part->uv, TINYGLTF_TYPE_VEC2, TINYGLTF_COMPONENT_TYPE_FLOAT, vertices);
    }
    if (!part->color.empty()) {
      primitive.attributes["COLOR_0"] =
          accessor(part->color, TINYGLTF_TYPE_VEC4, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, vertices);
      model_.accessors.back().normalized = true;
    }
    primitive.indices = accessor(part->index, TINYGLTF_TYPE_SCALAR, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                                 TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
    made.primitives.push_back(std::move(primitive));
  }
  return append(model_.meshes, std::move(made));
}

int GltfWriter::node(const std::string& name, int parent, int mesh, const glm::vec3& at) {
  tinygltf::Node made;
  made.name = name;
  made.mesh = mesh;
  if (at != glm::vec3(0.0F)) made.translation = numbers(at);
  const int number = append(model_.nodes, std::move(made));
  (parent < 0 ? model_.scenes[0].nodes : model_.nodes[static_cast<std::size_t>(parent)].children).push_back(number);
  return number;
}

void GltfWriter::attach_camera(int node, const glm::vec3& target, double vertical_fov, double aspect) {
  tinygltf::Camera camera;
  tinygltf::Node& holder = model_.nodes[static_cast<std::size_t>(node)];
  camera.name = holder.name;
  camera.type = "perspective";
  camera.perspective.yfov = vertical_fov;
  camera.perspective.aspectRatio = aspect;
  camera.perspective.znear = 0.5;
  holder.camera = append(model_.cameras, std::move(camera));
  const glm::dvec3 eye(holder.translation[0], holder.translation[1], holder.translation[2]);
  const glm::dquat turn = glm::quatLookAt(glm::normalize(glm::dvec3(target) - eye), glm::dvec3(0, 1, 0));
  holder.rotation = {turn.x, turn.y, turn.z, turn.w};
}

void GltfWriter::spin(const std::string& name, int node, double seconds) {
  // Keys at thirds of a turn, so that the shortest rotation between two keys has the right direction.
  std::vector<float> times;
  std::vector<glm::vec4> turns;
  for (int i = 0; i <= 3; ++i) {
    const double half = 3.14159265358979 * i / 3.0;
    times.push_back(static_cast<float>(seconds * i / 3.0));
    turns.emplace_back(0.0F, static_cast<float>(std::sin(half)), 0.0F, static_cast<float>(std::cos(half)));
  }
  tinygltf::AnimationSampler sampler;
  sampler.input = accessor(times, TINYGLTF_TYPE_SCALAR, TINYGLTF_COMPONENT_TYPE_FLOAT, 0);
  sampler.output = accessor(turns, TINYGLTF_TYPE_VEC4, TINYGLTF_COMPONENT_TYPE_FLOAT, 0);
  sampler.interpolation = "LINEAR";
  tinygltf::Animation animation;
  animation.name = name;
  animation.samplers.push_back(std::move(sampler));
  tinygltf::AnimationChannel channel;
  channel.sampler = 0;
  channel.target_node = node;
  channel.target_path = "rotation";
  animation.channels.push_back(std::move(channel));
  model_.animations.push_back(std::move(animation));
}

std::string GltfWriter::glb() {
  std::ostringstream out;
  tinygltf::TinyGLTF writer;
  if (!writer.WriteGltfSceneToStream(&model_, out, false, true)) throw std::runtime_error("cannot write glTF");
  return std::move(out).str();
}

}  // namespace cumulet::scene
