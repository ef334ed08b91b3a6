// Read-back of a context's images.

#include <algorithm>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/milliseconds.hpp"
#include "gl/transient_framebuffer.hpp"
#include "render/film/checkpoint.hpp"
#include "render/passes/denoised.hpp"
#include "render/passes/wavelet.hpp"
#include "settings/aov_table.hpp"
#include "viewer/context.hpp"

namespace cumulet::viewer {

using glm::dvec3;

namespace {

constexpr const char* nothing_rendered = "nothing has been rendered yet";
constexpr const char* only_shaded = "the image is a debug view: only shaded images have AOVs";
constexpr std::size_t max_reads = 16;
constexpr std::uint64_t max_denoiser_bytes = std::uint64_t{512} << 20U;

// Returns true if the whole image, including surfaces, consists of light samples.
bool is_traced(const render::Picture& picture) {
  return picture.view() == render::View::shaded && picture.layered() != render::Layered::beneath;
}

// The table of the programs and that of the layers agree.
static_assert(std::ranges::equal(
    settings::aovs, render::aov_values, {}, [](const settings::Aov& aov) { return aov.channels.size(); },
    &render::AovValues::count));

// The filter's guides need not be better than its samples, and rays would take longer than more samples, for less
// benefit. A network expects guides without noise.
std::uint32_t rays_to_denoise(const render::Picture& picture, bool by_network) {
  constexpr std::uint32_t min_filter_rays = 8;
  const std::uint32_t least = by_network ? render::feature_rays : min_filter_rays;
  return static_cast<std::uint32_t>(
      std::clamp<std::uint64_t>(2 * picture.samples_per_pixel(), least, render::max_feature_rays));
}

std::size_t pixels_of(const render::Picture& picture) { return std::size_t{picture.size().x} * picture.size().y; }

// Returns the display's backdrop, if any. Pixels outside the render region stay 0.
Backdrop backdrop_of(const render::Display& display, const render::Picture& picture) {
  return {picture.size(), picture.box(), display.transparent ? std::nullopt : display.backdrop};
}

// Throws Error(invalid_argument) if the array is too small.
void require_floats(const float* values, std::size_t count, std::size_t needed) {
  if (values == nullptr || count < needed)
    throw Error(ErrorCode::invalid_argument, "the image needs " + std::to_string(needed) + " floats");
}

// Fills in the model that the ray hit. pick.position is relative to the snapshot's origin.
void set_hit(Pick& pick, const render::ModelInstances& models, std::uint32_t triangle, const dvec3& ray) {
  const scene::ModelTable& table = models.table();
  const std::size_t record = table.record_of(triangle);
  const scene::Model& model = models.models().at(table.parts.at(record).model);
  const scene::ModelSource& source = *model.source;
  const scene::ModelMesh& mesh = source.meshes.at(table.parts[record].mesh);
  const surface::Scene& scene = *source.scene;
  const std::size_t index = 3 * (std::size_t{mesh.first_triangle} + triangle - table.records[record].first);
  const glm::dmat3 to_world(dvec3(table.records[record].to_world_x), dvec3(table.records[record].to_world_y),
                            dvec3(table.records[record].to_world_z));
  const dvec3 origin(table.records[record].origin);
  // Barycentric weights: areas of the triangles opposite to the corners.
  std::array<dvec3, 3> from_here;
  for (std::size_t i = 0; i < 3; ++i)
    from_here[i] = to_world * dvec3(source.pose.vertices[scene.indices[index + i]].position) + origin - pick.position;
  dvec3 normal(0.0);
  for (std::size_t i = 0; i < 3; ++i)
    normal += glm::length(glm::cross(from_here[(i + 1) % 3], from_here[(i + 2) % 3])) *
              dvec3(source.pose.vertices[scene.indices[index + i]].normal);
  normal = glm::transpose(glm::inverse(to_world)) * normal;
  if (!(glm::length(normal) > 0.0)) normal = glm::cross(from_here[1] - from_here[0], from_here[2] - from_here[0]);
  normal = glm::length(normal) > 0.0 ? glm::normalize(normal) : dvec3(0.0);
  const auto draw = std::ranges::find_if(scene.draws, [&](const surface::Draw& d) {
    return index >= d.first_index && index < std::size_t{d.first_index} + d.index_count;
  });
  const std::uint32_t material =
      surface::material_of(scene, source.pose, static_cast<std::size_t>(draw - scene.draws.begin()));
  pick.model = model.id;
  pick.surface =
      Pick::Surface{glm::dot(normal, ray) > 0.0 ? -normal : normal, material, scene.materials.at(material).name};
}

}  // namespace

void Backdrop::put_behind(std::span<float> rgba) const {
  if (!color) return;
  for (std::size_t i = 0; i < rgba.size(); ++i) {
    const std::size_t c = i % 4;
    const std::size_t pixel = i / 4;
    const bool made = box.holds({pixel % size.x, pixel / size.x});
    if (c != 3 && made) rgba[i] += (1.0F - rgba[i - c + 3]) * (*color)[static_cast<int>(c)];
  }
}

Pick Context::pick(const Shot& shot, double x, double y) {
  const auto& view = shot.view();
  if (scene_.data() == nullptr || !view || !(x >= 0.0 && y >= 0.0 && x < shot.size.x && y < shot.size.y)) return {};
  const glm::uvec2 pixel(static_cast<unsigned>(x), static_cast<unsigned>(y));
  const render::TraceInputs inputs = trace_inputs(shot);
  const render::Picked picked =
      progressive_.tracer().inspector().pick(*scene_.data(), parameters(shot, inputs), inputs, pixel);
  const double z = picked.z;
  if (!(z > 0.0)) return {};
  const double right = 2.0 * (pixel.x + 0.5) / shot.size.x - 1.0;
  const double up = 1.0 - 2.0 * (pixel.y + 0.5) / shot.size.y;
  const dvec3 aside = right * view->right + up * view->up;
  const dvec3 origin = view->orthographic ? view->eye + aside : view->eye;
  const dvec3 ray = view->orthographic ? view->forward : view->forward + aside;
  Pick pick;
  pick.hit = true;
  pick.position = origin + z * ray;
  pick.distance = z * glm::length(ray);
  if (picked.triangle) set_hit(pick, *scene_.models(), *picked.triangle, ray);
  pick.position += shot.scene->origin;
  if (!picked.volume) return pick;
  // Instances of one volume are consecutive.
  const std::vector<scene::Volume>& volumes = scene_.volumes();
  pick.volume = volumes.at(*picked.volume).id;
  const auto first = std::ranges::find_if(volumes, [&](const scene::Volume& v) { return v.id == pick.volume; });
  pick.transform_index = *picked.volume - static_cast<std::uint32_t>(first - volumes.begin());
  return pick;
}

render::Picture& Context::readable() {
  progressive_.settle();
  render::Picture* picture = progressive_.newest();
  if (picture == nullptr) throw Error(ErrorCode::invalid_argument, nothing_rendered);
  return *picture;
}

render::FilmValues Context::means_of(render::Picture& picture, bool with_background, std::vector<gl::Object>& drawn) {
  if (picture.layered() != render::Layered::beneath) return render::FilmValues::means(picture, with_background);
  drawn.push_back(draw_composite(picture, true));
  if (with_background) drawn.push_back(draw_composite(picture, false));
  return render::FilmValues::drawn(picture.size(), drawn.front().name(), with_background ? drawn.back().name() : 0);
}

void Context::read_means(render::Picture& picture, bool with_background, float* rgba) {
  std::vector<gl::Object> drawn;
  render::FilmReader(functions_).read(means_of(picture, with_background, drawn), rgba);
}

gl::Object Context::draw_composite(render::Picture& picture, bool transparent) {
  const glm::ivec2 size(picture.size());
  gl::Object flat = gl::make_texture_2d(functions_, GL_RGBA32F, size.x, size.y, "creating the texture to read");
  const gl::TransientFramebuffer framebuffer(functions_, flat.name(), 0);
  functions_->ClearTexImage(flat.name(), 0, GL_RGBA, GL_FLOAT, nullptr);
  render::Display display;
  display.transparent = transparent;
  display.encoding = render::ColorEncoding::hdr;
  render::FrameTarget target;
  target.framebuffer = framebuffer.name();
  target.viewport = {0, 0, size};
  target.region = picture.region();
  target.flip_y = true;  // the first row is the top
  target.blend_over = false;
  target.wait = render::Wait::always;
  composite(picture.film(), textures_of(picture, nullptr), display, target);
  gl::check(*functions_, "drawing the image to read");
  return flat;
}

render::Picture& Context::readable_shaded() {
  render::Picture& picture = readable();
  if (picture.view() != render::View::shaded) {
    throw Error(ErrorCode::invalid_argument, only_shaded);
  }
  return picture;
}

void Context::require_present(bool also) const {
  if (!also || scene_.data() == nullptr ||
      !progressive_.newest_is_of(scene_.data_revision(), scene_.instances_revision())) {
    throw Error(ErrorCode::invalid_argument,
                "the image is out of date: call cumulet_render until it shows the current scene");
  }
}

void Context::read_aov(const Shot& shot, Aov aov, float* values, std::size_t count) {
  render::Picture& picture = readable_shaded();
  const render::AovValues& values_of = render::aov_values.at(static_cast<std::size_t>(aov));
  require_floats(values, count, pixels_of(picture) * values_of.count);
  const render::FilmReader reader(functions_);
  if (const render::FeatureBuffer* buffer = render::feature_buffer_of(values_of.layer)) {
    find_features(shot, picture, buffer->set);
    reader.read_feature(picture, values_of, values);
    return;
  }
  std::vector<gl::Object> drawn;
  reader.read(accumulated_aov(picture, aov, drawn), values);
}

render::FilmValues Context::accumulated_aov(render::Picture& picture, Aov aov, std::vector<gl::Object>& drawn) {
  if (aov == Aov::beauty) return means_of(picture, false, drawn);
  if (aov != Aov::volume) return render::FilmValues::errors(picture);
  if (!picture.separate_volume_aov()) {
    throw Error(ErrorCode::invalid_argument,
                "the volume AOV was not rendered: set cumulet_sampling_desc.separate_volume_aov and render at full "
                "resolution");
  }
  return render::FilmValues::volume(picture);
}

void Context::read_light_group(const DisplaySettings& settings, std::uint32_t group, float* rgb, std::size_t count) {
  const render::FilmValues values = light_group_of(settings, readable(), group);
  require_floats(rgb, count, values.count());
  render::FilmReader(functions_).read(values, rgb);
}

render::FilmValues Context::light_group_of(const DisplaySettings& settings, const render::Picture& picture,
                                           std::uint32_t group) {
  if (group >= picture.light_groups()) {
    throw Error(ErrorCode::invalid_argument,
                "the image has " + std::to_string(picture.light_groups()) +
                    " light groups: set cumulet_sampling_desc.light_groups and render at full resolution");
  }
  return render::FilmValues::light_group(picture, group, settings.shown(false).shows_background());
}

void Context::read_mattes(const Shot& shot, const MatteIdOf& id_of, std::uint32_t ranks, float* values,
                          std::size_t count) {
  render::Picture& picture = readable_shaded();
  require_floats(values, count, pixels_of(picture) * 2 * ranks);
  require_present(true);
  render::MatteIds ids;
  MatteObject object;
  for (const scene::Volume& volume : scene_.volumes()) {
    // Instances of one volume are consecutive.
    object.transform_index = !ids.volumes.empty() && object.id == volume.id ? object.transform_index + 1 : 0;
    object.id = volume.id;
    ids.volumes.push_back((*volume.medium).holdout ? 0 : id_of(object));
  }
  const render::TraceInputs inputs = trace_inputs(shot);
  object = {.kind = MatteObject::Kind::surfaces};
  for (std::size_t i = 0; inputs.scene != nullptr && i < inputs.scene->models().size(); ++i) {
    const scene::Model& model = inputs.scene->models()[i];
    object.id = model.id;
    ids.models.push_back(model.holdout || model.shadow_only ? 0 : id_of(object));
  }
  if (*shot.scene->ground && !(**shot.scene->ground).shadow_catcher)
    ids.ground = id_of({.kind = MatteObject::Kind::ground});
  progressive_.tracer().feature_pass().read_mattes(picture, *scene_.data(), inputs, ids, ranks, values);
}

void Context::find_features(const Shot& shot, render::Picture& picture, render::FeatureSet features,
                            std::uint32_t rays) {
  // Motion vectors refer to the current scene.
  const bool of_now = features != render::FeatureSet::all || progressive_.newest_is_seen_as(*shot.scene);
  require_present(of_now);
  render::TraceInputs inputs = trace_inputs(shot);
  scene::MotionTable motion;
  if (features == render::FeatureSet::all) {
    motion = scene_.motion(*shot.scene);
    inputs.motion = &motion;
  }
  compositor_.begin_denoising_anew();
  while (!progressive_.tracer().feature_pass().find(picture, *scene_.data(), inputs, deadline_after(1000.0), rays,
                                                    features)) {
  }
}

bool Context::can_denoise(const render::Picture& picture) const {
  return is_traced(picture) && scene_.data() != nullptr &&
         progressive_.newest_is_of(scene_.data_revision(), scene_.instances_revision());
}

void Context::read_denoised(const Shot& shot, const Denoisers& by, float* rgba, std::size_t count) {
  render::Picture& picture = readable();
  if (!is_traced(picture)) {
    throw Error(ErrorCode::unsupported, "only shaded images with path-traced surfaces can be denoised");
  }
  require_floats(rgba, count, pixels_of(picture) * 4);
  find_features(shot, picture, render::FeatureSet::guides, rays_to_denoise(picture, by.any()));
  const render::Display display = shot.display.shown(false);
  const gl::Object denoised = by.any() ? by_network(shot, picture, by) : filtered(picture, display.shows_background());
  const glm::uvec2 size = picture.size();
  const render::PixelBox box = by.any() ? picture.box() : render::PixelBox{glm::uvec2(0U), size};
  std::vector<glm::vec4> pixels(box.area());
  functions_->GetTextureImage(denoised.name(), 0, GL_RGBA, GL_FLOAT,
                              static_cast<GLsizei>(pixels.size() * sizeof(glm::vec4)), pixels.data());
  gl::check(*functions_, "reading back the denoised image");
  std::fill_n(rgba, std::size_t{4} * size.x * size.y, 0.0F);
  for (std::size_t y = 0; y < box.size.y; ++y) {
    const std::size_t to = 4 * ((box.first.y + y) * size.x + box.first.x);
    std::memcpy(rgba + to, &pixels[y * box.size.x], box.size.x * sizeof(glm::vec4));
  }
  backdrop_of(display, picture).put_behind({rgba, pixels_of(picture) * 4});
}

gl::Object Context::by_network(const Shot& shot, const render::Picture& picture, const Denoisers& by) {
  const std::vector<scene::Volume>& volumes = shot.scene->volumes;
  render::Denoising denoising;
  denoising.network = by.network;
  denoising.library = by.library;
  denoising.with_background = shot.display.shown(false).shows_background();
  if (!volumes.empty()) denoising.medium_albedo = (*volumes.front().medium).albedo;
  denoising.known_light = !shot.scene->models.empty() || std::ranges::any_of(volumes, [](const scene::Volume& volume) {
    return volume.source->emits() || (*volume.medium).emission != glm::vec3(0.0F);
  });
  denoising.max_bytes = max_denoiser_bytes;
  return render::denoised(functions_, programs_, picture, denoising);
}

gl::Object Context::filtered(const render::Picture& picture, bool with_background) {
  const auto background = with_background ? render::MeansBackground::added : render::MeansBackground::left_out;
  render::PictureTextures textures = textures_of(picture, nullptr);
  textures.view.reset();  // read-back must not depend on previously displayed images
  const glm::ivec2 size(picture.size());
  gl::Object means = gl::make_texture_2d(functions_, GL_RGBA32F, size.x, size.y, "creating the denoised image");
  render::Wavelet wavelet(functions_, programs_);
  wavelet.able(textures, background, true);
  wavelet.begin(textures);
  while (!wavelet.work(textures, render::Deadline::max())) {
  }
  wavelet.give(textures, background, means.name(), 0);
  return means;
}

void Context::read_linear(const DisplaySettings& settings, float* rgba, std::size_t count) {
  render::Picture& picture = readable();
  require_floats(rgba, count, pixels_of(picture) * 4);
  const render::Display display = settings.shown(picture.view() != render::View::shaded);
  read_means(picture, display.shows_background(), rgba);
  backdrop_of(display, picture).put_behind({rgba, pixels_of(picture) * 4});
}

// ---- without waiting ----

void Context::begin_read(const DisplaySettings& settings, const ReadRequest& request, std::uint64_t number) {
  render::Picture* picture = progressive_.newest();
  if (picture == nullptr) throw Error(ErrorCode::invalid_argument, nothing_rendered);
  if (reads_.size() == max_reads)
    throw Error(ErrorCode::invalid_argument, std::to_string(max_reads) + " reads are pending: finish or cancel one");
  const bool shaded = picture->view() == render::View::shaded;
  if (!shaded && request.source != ReadRequest::Source::linear) throw Error(ErrorCode::invalid_argument, only_shaded);
  progressive_.tracer().order();
  std::vector<gl::Object> drawn;
  Backdrop backdrop;
  const auto values = [&] {
    if (request.source == ReadRequest::Source::light_group)
      return light_group_of(settings, *picture, request.light_group);
    if (request.source == ReadRequest::Source::aov) {
      if (render::feature_buffer_of(render::aov_values.at(static_cast<std::size_t>(request.aov)).layer) != nullptr)
        throw Error(ErrorCode::invalid_argument, "samples do not accumulate this AOV: use cumulet_read_aov");
      return accumulated_aov(*picture, request.aov, drawn);
    }
    const render::Display display = settings.shown(!shaded);
    backdrop = backdrop_of(display, *picture);
    return means_of(*picture, display.shows_background(), drawn);
  };
  reads_.emplace(number, Read{render::PendingRead(functions_, values()), backdrop});
}

ReadState Context::finish_read(std::uint64_t number, float* values, std::size_t count) {
  const auto found = reads_.find(number);
  if (found == reads_.end()) throw Error(ErrorCode::invalid_argument, "there is no read " + std::to_string(number));
  const render::PendingRead& pending = found->second.pending;
  const render::FilmValues& of = pending.values();
  if (values != nullptr) require_floats(values, count, of.count());
  const ReadState state{pending.ready(), of.size(), static_cast<std::uint32_t>(of.channels())};
  if (!state.ready || values == nullptr) return state;
  pending.take(values);
  found->second.backdrop.put_behind({values, of.count()});
  reads_.erase(found);
  return state;
}

render::Picture& Context::accumulating() {
  static_cast<void>(readable());
  return progressive_.accumulating();
}

std::size_t Context::accumulation_bytes() { return render::checkpoint_bytes(accumulating()); }

void Context::read_accumulation(std::span<std::byte> bytes) {
  const render::Picture& picture = accumulating();
  const std::size_t size = render::checkpoint_bytes(picture);
  if (bytes.size() < size)
    throw Error(ErrorCode::invalid_argument, "the accumulation needs " + std::to_string(size) + " bytes");
  render::save_checkpoint(*functions_, picture, bytes);
}

void Context::restore_accumulation(std::span<const std::byte> bytes) {
  static_cast<void>(accumulating());
  progressive_.restore(bytes);
}

}  // namespace cumulet::viewer
