#include "render/passes/feature_pass.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <vector>

#include "base/milliseconds.hpp"
#include "gl/bindings.hpp"

namespace cumulet::render {

namespace {

// llvmpipe silently ends a shader's loops after 65,535 iterations in total. These constants bound the iterations of a
// dispatch: a ray takes some thousand. Cryptomatte rays take more than feature rays.
constexpr std::uint32_t feature_rays_at_once = 2;
constexpr std::uint32_t matte_rays_at_once = 1;
constexpr int matte_slices = 16;  // as in cryptomatte.comp
static_assert(feature_rays % feature_rays_at_once == 0);

gl::ProgramKey buffers_key(const Picture& picture, const MarchData& data, const TraceInputs& trace_inputs,
                           FeatureSet set) {
  return feature_buffers_key(data, trace_inputs, set, picture.parameters().medium.emits != 0U);
}

}  // namespace

const FeatureBuffer* feature_buffer_of(const FilmLayer& layer) {
  const auto* found = std::ranges::find(feature_buffers, layer, &FeatureBuffer::layer);
  return found == feature_buffers.end() ? nullptr : found;
}

bool FeaturePass::able(const Picture& picture, const MarchData& data, const TraceInputs& trace_inputs) {
  return programs_.asked([&] { programs_.get(buffers_key(picture, data, trace_inputs, FeatureSet::guides)); });
}

bool FeaturePass::trace_rays(const PixelBox& box, core::CmParameters parameters, const TraceProgram& program, Rays rays,
                             std::uint32_t& count, std::uint32_t& row, Deadline deadline) {
  while (count < rays.wanted) {
    parameters.dispatch.rays_before = count;
    parameters.dispatch.samples = count + rays.at_once;
    const auto& cost = count < parameters.dispatch.rays_least ? program.cost : program.settled_cost;
    if (!dispatches_.run_rows(box, parameters, cost, row, deadline)) return false;
    count += rays.at_once;
    row = 0;
    if (count < rays.wanted && std::chrono::steady_clock::now() >= deadline) return false;
  }
  return true;
}

bool FeaturePass::find(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
                       std::uint32_t rays, FeatureSet features) {
  FeatureProgress& progress = picture.feature_progress();
  // A failed read may have requested more buffers.
  if (trace_inputs.motion == nullptr && !picture.film().has(film_layers::motion)) progress.set = FeatureSet::guides;
  if (progress.set < features) progress = {.set = features};
  if (progress.rays >= rays && picture.has_features()) return true;
  // Motion vectors need TraceInputs::motion. Without it only guides are refined.
  const FeatureSet found = trace_inputs.motion != nullptr ? progress.set : FeatureSet::guides;
  std::vector<FilmLayer> written;
  for (const FeatureBuffer& buffer : feature_buffers) {
    if (buffer.set <= found) written.push_back(buffer.layer);
  }
  const auto work = [&](const Film&, Deadline until) {
    return find_buffers(picture, data, trace_inputs, until, rays, found, written);
  };
  return run(gl_, picture.film(), {"cumulet: feature buffers", {}, written, work}, deadline);
}

bool FeaturePass::find_buffers(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs,
                               Deadline deadline, std::uint32_t rays, FeatureSet found,
                               std::span<const FilmLayer> written) {
  const Film& film = picture.film();
  dispatches_.order();
  const TraceProgram& program = programs_.get(buffers_key(picture, data, trace_inputs, found));
  dispatches_.use(*program.object, data, trace_inputs);
  for (const FeatureBuffer& buffer : feature_buffers) {
    if (buffer.set <= found) film.bind(*gl_, buffer.image, buffer.layer, buffer.access);
  }
  if (found == FeatureSet::all) {
    upload_motion(*trace_inputs.motion);
    gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_MOTION, motion_.name());
  }
  core::CmParameters parameters = with_current_inputs(picture.parameters(), trace_inputs);
  FeatureProgress& progress = picture.feature_progress();
  if (progress.row == 0 && progress.rays == 0) clear_outside_box(*gl_, picture, written);
  parameters.dispatch.rays_least = feature_rays;
  const std::uint32_t before = progress.rays;
  const bool done = trace_rays(picture.box(), parameters, program, {feature_rays_at_once, rays}, progress.rays,
                               progress.row, deadline);
  if (progress.rays != before) picture.set_revision(dispatches_.next_revision());
  return done;
}

