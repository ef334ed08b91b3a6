#include "render/film/picture.hpp"

#include <algorithm>

#include "gl/bindings.hpp"

namespace cumulet::render {

std::uint64_t Picture::samples_per_pixel() const { return samples() / std::max<std::uint64_t>(box().area(), 1); }

void Picture::extend(std::uint32_t samples, std::optional<double> noise_target) {
  if (view() == View::shaded) accumulation_.extend(samples, noise_target);
}

void Picture::set_layers(std::shared_ptr<const SurfaceLayers> layers, Layered layered) {
  layers_ = std::move(layers);
  features_.layered = layered;
}

void Picture::drop_layers() {
  layers_.reset();
  features_.layered = Layered::no;
}

std::vector<FilmLayer> Picture::accumulated_layers() const {
  std::vector<FilmLayer> layers{film_layers::radiance, film_layers::background, film_layers::moments,
                                film_layers::counts};
  if (separate_volume_aov()) layers.push_back(film_layers::volume);
  if (light_groups() > 0) layers.push_back(film_layers::light_groups(light_groups()));
  return layers;
}

void Picture::change_all(std::uint64_t revision) {
  revision_ = revision;
  rows_->change_all(size_.y, revision);
}

void Picture::begin(glm::uvec2 size, const Region& region, const PathFeatures& features) {
  Film film = std::move(film_);
  *this = Picture();
  film_ = std::move(film);
  film_.begin(size);
  size_ = size;
  region_ = region;
  features_ = features;
}

void Picture::start(const core::CmParameters& parameters, Accumulation accumulation, std::uint64_t revision) {
  parameters_ = parameters;
  accumulation_ = std::move(accumulation);
  change_all(revision);
  begun_ = revision;
}

void clear_samples(const gl::FunctionsPtr& gl, Picture& picture, const glm::vec3& background, std::uint32_t samples) {
  const auto clear = [&](Film& film, std::chrono::steady_clock::time_point) {
    const glm::vec4 zero(0.0F);
    const glm::vec4 behind(background, 0.0F);
    const glm::uvec2 count(samples, 0U);
    const glm::ivec2 first(picture.box().first);
    const glm::ivec2 extent(picture.box().size);
    const GLuint layer = film.texture(film_layers::background);
    gl->ClearTexImage(film.texture(film_layers::radiance), 0, GL_RGBA, GL_FLOAT, &zero);
    gl->ClearTexImage(layer, 0, GL_RGBA, GL_FLOAT, &zero);
    gl->ClearTexSubImage(layer, 0, first.x, first.y, 0, extent.x, extent.y, 1, GL_RGBA, GL_FLOAT, &behind);
    gl->ClearTexImage(film.texture(film_layers::moments), 0, GL_RED, GL_FLOAT, &zero);
    gl->ClearTexImage(film.texture(film_layers::counts), 0, GL_RG_INTEGER, GL_UNSIGNED_INT, &count);
    if (picture.separate_volume_aov())
      gl->ClearTexImage(film.texture(film_layers::volume), 0, GL_RGBA, GL_FLOAT, &zero);
    if (const std::uint32_t groups = picture.light_groups(); groups > 0)
      gl->ClearTexImage(film.texture(film_layers::light_groups(groups)), 0, GL_RGBA, GL_FLOAT, &zero);
    gl::check(*gl, "clearing the accumulation");
    return true;
  };
  const Pass pass{"cumulet: begin image", {}, picture.accumulated_layers(), clear};
  run(gl, picture.film(), pass, std::chrono::steady_clock::time_point::max());
}

void clear_outside_box(const gl::Functions& gl, const Picture& picture, std::span<const FilmLayer> layers) {
  if (picture.box().size == picture.size()) return;
  for (const FilmLayer& layer : layers) {
    const PixelTransfer transfer = transfer_of(layer);
    gl.ClearTexImage(picture.film().texture(layer), 0, transfer.format, transfer.type, nullptr);
  }
}

void bind_samples(const gl::Functions& gl, const Picture& picture) {
  const Film& film = picture.film();
  film.bind(gl, core::CM_IMAGE_SUM, film_layers::radiance, GL_READ_WRITE);
  film.bind(gl, core::CM_IMAGE_COUNTS, film_layers::counts, GL_READ_WRITE);
  film.bind(gl, core::CM_IMAGE_BACKGROUND, film_layers::background, GL_READ_WRITE);
  film.bind(gl, core::CM_IMAGE_MOMENTS, film_layers::moments, GL_READ_WRITE);
  // The image bound must match the format even if nothing writes it: inspect.comp has the depth there.
  film.bind(gl, core::CM_IMAGE_VOLUME_SUM, picture.separate_volume_aov() ? film_layers::volume : film_layers::depth,
            GL_READ_WRITE);
  if (const std::uint32_t groups = picture.light_groups(); groups > 0)
    film.bind(gl, core::CM_IMAGE_GROUPS, film_layers::light_groups(groups), GL_READ_WRITE);
}

}  // namespace cumulet::render
