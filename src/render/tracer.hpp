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
#include "render/environment_data.hpp"
#include "render/film.hpp"
#include "render/instance_data.hpp"
#include "render/lamp_data.hpp"
#include "render/march_data.hpp"
#include "render/model_data.hpp"
#include "render/pace.hpp"
#include "render/parameters.hpp"
#include "render/pass_timer.hpp"
#include "render/path_kernels.hpp"
#include "render/region.hpp"
#include "render/surface_raster.hpp"
#include "scene/motion.hpp"

namespace cumulet::render {

enum class View { shaded = 0, cells = 1, steps = 2, density = 3, wireframe = 4 };

struct Totals {
  std::uint64_t samples = 0;
  std::uint64_t steps = 0;
  /// Root of the mean over pixels of the squared standard error of their luminance, over the mean luminance: of those
  /// that have two samples. Nothing while none has, and it is unknown.
  std::optional<double> noise;
};

/// What paths end at, or find, beside the volume's data: the host's depth as render::HostDepth keeps it, triangles, an
/// environment, lamps, and where it stands, if that is in several places.
struct Obstacles {
  GLuint depth = 0;  // 0: none
  unsigned layers = 0;
  glm::uvec2 size{0U};
  const PlacedModels* scene = nullptr;
  bool traced = true;               // paths meet the scene's triangles; else only the surface pass knows of them
  SurfaceRaster* raster = nullptr;  // the surface pass, and what it is drawn with
  SurfaceView view;
  SurfaceLighting lighting;
  const EnvironmentData* environment = nullptr;  // of those that escape
  const LampData* lamps = nullptr;               // that paths look for: a scene's where they meet it, and the host's
  const InstanceData* instances = nullptr;       // where the volume is several; else it is the only one
  bool volume_holdout = false;                   // one of those is a hole to cameras
  bool model_holdout = false;                    // likewise of what they meet of the scene
  const scene::MotionTable* motion = nullptr;    // what facts of motion go by: not null where they are asked for

