#include "surface/gltf_file.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "base/progress_part.hpp"
#include "surface/gltf_schema.hpp"
#include "surface/gltf_uri.hpp"
#include "surface/meshopt.hpp"

namespace cumulet::surface::detail {

namespace {

using nlohmann::json;

constexpr std::array known_extensions = {"KHR_lights_punctual",
                                         "KHR_materials_unlit",
                                         "KHR_materials_emissive_strength",
                                         "KHR_materials_ior",
                                         "KHR_materials_specular",
                                         "KHR_materials_clearcoat",
                                         "KHR_materials_transmission",
                                         "KHR_materials_volume",
                                         "KHR_materials_dispersion",
                                         "KHR_materials_sheen",
                                         "KHR_materials_anisotropy",
                                         "KHR_materials_iridescence",
                                         "KHR_materials_pbrSpecularGlossiness",
                                         "KHR_materials_variants",
                                         "KHR_node_visibility",
                                         "KHR_animation_pointer",
                                         "KHR_texture_transform",
                                         "KHR_mesh_quantization",
                                         "KHR_draco_mesh_compression",
                                         "EXT_mesh_gpu_instancing",
                                         "EXT_meshopt_compression",
                                         "EXT_texture_webp"};

bool known(const std::string& extension) {
  return std::find(known_extensions.begin(), known_extensions.end(), extension) != known_extensions.end();
}

void check_extensions(const json& root, const Log& log, const std::string& name) {
  for (const json& required : root.value("extensionsRequired", json::array())) {
    const auto extension = required.get<std::string>();
    if (known(extension)) continue;
    throw Error(ErrorCode::unsupported, "needs the extension " + one_line(extension) + ", which is not supported");
  }
  std::set<std::string> ignored;
  for (const json& used : root.value("extensionsUsed", json::array())) {
    const auto extension = used.get<std::string>();
    if (!known(extension)) ignored.insert(one_line(extension));
  }
  if (ignored.empty()) return;
  std::string list;
  for (const std::string& extension : ignored) list += (list.empty() ? "" : ", ") + extension;
  log.warning(name + ": rendered without " + one_line(list));
}

/// glTF 2.x: a minor version adds only features that an older reader may ignore.
bool of_version_2(const std::string& version) {
  return version.size() > 2 && version.starts_with("2.") &&
         std::all_of(version.begin() + 2, version.end(), [](char c) { return c >= '0' && c <= '9'; });
}

void check_version(const json& root, const Log& log, const std::string& name) {
  const auto asset = root.find("asset");
  if (asset == root.end() || !asset->contains("version")) malformed("asset.version is missing");
  const auto version = asset->at("version").get<std::string>();
  const auto oldest = asset->value("minVersion", std::string("2.0"));
  for (const std::string& one : {version, oldest}) {
    if (!of_version_2(one)) throw Error(ErrorCode::unsupported, "is glTF " + one_line(one) + ", not 2.0");
  }
  if (oldest != "2.0") log.warning(name + ": requires glTF " + one_line(oldest) + "; it is read as 2.0");
}

struct Container {
  std::string_view json;
  std::optional<std::span<const std::uint8_t>> binary;
};

std::uint32_t little_endian(std::span<const std::uint8_t> bytes, std::size_t at) {
  return std::uint32_t{bytes[at]} | std::uint32_t{bytes[at + 1]} << 8U | std::uint32_t{bytes[at + 2]} << 16U |
         std::uint32_t{bytes[at + 3]} << 24U;
}

/// Returns the chunks of a .glb (glTF 2.0, 4.4), or all of a .gltf.
Container unpack(std::span<const std::uint8_t> bytes) {
  const auto text = [](std::span<const std::uint8_t> part) {
    return std::string_view(reinterpret_cast<const char*>(part.data()), part.size());
  };
  constexpr std::string_view magic = "glTF";
  if (bytes.size() < magic.size() || text(bytes.first(magic.size())) != magic) {
    if (bytes.empty()) malformed("is empty");
    std::string_view all = text(bytes);
    if (all.starts_with("\xEF\xBB\xBF")) all.remove_prefix(3);
    return {all, std::nullopt};
  }
  if (bytes.size() < 12) malformed("ends within the header of a .glb");
  const std::uint32_t version = little_endian(bytes, 4);
  if (version != 2) throw Error(ErrorCode::unsupported, "is binary glTF " + std::to_string(version) + ", not 2");
  const std::uint32_t length = little_endian(bytes, 8);
  if (length > bytes.size()) {
    malformed("is truncated: " + std::to_string(bytes.size()) + " of " + std::to_string(length) + " bytes");
  }
  bytes = bytes.first(std::max<std::size_t>(length, 12));
  Container container;
  constexpr std::uint32_t json_chunk = 0x4E4F534A;
  constexpr std::uint32_t binary_chunk = 0x004E4942;
  for (std::size_t at = 12, chunk = 0; at < bytes.size(); ++chunk) {
    if (bytes.size() - at < 8) malformed("ends within the header of chunk " + std::to_string(chunk));
    const std::uint32_t size = little_endian(bytes, at);
    const std::uint32_t type = little_endian(bytes, at + 4);
    at += 8;
    if (size > bytes.size() - at) malformed("ends within chunk " + std::to_string(chunk));
    const auto content = bytes.subspan(at, size);
    if (chunk == 0 && type != json_chunk) malformed("does not begin with a JSON chunk");
    if (chunk == 0) container.json = text(content);
    if (chunk == 1 && type == binary_chunk) container.binary = content;
    at += size;
  }
  if (container.json.empty()) malformed("has no JSON chunk");
  return container;
}

/// Removes from the JSON, whose types have been checked, everything that tinygltf must not see. This includes bytes,
/// which this file loads with checks, and valid content that tinygltf rejects: channels without a node, indices without
/// a buffer view, skins without matrices, and accessors of unknown types. The returned data is restored after parsing.
struct SetAside {
  struct Indices {
    std::size_t mesh;
    std::size_t primitive;
    int accessor;
  };
  json buffers = json::array();
  json images = json::array();
  std::vector<Indices> indices;
  std::vector<std::size_t> untyped;  ///< accessors of types that glTF does not define
  std::vector<PointerChannel> pointers;
  std::size_t channels = 0;  ///< channels with neither a node nor a pointer
};

json take_member(json& root, const char* name) {
  const auto found = root.find(name);
  if (found == root.end()) return json::array();
  json value = std::move(*found);
  root.erase(found);
  return value;
}

/// Removes indices whose accessor has no buffer view.
std::vector<SetAside::Indices> take_indices(json& root) {
  std::vector<SetAside::Indices> taken;
  if (!root.contains("meshes")) return taken;
  const auto accessors = root.find("accessors");
  const auto take = [&](json& primitive, std::size_t m, std::size_t p) {
    const auto indices = primitive.find("indices");
    if (indices == primitive.end()) return;
    const auto accessor = indices->get<std::size_t>();
    if (accessors == root.end() || accessor >= accessors->size()) {
      malformed("mesh " + std::to_string(m) + ", primitive " + std::to_string(p) + ": there is no accessor " +
                std::to_string(accessor));
    }
    if (accessors->at(accessor).contains("bufferView")) return;
    taken.push_back({m, p, static_cast<int>(accessor)});
    primitive.erase(indices);
  };
  json& meshes = root["meshes"];
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const auto primitives = meshes[m].find("primitives");
    if (primitives == meshes[m].end()) continue;
    for (std::size_t p = 0; p < primitives->size(); ++p) take(primitives->at(p), m, p);
  }
  return taken;
}

/// Gives accessors of unknown types a known one; returns their indices.
std::vector<std::size_t> take_types(json& root) {
  constexpr std::array types = {"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"};
  std::vector<std::size_t> untyped;
  const auto accessors = root.find("accessors");
  if (accessors == root.end()) return untyped;
  for (std::size_t a = 0; a < accessors->size(); ++a) {
    const auto type = accessors->at(a).find("type");
    if (type == accessors->at(a).end() || std::ranges::find(types, type->get<std::string>()) != types.end()) continue;
    untyped.push_back(a);
    *type = types[0];
  }
  return untyped;
}

/// Inverse bind matrices are optional in glTF, but tinygltf requires them.
void complete_skins(json& root) {
  if (!root.contains("skins")) return;
  json& skins = root["skins"];
  for (std::size_t s = 0; s < skins.size(); ++s) {
    if (!skins[s].contains("joints")) malformed(numbered("skin", s) + " has no joints");
    if (!skins[s].contains("inverseBindMatrices")) skins[s]["inverseBindMatrices"] = -1;
  }
}

/// Removes channels without a node.
void take_channels(json& root, SetAside& aside) {
  if (!root.contains("animations")) return;
  json& animations = root["animations"];
  for (std::size_t a = 0; a < animations.size(); ++a) {
    json& animation = animations[a];
    if (!animation.contains("channels")) continue;
    json kept = json::array();
    for (json& channel : animation["channels"]) {
      const json target = channel.value("target", json());
      const json::json_pointer pointer("/extensions/KHR_animation_pointer/pointer");
      if (target.is_null() || target.contains("node")) {
        kept.push_back(std::move(channel));
      } else if (target.value("path", std::string()) == "pointer" && target.contains(pointer)) {
        aside.pointers.push_back({a, channel.value("sampler", -1), target[pointer].get<std::string>()});
      } else {
        ++aside.channels;
      }
    }
    animation["channels"] = std::move(kept);
  }
}

SetAside set_aside(json& root) {
  SetAside aside;
  aside.buffers = take_member(root, "buffers");
  aside.images = take_member(root, "images");
  aside.indices = take_indices(root);
  aside.untyped = take_types(root);
  complete_skins(root);
  take_channels(root, aside);
  return aside;
}

json parse_json(std::string_view text) {
  check_nesting(text);
  try {
    return json::parse(text);
  } catch (const json::exception& error) {
    malformed("is not JSON: " + one_line(error.what()));
  }
}

/// Parses everything except buffers and images.
tinygltf::Model parse_model(const json& root) {
  const std::string text = root.dump();
  if (text.size() > std::numeric_limits<std::uint32_t>::max()) malformed("has more than 4 GiB of JSON");
  tinygltf::Model model;
  std::string error;
  std::string warning;
  const bool good = tinygltf::TinyGLTF().LoadASCIIFromString(&model, &error, &warning, text.data(),
                                                             static_cast<unsigned>(text.size()), "");
  // tinygltf leaves out content with errors, even if it continues.
  if (!good || !error.empty()) malformed(error.empty() ? "cannot be parsed" : one_line(error));
  return model;
}

class Loader {
 public:
  Loader(GltfFile& file, const Log& log, const std::string& name, Budget& budget, Progress* progress)
      : file_(file), log_(log), name_(name), budget_(budget), progress_(progress) {}

