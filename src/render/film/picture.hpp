#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/parameters.hpp"
#include "render/film/accumulation.hpp"
#include "render/film/feature_buffers.hpp"
#include "render/film/film.hpp"
#include "render/film/path_features.hpp"
#include "render/pacing/region.hpp"
#include "render/pacing/row_revisions.hpp"

namespace cumulet::render {

struct SurfaceLayers;

/// State of the pass that renders feature buffers.
struct FeatureProgress {
  std::uint32_t row = 0;   // the next row
  std::uint32_t rays = 0;  // rays per pixel, in pixels whose rays differ; rows before `row` already have some more
  FeatureSet set = FeatureSet::guides;
};

/// A progressive accumulation: its samples, and the textures that hold them.
class Picture {
 public:
  static constexpr std::uint32_t first_measured = Accumulation::first_measured;

  [[nodiscard]] glm::uvec2 size() const { return size_; }
  /// The render region and its pixels; other pixels have no samples.
  [[nodiscard]] const Region& region() const { return region_; }
  [[nodiscard]] const PixelBox& box() const { return accumulation_.box(); }
  [[nodiscard]] const core::CmParameters& parameters() const { return parameters_; }
  [[nodiscard]] const PathFeatures& features() const { return features_; }
  [[nodiscard]] View view() const { return features_.view; }
  [[nodiscard]] Layered layered() const { return features_.layered; }
  [[nodiscard]] bool separate_volume_aov() const { return features_.separate_volume_aov; }
  /// Number of light groups with separate sums.
  [[nodiscard]] std::uint32_t light_groups() const { return features_.light_groups; }

  [[nodiscard]] const Accumulation& accumulation() const { return accumulation_; }
  [[nodiscard]] Accumulation& accumulation() { return accumulation_; }
  [[nodiscard]] std::uint32_t target_samples() const { return accumulation_.target_samples(); }
  [[nodiscard]] bool complete() const { return accumulation_.complete(); }
  [[nodiscard]] bool done() const { return accumulation_.done(); }
  [[nodiscard]] std::optional<double> noise_target() const { return accumulation_.noise_target(); }
  [[nodiscard]] bool is_adaptive() const { return accumulation_.is_adaptive(); }
  [[nodiscard]] bool has_holes() const { return accumulation_.has_holes(); }
  [[nodiscard]] double progress() const { return accumulation_.progress(); }
  [[nodiscard]] std::uint64_t samples() const { return accumulation_.samples(); }
  [[nodiscard]] std::uint64_t samples_not_finite() const { return accumulation_.samples_not_finite(); }
  /// Mean number of samples per pixel, rounded down.
  [[nodiscard]] std::uint64_t samples_per_pixel() const;
  /// Accumulation::extend() of a shaded picture. Debug views are left unchanged.
  void extend(std::uint32_t samples, std::optional<double> noise_target);

  /// The surface pass that camera rays ended at. Do not call it with Layered::no.
  [[nodiscard]] const SurfaceLayers& layers() const { return *layers_; }
  /// Sets the surface pass. layered: how camera rays use it.
  void set_layers(std::shared_ptr<const SurfaceLayers> layers, Layered layered);
  void drop_layers();

  /// True if there are feature buffers that the denoiser can use (FeaturePass::find).
  [[nodiscard]] bool has_features() const { return film_.has(film_layers::normal); }
  /// Feature rays per pixel so far, in pixels whose rays differ.
  [[nodiscard]] std::uint32_t rays_of_features() const { return feature_progress_.rays; }
  [[nodiscard]] FeatureProgress& feature_progress() { return feature_progress_; }
  /// Next row of the depth pass.
  [[nodiscard]] std::uint32_t& depth_row() { return depth_row_; }
  /// Next row of a debug view.
  [[nodiscard]] std::uint32_t& view_row() { return view_row_; }

  /// The layers that passes have written.
  [[nodiscard]] const Film& film() const { return film_; }
  [[nodiscard]] Film& film() { return film_; }
  /// The layers that samples are added to.
  [[nodiscard]] std::vector<FilmLayer> accumulated_layers() const;
  [[nodiscard]] std::uint64_t bytes() const { return film_.bytes(); }

  /// Revision number; changes with every picture that is started.
  [[nodiscard]] std::uint64_t begun() const { return begun_; }
  /// Revision number; changes with every dispatch that adds to the picture.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  void set_revision(std::uint64_t revision) { revision_ = revision; }
  /// Sets the revision, and marks all rows as changed.
  void change_all(std::uint64_t revision);
  /// Revisions of the rows; null while the changes of some rows are unknown.
  [[nodiscard]] const RowRevisions* rows() const { return rows_->known() ? rows_.get() : nullptr; }
  /// Revisions of the rows. Dispatches update them, also after the picture was restarted.
  [[nodiscard]] const std::shared_ptr<RowRevisions>& row_revisions() const { return rows_; }

  /// Starts a new picture, which is not complete. Everything but the textures of the film is a fresh value.
  void begin(glm::uvec2 size, const Region& region, const PathFeatures& features);
  /// Sets the values that the samples of the new picture depend on.
  void start(const core::CmParameters& parameters, Accumulation accumulation, std::uint64_t revision);
  /// Sets the radiance of the background that clear_samples() has drawn.
  void set_background(const glm::vec3& radiance) { parameters_.lights.sky_radiance = radiance; }

 private:
  glm::uvec2 size_{0U};
  Region region_;
  PathFeatures features_;
  core::CmParameters parameters_{};
  Film film_;
  Accumulation accumulation_;
  std::shared_ptr<const SurfaceLayers> layers_;  // from LayerCache
  std::uint64_t begun_ = 0;
  std::uint64_t revision_ = 0;
  std::shared_ptr<RowRevisions> rows_ = std::make_shared<RowRevisions>();
  FeatureProgress feature_progress_;
  std::uint32_t depth_row_ = 0;
  std::uint32_t view_row_ = 0;
};

/// Clears the layers that samples are added to. background: radiance of the background within the box. samples: sample
/// count of all pixels.
void clear_samples(const gl::FunctionsPtr& gl, Picture& picture, const glm::vec3& background, std::uint32_t samples);
/// Clears the layers if a pass that writes the pixels of the box leaves others.
void clear_outside_box(const gl::Functions& gl, const Picture& picture, std::span<const FilmLayer> layers);
/// Binds the layers that samples are added to.
void bind_samples(const gl::Functions& gl, const Picture& picture);

}  // namespace cumulet::render