  /// The scene whose triangles paths meet; null: they meet none.
  [[nodiscard]] const PlacedModels* met() const { return traced ? scene : nullptr; }
  [[nodiscard]] std::uint32_t lamps_met() const { return lamps == nullptr ? 0 : lamps->count(); }
};

/// What camera rays of a picture do with the surface pass.
enum class Layered {
  no,       // nothing: they meet triangles, if any
  within,   // they end at it, with its colour
  beneath,  // they end at it; whoever shows the picture draws it beneath
};

struct PictureSettings {
  View view = View::shaded;
  /// The first pass leaves the last few pixels, those with the longest paths, to the second.
  bool hasty = false;
  Layered layered = Layered::no;
  glm::uvec2 layer_size{0U};
  unsigned layers = 1;
  /// Samples that meet the volume before any surface are summed apart, too.
  bool volume_alone = false;
  /// The picture is done once its noise (Totals::noise) is no more than this; none: once it has its samples.
  std::optional<double> noise_target;
  /// Up to that, pixels have the samples that they need for it (Allotment); else all the same.
  bool adaptive = false;
  /// That are gathered apart; 0: none.
  std::uint32_t light_groups = 0;
  /// The part of it that is made, and so many pixels around that. What follows is of this part.
  Region region;
  unsigned margin = 0;
};

/// What is known of a pixel without light: glsl/aovs.comp says of each what it is.
enum class PixelFact { transmittance, surface_z, volume_z, normal, albedo, velocity, motion, volume_motion };
constexpr std::size_t channels_of(PixelFact fact) {
  if (fact == PixelFact::motion || fact == PixelFact::volume_motion) return 2;
  return fact == PixelFact::normal || fact == PixelFact::albedo || fact == PixelFact::velocity ? 3 : 1;
}
/// Those of a pixel that are found together: what a filter asks for, or velocity and motion as well.
enum class PixelFacts { guides, all };

/// Rays a pixel that facts are means of, where they are read; a filter begins with few. Where they are not alike, as
/// triangles and shadows are finer than pixels, a filter gains by more, up to so many.
constexpr std::uint32_t fact_rays = 16;
constexpr std::uint32_t most_fact_rays = 64;

/// Rays a pixel that mattes are found by, and most ranks that there are.
constexpr std::uint32_t matte_rays = 64;
constexpr std::uint32_t most_matte_ranks = 16;

/// Ids of what can be seen (cryptomatte_id), 0 for what is in no matte. Of volumes in the order of what Picked::place
/// counts, and of models.
struct MatteIds {
  std::uint32_t ground = 0;
  std::vector<std::uint32_t> volumes;
  std::vector<std::uint32_t> models;
};

/// Samples that pixels have.
struct Accumulated {
  std::uint32_t least = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t most = 0;
  std::uint64_t all = 0;
};

/// One accumulation under way.
///
/// A tile is what lanes sample at a time, of which there are as many as its pixels at most: a lane whose pixel is done
/// takes another. A dispatch covers some blocks of lanes, those that have something to do, and in it a lane runs a
/// bounded number of rounds and keeps its path for the next. Samples come in passes that end in every tile before the
/// next begins (a picture whose pixels have a lane each has one pass). Each pixel belongs to one lane at a time and
/// adds its samples in order, and a sample that is begun anew ends the same: so the image depends on parameters and
/// sample count alone, not on tiles, lanes, budgets or timing, nor on when it is known what a dispatch did.
class Picture {
 public:
  [[nodiscard]] glm::uvec2 size() const { return size_; }
  /// The part of it that is made, and its pixels: others have no samples.
  [[nodiscard]] const Region& region() const { return region_; }
  [[nodiscard]] const PixelBox& box() const { return box_; }
  [[nodiscard]] const core::CmParameters& parameters() const { return parameters_; }
  /// That each pixel shall have.
  [[nodiscard]] std::uint32_t target_samples() const { return target_samples_; }
  [[nodiscard]] View view() const { return view_; }
  /// Whether every pixel (nearly every one, of a hasty picture) has a sample.
  [[nodiscard]] bool complete() const { return complete_; }
  /// Whether every pixel has its target samples, or the noise is down to its target.
  [[nodiscard]] bool done() const { return done_; }
  /// Fewest samples a pixel that the noise is looked at with. It is again at each 1.41 times as many, rounded: whatever
  /// the time, the same picture ends with the same samples.
  static constexpr std::uint32_t first_measured = 16;
  [[nodiscard]] std::optional<double> noise_target() const { return noise_target_; }
  [[nodiscard]] bool is_adaptive() const { return adaptive_; }
  /// Whether pixels without a sample may be left.
  [[nodiscard]] bool has_holes() const { return holes_; }
  [[nodiscard]] double progress() const;
  /// Camera paths that are known to be finished.
  [[nodiscard]] std::uint64_t samples() const { return samples_ ? samples_->finished : 0; }
  /// Those of them whose light was not finite: they count as black.
  [[nodiscard]] std::uint64_t samples_not_finite() const { return samples_ ? samples_->not_finite : 0; }
  /// Their mean, rounded down.
  [[nodiscard]] std::uint64_t samples_a_pixel() const;
  /// The surface pass that camera rays ended at. Not where layered is no.
  [[nodiscard]] const SurfaceLayers& layers() const { return *layers_; }
  [[nodiscard]] Layered layered() const { return layered_; }
  [[nodiscard]] bool volume_alone() const { return volume_alone_; }
  /// How many groups of lights are gathered apart.
  [[nodiscard]] std::uint32_t light_groups() const { return light_groups_; }
  /// Whether facts are there that a filter can do with (Tracer::find_facts).
  [[nodiscard]] bool has_facts() const;
  /// Rays a pixel that they are means of, where these are not alike.
  [[nodiscard]] std::uint32_t rays_of_facts() const { return facts_rays_; }
  /// Asks for this many samples, if that is more, and of a picture with a noise target for this noise: goes on where it
  /// was.
  void extend(std::uint32_t samples, std::optional<double> noise_target);
  /// What passes have made of it.
  [[nodiscard]] const Film& film() const { return film_; }
  [[nodiscard]] Film& film() { return film_; }
  /// Another with every picture that is begun.
  [[nodiscard]] std::uint64_t begun() const { return begun_; }
  /// Another with everything that was sent off to be added to it.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  /// When its rows changed; null where that is not known yet of some.
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
  std::shared_ptr<RowRevisions> rows_ = std::make_shared<RowRevisions>();  // dispatches tell it, as samples_
  // All of it is another.
  void change_all(std::uint64_t revision);
  bool volume_alone_ = false;
  std::uint32_t light_groups_ = 0;
  std::shared_ptr<const SurfaceLayers> layers_;  // of Tracer::drawn_layers_
  Layered layered_ = Layered::no;
  unsigned traced_ = 0;       // 1: paths meet triangles; 2: and look for those that emit
  bool second_lobe_ = false;  // of the medium's phase function
  bool channels_ = false;     // its cells carry more than density
  bool environment_ = false;  // paths that escape come to one
  bool lamps_ = false;        // paths that meet no triangles look for lamps
  bool equiangular_ = false;  // and from points of flights
  bool several_ = false;      // volumes
  bool rich_ = false;         // materials that need CM_RICH
  bool volume_holdout_ = false;
  bool model_holdout_ = false;
  [[nodiscard]] glm::uvec2 tile_corner() const {
    return box_.first + glm::uvec2(tile_ % tiles_.x, tile_ / tiles_.x) * tile_size_;
  }
  [[nodiscard]] glm::uvec2 tile_extent() const { return glm::min(tile_size_, box_.first + box_.size - tile_corner()); }
  // Samples of each pixel after a pass that ends with so many.
  [[nodiscard]] std::uint32_t pass_after(std::uint32_t samples) const;
  // Whether each pixel has a lane of its own.
  [[nodiscard]] bool has_lanes_for_all() const;
  // Whether the pass under way ends with a look at the noise.
  [[nodiscard]] bool measures() const;
  // Whether it is time to find the tile's error.
  [[nodiscard]] bool awaits_error() const;
  // It has these samples; what was under way is none of it. pass: that it was in, where samples do not tell.
  void go_on_from(const Accumulated& told, std::optional<std::uint32_t> pass);
  // A square of the tile, counted among the picture's.
  [[nodiscard]] glm::uvec2 first_square() const { return (tile_corner() - box_.first) / Allotment::edge; }
  [[nodiscard]] glm::uvec2 tile_squares() const { return (tile_extent() + Allotment::edge - 1U) / Allotment::edge; }
  void begin_tile();
  void end_tile();
  void end_pass();