  void load_buffers(const json& buffers, std::optional<std::span<const std::uint8_t>> binary) {
    for (std::size_t i = 0; i < buffers.size(); ++i) {
      cumulet::check(progress_);
      const json& buffer = buffers[i];
      if (!buffer.contains("byteLength")) malformed(numbered("buffer", i) + " has no byteLength");
      const auto length = buffer["byteLength"].get<std::uint64_t>();
      std::span<const std::uint8_t> bytes;
      if (buffer.contains("uri")) {
        try {
          bytes = file_.storage->emplace_back(resolve_uri(buffer["uri"].get<std::string>(), file_.folder, budget_));
        } catch (const Error& error) {
          // This is an error only for a reader of the buffer.
          const std::string cause = numbered("buffer", i) + ": " + error.what();
          log_.warning(name_ + ": " + cause);
          buffers_.push_back({Missing{cause}, length});
          continue;
        }
      } else if (i == 0 && binary) {
        bytes = *binary;
      } else {
        buffers_.push_back({NoData{}, length});  // for example placeholder buffers of EXT_meshopt_compression
        continue;
      }
      if (bytes.size() < length) {
        malformed(numbered("buffer", i) + " has " + std::to_string(bytes.size()) + " bytes, not " +
                  std::to_string(length));
      }
      buffers_.push_back({bytes.first(length), length});
    }
  }