void FeaturePass::upload_motion(const scene::MotionTable& motion) {
  std::vector<std::byte> bytes(sizeof motion.frame + motion.maps.size() * sizeof(core::CmMotion));
  std::memcpy(bytes.data(), &motion.frame, sizeof motion.frame);
  std::memcpy(bytes.data() + sizeof motion.frame, motion.maps.data(), bytes.size() - sizeof motion.frame);
  motion_ = gl::make_buffer(gl_, bytes.size(), bytes.data(), 0, "creating the motion table");
}

void FeaturePass::read_mattes(const Picture& picture, const MarchData& data, const TraceInputs& trace_inputs,
                              const MatteIds& ids, std::uint32_t ranks, float* values) {
  const gl::DebugGroup group(*gl_, "cumulet: Cryptomatte");
  std::vector<std::uint32_t> table{ids.ground};
  table.insert(table.end(), ids.volumes.begin(), ids.volumes.end());
  if (trace_inputs.scene != nullptr) {
    for (const scene::ModelPart& part : trace_inputs.scene->table().parts) table.push_back(ids.models.at(part.model));
  }
  const gl::Object buffer =
      gl::make_buffer(gl_, table.size() * sizeof(std::uint32_t), table.data(), 0, "creating the Cryptomatte table");
  dispatches_.order();
  const TraceProgram& program = programs_.get(mattes_key(data, trace_inputs, picture.features().motion));
  core::CmParameters parameters = with_current_inputs(picture.parameters(), trace_inputs);
  parameters.dispatch.rays_least = matte_rays;
  std::fill_n(values, std::size_t{2} * ranks * picture.size().x * picture.size().y, 0.0F);
  const PixelBox& box = picture.box();
  if (box.area() == 0) return;
  // Each pixel holds more ranks than are requested, so a few rows are processed at a time.
  constexpr std::uint32_t rows_at_once = 64;
  const glm::uvec2 size(box.size.x, std::min(box.size.y, rows_at_once));
  const gl::Object mattes =
      gl::make_texture_2d_array(gl_, GL_RGBA32F, static_cast<int>(size.x), static_cast<int>(size.y), matte_slices,
                                "creating the Cryptomatte texture");
  const std::size_t slices = (ranks + 1) / 2;
  std::vector<glm::vec2> pairs(size.x * size.y * 2 * slices);
  for (std::uint32_t from = 0; from < box.size.y; from += size.y) {
    const PixelBox part{box.first + glm::uvec2(0, from), glm::uvec2(size.x, std::min(size.y, box.size.y - from))};
    std::uint32_t row = 0;
    std::uint32_t rays = 0;
    dispatches_.use(*program.object, data, trace_inputs);
    gl_->BindImageTexture(core::CM_IMAGE_MATTES, mattes.name(), 0, GL_TRUE, 0, GL_READ_WRITE, GL_RGBA32F);
    gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_MATTES, buffer.name());
    while (
        !trace_rays(part, parameters, program, {matte_rays_at_once, matte_rays}, rays, row, deadline_after(1000.0))) {
    }
    gl_->GetTextureSubImage(mattes.name(), 0, 0, 0, 0, static_cast<GLsizei>(size.x), static_cast<GLsizei>(size.y),
                            static_cast<GLsizei>(slices), GL_RGBA, GL_FLOAT,
                            static_cast<GLsizei>(pairs.size() * sizeof(glm::vec2)), pairs.data());
    gl::check(*gl_, "reading Cryptomatte");
    for (std::uint32_t y = 0; y < part.size.y; ++y) {
      for (std::uint32_t x = 0; x < part.size.x; ++x) {
        const std::size_t pixel = std::size_t{part.first.y + y} * picture.size().x + part.first.x + x;
        for (std::uint32_t rank = 0; rank < ranks; ++rank) {
          const glm::vec2& pair = pairs[((rank / 2 * size.y + y) * size.x + x) * 2 + rank % 2];
          if (!(pair.y > 0.0F)) break;
          std::memcpy(values + 2 * (pixel * ranks + rank), &pair, sizeof pair);
        }
      }
    }
  }
}

}  // namespace cumulet::render