  glm::uvec2 tile_size_{1U};
  glm::uvec2 tiles_{1U};
  std::uint32_t tile_ = 0;
  std::uint32_t lanes_ = 0;         // that there are
  std::shared_ptr<Blocks> blocks_;  // of the tile and pass under way
  std::size_t block_ = 0;           // where the next dispatch looks for some
  std::uint32_t pass_target_ = 1;
  std::shared_ptr<SampleCount> samples_;  // dispatches count them, even for a picture begun anew meanwhile
  std::uint32_t view_row_ = 0;            // a debug view is made by rows
  bool hasty_ = false;
  std::optional<double> noise_target_;
  bool motion_ = false;  // something moves while the shutter is open
  bool adaptive_ = false;
  Allotment allotment_;
  std::vector<std::uint32_t> squares_;         // of the tile under way that are sampled: glsl/path_blocks.glsl
  std::shared_ptr<SquareErrors> tile_errors_;  // of the tile under way, once it was asked for
  SquareErrors errors_;          // of the picture's squares, as far as this pass has come, where it is measured
  std::optional<double> noise_;  // as of the last pass that was looked at
  // Progress: what it was when it was last known how many samples it would take, and then.
  double progress_before_ = 0.0;
  std::uint64_t samples_before_ = 0;
  double expected_samples_ = 1.0;  // of all pixels
  std::uint32_t pass_ = 0;         // the one under way
  bool holes_ = true;
  bool complete_ = false;
  bool done_ = false;
  // Rows that the depth and facts passes have come to.
  std::uint32_t depth_row_ = 0;
  std::uint32_t facts_row_ = 0;
  std::uint32_t facts_rays_ = 0;  // that facts are of, and those of rows before that one of some more
  PixelFacts facts_ = PixelFacts::guides;
};

/// Traces pictures by bounded dispatches over tiles. All calls need the context current and a StateGuard around.
class Tracer {
 public:
  Tracer(gl::FunctionsPtr gl, gl::ProgramsPtr programs)
      : gl_(gl), programs_(std::move(programs)), kernels_(gl), flights_(gl), rasters_(std::move(gl)) {}

