#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gl/programs.hpp"
#include "render/allotment.hpp"
#include "render/feature_buffers.hpp"
#include "render/film.hpp"
#include "render/march_data.hpp"
#include "render/mattes.hpp"
#include "render/pace.hpp"
#include "render/parameters.hpp"
#include "render/pass_timer.hpp"
#include "render/path_kernels.hpp"
#include "render/picture_settings.hpp"
#include "render/region.hpp"
#include "render/surface_raster.hpp"
#include "render/trace_inputs.hpp"

namespace cumulet::render {

struct Totals {
  std::uint64_t samples = 0;
  std::uint64_t steps = 0;
  /// Root mean square over pixels of the standard error of luminance, divided by the mean luminance. Only pixels with
  /// two samples count; nullopt if there are none, or if the value is not finite.
  std::optional<double> noise;
};

/// Sample counts of the pixels: minimum, maximum and total.
struct Accumulated {
  std::uint32_t least = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t most = 0;
  std::uint64_t all = 0;
};

/// A progressive accumulation.
///
/// A tile is the set of pixels that the lanes sample at a time. There are at most as many lanes as pixels; a lane whose
/// pixel is done takes another pixel (persistent threads). A dispatch runs some blocks of lanes, those that have work.
/// In a dispatch a lane runs a bounded number of rounds and keeps its path for the next dispatch.
/// Samples come in passes: each pass ends in every tile before the next begins. A picture with a lane for every pixel
/// has one pass.
/// Each pixel belongs to one lane at a time and adds its samples in order. A sample that is started again gives the
/// same result. So the image depends only on parameters and sample count, not on tiles, lanes, budgets, timing, or when
/// results of dispatches arrive.
class Picture {
 public:
  [[nodiscard]] glm::uvec2 size() const { return size_; }
  /// The render region and its pixels; other pixels have no samples.
  [[nodiscard]] const Region& region() const { return region_; }
  [[nodiscard]] const PixelBox& box() const { return box_; }
  [[nodiscard]] const core::CmParameters& parameters() const { return parameters_; }
  /// Samples per pixel to reach.
  [[nodiscard]] std::uint32_t target_samples() const { return target_samples_; }
  [[nodiscard]] View view() const { return view_; }
  /// True if every pixel has a sample; with PictureSettings::previews_first, nearly every pixel.
  [[nodiscard]] bool complete() const { return complete_; }
  /// True if every pixel has its target samples, or the noise has reached its target.
  [[nodiscard]] bool done() const { return done_; }
  /// Samples per pixel at which the noise is first measured. It is measured again at each 1.41 times as many, rounded.
  /// The schedule does not depend on time, so that the same picture ends with the same samples.
  static constexpr std::uint32_t first_measured = 16;
  [[nodiscard]] std::optional<double> noise_target() const { return noise_target_; }
  [[nodiscard]] bool is_adaptive() const { return adaptive_; }
  /// True if some pixels may have no sample.
  [[nodiscard]] bool has_holes() const { return holes_; }
  [[nodiscard]] double progress() const;
  /// Camera paths that are known to be finished.
  [[nodiscard]] std::uint64_t samples() const { return samples_ ? samples_->finished : 0; }
  /// Finished camera paths with nonfinite radiance, which count as black.
  [[nodiscard]] std::uint64_t samples_not_finite() const { return samples_ ? samples_->not_finite : 0; }
  /// Mean number of samples per pixel, rounded down.
  [[nodiscard]] std::uint64_t samples_per_pixel() const;
  /// The surface pass that camera rays ended at. Do not call it with Layered::no.
  [[nodiscard]] const SurfaceLayers& layers() const { return *layers_; }
  [[nodiscard]] Layered layered() const { return layered_; }
  [[nodiscard]] bool separate_volume_aov() const { return volume_alone_; }
  /// Number of light groups with separate sums.
  [[nodiscard]] std::uint32_t light_groups() const { return light_groups_; }
  /// True if there are feature buffers that the denoiser can use (Tracer::find_features).
  [[nodiscard]] bool has_features() const;
  /// Feature rays per pixel so far, in pixels whose rays differ.
  [[nodiscard]] std::uint32_t rays_of_features() const { return feature_rays_; }
  /// Raises the number of samples, and sets the noise target of a picture that has one. Sampling continues from the
  /// current state.
  void extend(std::uint32_t samples, std::optional<double> noise_target);
  /// The layers that passes have written.
  [[nodiscard]] const Film& film() const { return film_; }
  [[nodiscard]] Film& film() { return film_; }
  /// Revision number; changes with every picture that is started.
  [[nodiscard]] std::uint64_t begun() const { return begun_; }
  /// Revision number; changes with every dispatch that adds to the picture.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  /// Revisions of the rows; null while the changes of some rows are unknown.
  [[nodiscard]] const RowRevisions* rows() const { return rows_->known() ? rows_.get() : nullptr; }
  [[nodiscard]] std::uint64_t bytes() const { return film_.bytes(); }