  void load_views() {
    const auto& views = file_.model.bufferViews;
    for (std::size_t i = 0; i < views.size(); ++i) {
      cumulet::check(progress_);
      const tinygltf::BufferView& view = views[i];
      const std::string what = numbered("buffer view", i);
      const auto compressed = view.extensions.find("EXT_meshopt_compression");
      if (compressed == view.extensions.end()) {
        file_.views.push_back(part(view.buffer, view.byteOffset, view.byteLength, what));
        continue;
      }
      const tinygltf::Value& extension = compressed->second;
      const auto number = [&extension](const char* key) {
        return extension.Has(key) ? extension.Get(key).GetNumberAsDouble() : 0.0;
      };
      if (!extension.Has("buffer")) malformed(what + ": EXT_meshopt_compression names no buffer");
      Data from = part(static_cast<int>(number("buffer")), static_cast<std::uint64_t>(number("byteOffset")),
                       static_cast<std::uint64_t>(number("byteLength")), what);
      if (const auto* bytes = std::get_if<Bytes>(&from)) {
        from = file_.storage->emplace_back(decode_meshopt(extension, *bytes, file_.storage, what, budget_));
      }
      file_.views.push_back(std::move(from));
    }
  }

 private:
  struct Buffer {
    Data data;
    std::uint64_t size = 0;  ///< from the file
  };