  /// Whether the programs are there that begin() with these settings needs, without waiting for a driver that compiles
  /// them in parallel; where it does not, they will be. Throws if one does not build.
  bool able(const MarchData& data, const PictureParameters& parameters, const Obstacles& obstacles,
            const PictureSettings& settings);
  /// Starts a picture anew, of so many samples a pixel. Throws with the picture as it was, or not complete.
  void begin(Picture& picture, const MarchData& data, const PictureParameters& parameters, std::uint32_t samples,
             const Obstacles& obstacles, const PictureSettings& settings);
  /// Traces until about the deadline, and returns with dispatches under way: no call but those that read waits for
  /// them. No dispatch is sent that would likely end after the deadline, but for the first. The last picture begun or
  /// traced goes on; another loses the paths under way. until_complete: no further than every pixel's first sample, if
  /// that was not there before. Returns whether every pixel has its target samples.
  bool trace(Picture& picture, const MarchData& data, const Obstacles& obstacles, Deadline deadline,
             bool until_complete = false);
  /// Finds the depth at half opacity until about the deadline; returns whether it is there.
  bool trace_depth(Picture& picture, const MarchData& data, const Obstacles& obstacles, Deadline deadline);
  /// One pixel of a picture with these parameters.
  struct Picked {
    float z = 0.0F;                         ///< view depth at half opacity, or of a triangle; 0: neither is there
    std::optional<std::uint32_t> place;     ///< where it is the first: of which volume there is most
    std::optional<std::uint32_t> triangle;  ///< where it is the second: its number among those of all models
  };
  Picked pick(const MarchData& data, const PictureParameters& parameters, const Obstacles& obstacles, glm::uvec2 pixel);
  /// A picture of one transparent pixel, before a black background: what there is before the first.
  void clear(Picture& picture);
  /// Of clear's picture.
  void set_background(Picture& picture, const glm::vec3& radiance);
  /// Draws the surface pass for a picture, unless another picture has the same; begin does, and who shows one of
  /// clear's with the surfaces beneath.
  void draw_layers(Picture& picture, const Obstacles& obstacles, const PictureSettings& settings);