 private:
  friend class Tracer;
  core::CmParameters parameters_{};
  std::uint32_t target_samples_ = 1;
  View view_ = View::shaded;
  glm::uvec2 size_{0U};
  Region region_;
  PixelBox box_;
  Film film_;
  std::uint64_t begun_ = 0;
  std::uint64_t revision_ = 0;
  std::shared_ptr<RowRevisions> rows_ = std::make_shared<RowRevisions>();  // finished dispatches update it, as samples_
  // Marks all rows as changed.
  void change_all(std::uint64_t revision);
  bool volume_alone_ = false;
  std::uint32_t light_groups_ = 0;
  std::shared_ptr<const SurfaceLayers> layers_;  // from Tracer::drawn_layers_
  Layered layered_ = Layered::no;
  unsigned traced_ = 0;           // 0: no triangles; 1: paths hit triangles; 2: and NEE samples emissive ones
  bool second_lobe_ = false;      // the medium's phase function has two lobes
  bool channels_ = false;         // cells carry more than density
  bool environment_ = false;      // paths that escape hit an environment
  bool analytic_lights_ = false;  // there are lights to sample
  bool equiangular_ = false;      // NEE samples lights from points on the ray, too
  bool several_ = false;          // several volumes
  bool extended_bsdf_ = false;    // materials need CM_EXTENDED_BSDF (extended material model)
  bool volume_holdout_ = false;
  bool model_holdout_ = false;
  [[nodiscard]] glm::uvec2 tile_corner() const {
    return box_.first + glm::uvec2(tile_ % tiles_.x, tile_ / tiles_.x) * tile_size_;
  }
  [[nodiscard]] glm::uvec2 tile_extent() const { return glm::min(tile_size_, box_.first + box_.size - tile_corner()); }
  // Returns the target samples per pixel of the pass that follows one with target `samples`.
  [[nodiscard]] std::uint32_t pass_after(std::uint32_t samples) const;
  // True if each pixel has a lane of its own.
  [[nodiscard]] bool has_lanes_for_all() const;
  // True if the current pass ends with a measurement of the noise.
  [[nodiscard]] bool measures() const;
  // True if the tile's samples are done, and its error is to be measured.
  [[nodiscard]] bool awaits_error() const;
  // Continues from restored samples; discards dispatches in flight. pass: target of the pass in progress, needed if
  // sample counts do not determine it.
  void go_on_from(const Accumulated& told, std::optional<std::uint32_t> pass);
  // The tile's first adaptive-sampling block, among those of the picture.
  [[nodiscard]] glm::uvec2 first_square() const { return (tile_corner() - box_.first) / Allotment::edge; }
  [[nodiscard]] glm::uvec2 tile_squares() const { return (tile_extent() + Allotment::edge - 1U) / Allotment::edge; }
  void begin_tile();
  void end_tile();
  void end_pass();