  Data part(int buffer, std::uint64_t offset, std::uint64_t length, const std::string& what) {
    if (buffer < 0 || static_cast<std::size_t>(buffer) >= buffers_.size()) {
      malformed(what + ": there is no buffer " + std::to_string(buffer));
    }
    const auto& [data, size] = buffers_[static_cast<std::size_t>(buffer)];
    if (offset > size || length > size - offset) {
      malformed(what + " exceeds the " + std::to_string(size) + " bytes of buffer " + std::to_string(buffer));
    }
    const auto* bytes = std::get_if<Bytes>(&data);
    return bytes != nullptr ? Data(bytes->subspan(offset, length)) : data;
  }

  GltfFile& file_;
  const Log& log_;
  const std::string& name_;
  Budget& budget_;
  Progress* progress_;
  std::vector<Buffer> buffers_;
};

}  // namespace

Bytes GltfFile::view(std::int64_t index) const {
  if (index < 0 || static_cast<std::size_t>(index) >= views.size()) {
    malformed("there is no buffer view " + std::to_string(index));
  }
  const Data& found = views[static_cast<std::size_t>(index)];
  if (const auto* missing = std::get_if<Missing>(&found)) malformed(missing->cause);
  if (std::holds_alternative<NoData>(found)) malformed("buffer view " + std::to_string(index) + " has no data");
  return std::get<Bytes>(found);
}

bool GltfFile::without_data(int accessor) const {
  if (accessor < 0 || static_cast<std::size_t>(accessor) >= model.accessors.size()) return false;
  const tinygltf::Accessor& of = model.accessors[static_cast<std::size_t>(accessor)];
  const auto empty = [this](int view) {
    const auto at = static_cast<std::size_t>(view);
    return view >= 0 && at < views.size() && std::holds_alternative<NoData>(views[at]);
  };
  const bool sparse = of.sparse.isSparse && (empty(of.sparse.indices.bufferView) || empty(of.sparse.values.bufferView));
  return empty(of.bufferView) || sparse;
}

bool GltfFile::without_elements(int accessor) const {
  return accessor >= 0 && static_cast<std::size_t>(accessor) < model.accessors.size() &&
         model.accessors[static_cast<std::size_t>(accessor)].count == 0;
}

GltfFile parse_gltf(std::vector<std::uint8_t> bytes, const std::optional<std::filesystem::path>& folder, const Log& log,
                    const std::string& name, Budget& budget, Progress* progress) {
  GltfFile file;
  file.folder = folder;
  const Container container = unpack(file.storage->emplace_back(std::move(bytes)));
  const std::size_t length = container.json.size();
  auto checked = run_cancellable(budget.progress_for(length), [text = container.json, owner = file.storage] {
    json parsed = parse_json(text);
    std::string out_of_range = check_schema(parsed);
    return std::pair(std::move(parsed), std::move(out_of_range));
  });
  json& root = checked.first;
  if (!checked.second.empty()) log.warning(name + ": " + checked.second);
  check_version(root, log, name);
  check_extensions(root, log, name);
  SetAside aside = set_aside(root);
  if (aside.channels > 0) {
    log.warning(name + ": " + std::to_string(aside.channels) + " animation channels without a target node are ignored");
  }

  file.model = run_cancellable(budget.progress_for(length), [root = std::move(root)] { return parse_model(root); });
  for (const auto& [mesh, primitive, accessor] : aside.indices) {
    if (mesh >= file.model.meshes.size() || primitive >= file.model.meshes[mesh].primitives.size()) {
      malformed(numbered("mesh", mesh) + " is malformed");
    }
    file.model.meshes[mesh].primitives[primitive].indices = accessor;
  }

  file.pointers = std::move(aside.pointers);
  for (const std::size_t accessor : aside.untyped) file.model.accessors.at(accessor).type = -1;

  Loader loader(file, log, name, budget, progress);
  loader.load_buffers(aside.buffers, container.binary);
  loader.load_views();
  for (const json& image : aside.images) {
    file.images.push_back({one_line(image.value("name", std::string())), image.value("uri", std::string()),
                           image.value("bufferView", std::int64_t{-1})});
  }
  return file;
}

}  // namespace cumulet::surface::detail