  /// width * height * 4 floats: mean radiance, with the background's or without, and alpha; (0,0) top left.
  void read(const Picture& picture, bool with_background, float* rgba) const;
  /// The same without background of samples that met the volume before any surface; alpha is their share.
  void read_volume(const Picture& picture, float* rgba) const;
  /// width * height * 3 floats: mean radiance of a group of lights that the picture has, with what of the background is
  /// of it or without.
  void read_light_group(const Picture& picture, std::uint32_t group, bool with_background, float* rgb) const;
  /// How many bytes save writes: of an adaptive picture more.
  [[nodiscard]] static std::size_t saved_bytes(const Picture& picture);
  /// All that a shaded picture's samples have come to, for restore. Nothing of it may be under way.
  void save(const Picture& picture, std::span<std::byte> bytes) const;
  /// A picture that was begun as the saved one was has its samples from now on, and will end as that. One that is done
  /// is left so. Throws Error(invalid_argument), with the picture as it was, for what was not saved of such a one.
  void restore(Picture& picture, std::span<const std::byte> saved);
  /// Standard error of each pixel's luminance, with the background's; infinite where it has fewer than two samples.
  void read_error(const Picture& picture, float* errors) const;
  /// Until about the deadline, the layers of PixelFact of this picture, data and obstacles being those it was made of;
  /// whether they are there, of at least so many rays a pixel, beyond fact_rays where they are not alike. Goes on in
  /// the next call.
  bool find_facts(Picture& picture, const MarchData& data, const Obstacles& obstacles, Deadline deadline,
                  std::uint32_t rays, PixelFacts facts = PixelFacts::guides);
  /// As able(), for find_facts() of guides.
  bool able_to_find(const Picture& picture, const MarchData& data, const Obstacles& obstacles);
  /// A fact a pixel (PixelFact), each channels_of(fact) floats, once find_facts has found them.
  void read_fact(const Picture& picture, PixelFact fact, float* values) const;
  /// width * height * ranks pairs of floats, an id as a float's bits and the share of the pixel that it has, the
  /// largest first: glsl/cryptomatte.comp. Found anew in each call. ranks: 1 to most_matte_ranks; data and obstacles
  /// being those that the picture was made of.
  void read_mattes(const Picture& picture, const MarchData& data, const Obstacles& obstacles, const MatteIds& ids,
                   std::uint32_t ranks, float* values);
  [[nodiscard]] Totals totals(const Picture& picture) const;
  /// What this context does from now on comes after what is under way, whichever made that. Waits for nothing.
  void order() const { flights_.order(); }
  /// Waits for what is under way, so that all that is known of the picture is exact.
  void settle(Picture& picture);
  /// Every dispatch that ends is told; for tests.
  void set_log(std::vector<DispatchRecord>* log) { log_ = log; }
  /// Trace, inspect and surfaces.
  [[nodiscard]] const PassSeconds& seconds() const { return seconds_; }
  /// Pixels a millisecond that the surface pass drew lately.
  [[nodiscard]] double raster_rate() const { return raster_rate_; }
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  /// What a surface pass was drawn of and for: the same of the same.
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
    std::shared_ptr<RoundCost> settled_cost = std::make_shared<RoundCost>();  // where most pixels have done with it
  };
  // stages: what paths among triangles are run by; without them the program in use is the one kernel.
  void dispatch(Picture& picture, const Obstacles& obstacles, const std::optional<StagePrograms>& stages,
                Dispatched what);
  // Sends what finds the error of a tile whose samples are done.
  void measure(Picture& picture, const Obstacles& obstacles);
  // Takes up what has ended.
  void collect();
  // Whether the surface pass is done, where a dispatch that reads it would wait for it.
  bool layers_ready(Deadline deadline);
  const Program& program(std::vector<std::string> defines, const char* name, std::span<const std::string> more = {});
  // Whether these are there: they are asked for, not waited for, while find looks them up.
  template <class Find>
  bool asked(Find&& find);
  // All that a picture is traced with.
  void find_programs(const Picture& picture, const MarchData& data, const Obstacles& obstacles);
  // What paths of a picture with these settings meet.
  // What of a picture decides which programs make it.
  static void classify(Picture& picture, const PictureParameters& parameters, const Obstacles& obstacles,
                       const PictureSettings& settings);
  static unsigned traced_of(const PictureParameters& parameters, const Obstacles& obstacles,
                            const PictureSettings& settings);
  // The one kernel, or what the paths' time goes by where they are run by stages.
  static void add_march(const Picture& picture, std::vector<std::string>& defines);
  static void add_groups(const Picture& picture, std::vector<std::string>& defines);
  static void add_medium(const Picture& picture, std::vector<std::string>& defines);
  const Program& trace_program(const Picture& picture, const MarchData& data);
  StagePrograms stage_programs(const Picture& picture, const MarchData& data);
  const Program& inspect_program(const MarchData& data, const Obstacles& obstacles, const char* name,
                                 std::span<const char* const> macros = {});
  const Program& facts_program(const Picture& picture, const MarchData& data, const Obstacles& obstacles,
                               PixelFacts facts);
  const Program& matte_program(const Picture& picture, const MarchData& data, const Obstacles& obstacles);
  // One of inspect.comp, aovs.comp or cryptomatte.comp over rows from `row` on, until done or about the deadline.
  bool inspect(const PixelBox& box, const core::CmParameters& parameters, const std::shared_ptr<RoundCost>& cost,
               std::uint32_t& row, Deadline deadline);
  // The same of a kernel that looks along rays, so many in a dispatch, until as many are as are wanted.
  bool look_along_rays(const PixelBox& box, core::CmParameters parameters, const Program& program,
                       std::uint32_t at_once, std::uint32_t& rays, std::uint32_t wanted, std::uint32_t& row,
                       Deadline deadline);
  void make_shared_objects();
  void upload_motion(const scene::MotionTable& motion);
  // What a pass by rows will write is 0 where it does not come to.
  void empty_around(const Picture& picture, std::span<const FilmLayer> layers) const;
  // The pass that empties what samples are added to, and what all is that.
  void empty(Picture& picture, const glm::vec3& background, std::uint32_t samples);
  static std::vector<FilmLayer> accumulated(const Picture& picture);
  // Calls visit with each of these, where it stands in what is saved, and its bytes there.
  template <class Visit>
  static void for_each_saved(const Picture& picture, Visit&& visit);
  bool accumulate(Picture& picture, const MarchData& data, const Obstacles& obstacles, Deadline deadline,
                  bool until_complete);
  void bind(const MarchData& data, const Obstacles& obstacles) const;
  void read_means(const Picture& picture, const FilmLayer& sum, float* rgba) const;
  template <class Texel>
  [[nodiscard]] std::vector<Texel> texels(const Picture& picture, const FilmLayer& layer, GLenum format,
                                          GLenum type) const;
  [[nodiscard]] std::vector<glm::uvec2> read_counts(const Picture& picture) const;
  struct PixelError {
    std::uint32_t samples = 0;
    std::uint32_t steps = 0;
    double mean = 0.0;     // luminance
    double squared = 0.0;  // its standard error, squared; counts where there are two samples
  };
  // Calls visit with each pixel's, row by row.
  template <class Visit>
  void for_each_error(const Picture& picture, Visit&& visit) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  std::uint64_t revision_ = 0;                              // the newest of its pictures'
  std::optional<bool> asked_;                               // in asked(): whether all so far are there
  std::map<gl::ProgramKey, Program> used_;                  // those that this one used, and what they cost
  std::vector<std::shared_ptr<DrawnLayers>> drawn_layers_;  // pictures share them
  PathKernels kernels_;
  std::weak_ptr<const Blocks> paths_of_;  // the tile that they are of
  gl::Object uniforms_;
  gl::Object pick_;        // its depth...
  gl::Object pick_place_;  // ...and what has been met
  gl::Object motion_;      // Obstacles::motion, as facts under way have it
  gl::Object errors_;      // a tile's
  Flights flights_;
  Flights rasters_;
  std::vector<DispatchRecord>* log_ = nullptr;
  PassSeconds seconds_;
  double raster_rate_ = 2e4;
};

}  // namespace cumulet::render