  glm::uvec2 tile_size_{1U};
  glm::uvec2 tiles_{1U};
  std::uint32_t tile_ = 0;
  std::uint32_t lanes_ = 0;         // number of lanes
  std::shared_ptr<Blocks> blocks_;  // of the current tile and pass
  std::size_t block_ = 0;           // where the search for the next dispatch starts
  std::uint32_t pass_target_ = 1;
  // updated by finished dispatches, even if the picture was restarted in the meantime
  std::shared_ptr<SampleCount> samples_;
  std::uint32_t view_row_ = 0;  // debug views are rendered by rows
  bool previews_first_ = false;
  std::optional<double> noise_target_;
  bool motion_ = false;  // something moves while the shutter is open
  bool adaptive_ = false;
  Allotment allotment_;
  std::vector<std::uint32_t> squares_;  // sampled adaptive-sampling blocks of the current tile: glsl/path_blocks.glsl
  std::shared_ptr<SquareErrors> tile_errors_;  // of the current tile, once requested
  SquareErrors errors_;                        // of the picture, as far as this pass has come, if it is measured
  std::optional<double> noise_;                // of the last pass that was measured
  // Progress and sample count when the expected number of samples was last computed.
  double progress_before_ = 0.0;
  std::uint64_t samples_before_ = 0;
  double expected_samples_ = 1.0;  // of all pixels
  std::uint32_t pass_ = 0;         // number of the current pass
  bool holes_ = true;
  bool complete_ = false;
  bool done_ = false;
  // Next rows of the depth and feature passes.
  std::uint32_t depth_row_ = 0;
  std::uint32_t feature_row_ = 0;
  std::uint32_t feature_rays_ = 0;  // feature rays per pixel; rows before feature_row_ already have some more
  FeatureSet features_ = FeatureSet::guides;
};

/// Traces pictures by bounded dispatches over tiles. All calls need a current context and an active StateGuard.
class Tracer {
 public:
  Tracer(gl::FunctionsPtr gl, gl::ProgramsPtr programs)
      : gl_(gl), programs_(std::move(programs)), kernels_(gl), dispatches_in_flight_(gl), rasters_(std::move(gl)) {}

  /// Returns whether the programs that begin() needs with these settings are linked. Requests them if the driver
  /// compiles in parallel, and does not wait. Throws if a program does not build.
  bool able(const MarchData& data, const PictureParameters& parameters, const TraceInputs& trace_inputs,
            const PictureSettings& settings);
  /// Starts a new picture with this many samples per pixel. If it throws, the picture is unchanged or not complete.
  void begin(Picture& picture, const MarchData& data, const PictureParameters& parameters, std::uint32_t samples,
             const TraceInputs& trace_inputs, const PictureSettings& settings);
  /// Traces until about the deadline, and may return with dispatches in flight; only calls that read wait for them.
  /// Except for the first, no dispatch is sent that would probably end after the deadline. The picture that was last
  /// started or traced continues; any other restarts its in-flight paths. until_complete: stops once every pixel has a
  /// sample, if that was not so before. Returns whether the picture is done.
  bool trace(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
             bool until_complete = false);
  /// Computes the depth at half opacity until about the deadline; returns whether it is ready.
  bool trace_depth(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline);
  /// The pick result for one pixel.
  struct Picked {
    float z = 0.0F;  ///< view depth of the volume at half opacity, or of a triangle; 0: neither was hit
    /// if the volume was hit: index of the volume with the highest extinction there
    std::optional<std::uint32_t> volume;
    std::optional<std::uint32_t> triangle;  ///< if a triangle was hit: its number among those of all models
  };
  Picked pick(const MarchData& data, const PictureParameters& parameters, const TraceInputs& trace_inputs,
              glm::uvec2 pixel);
  /// Makes a picture of one transparent pixel over a black background, to be shown before the first picture.
  void clear(Picture& picture);
  /// Sets the background of a picture that clear() made.
  void set_background(Picture& picture, const glm::vec3& radiance);
  /// Draws the surface pass for a picture, unless another picture has the same one. begin() calls it; call it to show a
  /// picture of clear() over surfaces.
  void draw_layers(Picture& picture, const TraceInputs& trace_inputs, const PictureSettings& settings);

  /// Reads width * height * 4 floats: mean radiance, with or without the background's, and alpha; (0,0) is the top
  /// left.
  void read(const Picture& picture, bool with_background, float* rgba) const;
  /// Reads the samples that hit the volume before any surface, without background; alpha is their fraction.
  void read_volume(const Picture& picture, float* rgba) const;
  /// Reads width * height * 3 floats: mean radiance of a light group. with_background: including the sky and sun that
  /// cameras see directly, if they are in the group.
  void read_light_group(const Picture& picture, std::uint32_t group, bool with_background, float* rgb) const;
  /// Returns the size that save() writes; it is larger for an adaptive picture.
  [[nodiscard]] static std::size_t saved_bytes(const Picture& picture);
  /// Writes the state of a shaded picture's samples, for restore(). No dispatch of the picture may be in flight.
  void save(const Picture& picture, std::span<std::byte> bytes) const;
  /// Restores saved samples into a picture that was started like the saved one; it will end with the same result. A
  /// picture that is done is left unchanged. If the data do not match the picture, throws Error(invalid_argument) and
  /// leaves the picture unchanged.
  void restore(Picture& picture, std::span<const std::byte> saved);
  /// Reads the standard error of each pixel's luminance, background included; infinity for pixels with fewer than two
  /// samples.
  void read_error(const Picture& picture, float* errors) const;
  /// Renders the feature buffers of a picture until about the deadline. data, trace_inputs: those that the picture was
  /// started with. rays: minimum rays per pixel; beyond feature_rays it applies only to pixels whose rays differ.
  /// Returns whether they are ready. The next call continues.
  bool find_features(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
                     std::uint32_t rays, FeatureSet features = FeatureSet::guides);
  /// Like able(), for find_features() of guides.
  bool able_to_find(const Picture& picture, const MarchData& data, const TraceInputs& trace_inputs);
  /// Reads a feature buffer, channels_of(feature) floats per pixel, after find_features() has rendered it.
  void read_feature(const Picture& picture, FeatureBuffer feature, float* values) const;
  /// Renders and reads Cryptomatte (glsl/cryptomatte.comp): width * height * ranks pairs of floats, sorted by
  /// descending coverage. A pair is an ID as a float's bits and its coverage of the pixel. ranks: 1 to
  /// max_matte_ranks. data, trace_inputs: those that the picture was started with.
  void read_mattes(const Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, const MatteIds& ids,
                   std::uint32_t ranks, float* values);
  [[nodiscard]] Totals totals(const Picture& picture) const;
  /// Makes later commands of this context run after the in-flight dispatches, whichever context sent them. Does not
  /// wait.
  void order() const { dispatches_in_flight_.order(); }
  /// Waits for in-flight dispatches, so that everything known about the picture is exact.
  void settle(Picture& picture);
  /// Appends a record for every dispatch that ends, for tests.
  void set_log(std::vector<DispatchRecord>* log) { log_ = log; }
  /// GPU time of the trace, inspect and surface passes.
  [[nodiscard]] const PassSeconds& seconds() const { return seconds_; }
  /// Recent speed of the surface pass, in pixels per millisecond.
  [[nodiscard]] double raster_rate() const { return raster_rate_; }
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  /// Inputs of a surface pass; equal inputs give equal layers.
  struct LayersOf {
    std::shared_ptr<const void> content;
    SurfaceView view;
    SurfaceLighting lighting;
    glm::uvec2 size{0U};
    unsigned layers = 0;
    bool operator==(const LayersOf&) const = default;
  };
  struct DrawnLayers {
    LayersOf of;
    SurfaceLayers layers;
  };
  void drop_unused_layers();
  struct Program {
    const gl::Program* object = nullptr;
    std::shared_ptr<RoundCost> cost = std::make_shared<RoundCost>();
    // for rays beyond feature_rays, when most pixels are done
    std::shared_ptr<RoundCost> settled_cost = std::make_shared<RoundCost>();
  };
  // stages: the wavefront programs; nullopt: the program in use is the megakernel.
  void dispatch(Picture& picture, const TraceInputs& trace_inputs, const std::optional<StagePrograms>& stages,
                Dispatched what);
  // Dispatches the kernel that measures the error of a tile whose samples are done.
  void measure(Picture& picture, const TraceInputs& trace_inputs);
  // Processes finished dispatches.
  void collect();
  // Returns whether the surface pass is done, on drivers where a dispatch that reads it would wait for it.
  bool layers_ready(Deadline deadline);
  const Program& program(std::vector<std::string> defines, const char* name, std::span<const std::string> more = {});
  // Runs `find`, which looks up programs, in a mode that requests them without waiting. Returns whether all are linked.
  template <class Find>
  bool asked(Find&& find);
  // Looks up all programs that a picture is traced with.
  void find_programs(const Picture& picture, const MarchData& data, const TraceInputs& trace_inputs);
  // Sets the picture's fields that decide which programs it needs.
  static void classify(Picture& picture, const PictureParameters& parameters, const TraceInputs& trace_inputs,
                       const PictureSettings& settings);
  // Returns Picture::traced_ of a picture with these settings.
  static unsigned traced_of(const PictureParameters& parameters, const TraceInputs& trace_inputs,
                            const PictureSettings& settings);
  // Adds the macros that the holdouts, motion and light groups of a picture need.
  static void add_march(const Picture& picture, std::vector<std::string>& defines);
  static void add_groups(const Picture& picture, std::vector<std::string>& defines);
  static void add_medium(const Picture& picture, std::vector<std::string>& defines);
  // Returns the megakernel, or the wavefront stage whose cost estimate covers all stages.
  const Program& trace_program(const Picture& picture, const MarchData& data);
  StagePrograms stage_programs(const Picture& picture, const MarchData& data);
  const Program& inspect_program(const MarchData& data, const TraceInputs& trace_inputs, const char* name,
                                 std::span<const char* const> macros = {});
  const Program& feature_program(const Picture& picture, const MarchData& data, const TraceInputs& trace_inputs,
                                 FeatureSet features);
  const Program& matte_program(const Picture& picture, const MarchData& data, const TraceInputs& trace_inputs);
  // Runs inspect.comp, aovs.comp or cryptomatte.comp over the rows from `row` on, until done or about the deadline.
  bool inspect(const PixelBox& box, const core::CmParameters& parameters, const std::shared_ptr<RoundCost>& cost,
               std::uint32_t& row, Deadline deadline);
  // Runs a kernel with at_once more rays per pixel in each dispatch, until there are `wanted`. Returns whether it is
  // done; the next call continues.
  bool look_along_rays(const PixelBox& box, core::CmParameters parameters, const Program& program,
                       std::uint32_t at_once, std::uint32_t& rays, std::uint32_t wanted, std::uint32_t& row,
                       Deadline deadline);
  void make_shared_objects();
  void upload_motion(const scene::MotionTable& motion);
  // Clears the layers if a pass by rows does not write all pixels.
  void empty_around(const Picture& picture, std::span<const FilmLayer> layers) const;
  // Clears the layers that samples are added to. accumulated() lists them.
  void empty(Picture& picture, const glm::vec3& background, std::uint32_t samples);
  static std::vector<FilmLayer> accumulated(const Picture& picture);
  // Calls visit with each of these layers, its offset in the saved state, and its size there.
  template <class Visit>
  static void for_each_saved(const Picture& picture, Visit&& visit);
  bool accumulate(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
                  bool until_complete);
  void bind(const MarchData& data, const TraceInputs& trace_inputs) const;
  void read_means(const Picture& picture, const FilmLayer& sum, float* rgba) const;
  template <class Texel>
  [[nodiscard]] std::vector<Texel> texels(const Picture& picture, const FilmLayer& layer, GLenum format,
                                          GLenum type) const;
  [[nodiscard]] std::vector<glm::uvec2> read_counts(const Picture& picture) const;
  struct PixelError {
    std::uint32_t samples = 0;
    std::uint32_t steps = 0;
    double mean = 0.0;     // luminance
    double squared = 0.0;  // its squared standard error; valid with at least two samples
  };
  // Calls visit with each pixel's error, row by row.
  template <class Visit>
  void for_each_error(const Picture& picture, Visit&& visit) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  std::uint64_t revision_ = 0;                              // newest revision of its pictures
  std::optional<bool> asked_;                               // in asked(): whether all programs so far are linked
  std::map<gl::ProgramKey, Program> used_;                  // programs that this tracer has used, with their cost
  std::vector<std::shared_ptr<DrawnLayers>> drawn_layers_;  // shared by pictures
  PathKernels kernels_;
  std::weak_ptr<const Blocks> paths_of_;  // the tile whose paths the kernels hold
  gl::Object uniforms_;
  gl::Object pick_;         // depth of a pick...
  gl::Object pick_object_;  // ...and the object that it hit
  gl::Object motion_;       // TraceInputs::motion, for the feature pass in progress
  gl::Object errors_;       // errors of a tile
  InFlightDispatches dispatches_in_flight_;
  InFlightDispatches rasters_;
  std::vector<DispatchRecord>* log_ = nullptr;
  PassSeconds seconds_;
  double raster_rate_ = 2e4;
};

}  // namespace cumulet::render
