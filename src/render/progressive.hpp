#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/error.hpp"
#include "base/revision.hpp"
#include "render/host_depth.hpp"
#include "render/schedule.hpp"
#include "render/tracer.hpp"
#include "scene/snapshot.hpp"

namespace cumulet::render {

/// What a picture shall show.
struct PictureWish {
  /// What samples depend on: where it changes, a picture is begun anew. Values are the newest there are; what comes to
  /// GL by and by is known by its revision there.
  struct Content {
    scene::Part<std::optional<scene::Viewpoint>> viewpoint;
    scene::Part<scene::Previous> previous;
    scene::Part<std::optional<scene::ViewEnds>> view_ends;
    scene::Part<light::DistantLights> lights;
    scene::Part<light::Surroundings> surroundings;
    scene::Part<light::Lamps> lamps;
    scene::Part<std::optional<scene::Ground>> ground;
    std::vector<scene::Volume> volumes;  // without sources and frames: what is there of them is data
    Revision<MarchData> data;
    Revision<InstanceData> instances;
    Revision<ModelData> model;
    Revision<EnvironmentData> environment;
    Revision<HostDepth> host_depth;
    Revision<gl::Programs> programs;
    core::CmIntegrator integrator{};
    glm::uvec2 size{0U};  // full resolution
    Region region;        // that is made of it
    View view = View::shaded;
    bool surfaces_traced = true;     // paths meet triangles
    bool preview = true;             // coarse first; else at full resolution only
    bool volume_alone = false;       // at full resolution, sum what met the volume first apart as well
    std::uint32_t light_groups = 0;  // likewise, the radiance of so many groups of lights
    bool stops_by_noise = false;     // there is a noise target
    bool adaptive = false;           // and samples go where there is most noise
    bool operator==(const Content&) const = default;
    /// Whether but the view, the host's depth and how pictures are made are the same.
    [[nodiscard]] bool shows_same(const Content& other) const;
  };
  Content content;
  PictureParameters parameters;        // of the content, at full resolution
  scene::SequenceFrames frames;        // that the data are of
  std::uint32_t samples = 1;           // a pixel
  std::optional<double> noise_target;  // at full resolution: enough, whatever the samples
  bool depth = false;                  // find the volume's depth at half opacity as well
  bool guides = false;                 // and facts of pixels, for a filter
  bool held = false;                   // a hand is at what changes it: another change is likely
};

/// Keeps the newest whole picture to show while the next is under way: after a change a coarse one that fits the time
/// of a frame, then ones of twice the resolution, then the full one, which goes on to its target samples. Each coarse
/// one is shown as soon as it is whole and goes on to a few samples a pixel, at most a quarter of what a sample a pixel
/// of the full one takes: so it is worth looking at while the next, which takes longer, is made. As long as
/// wishes change faster than a coarse picture takes, each is finished before the newest wish is taken up. Once they
/// rest, one over a coarse surface pass is given up for one over a pass of full size, which those after it share. All
/// calls need the context current and a StateGuard around.
class Progressive {
 public:
  /// Layers of the surface pass, and their size, for pictures that are to be there soon. At rest never coarser than the
  /// picture, else (in motion) than half of it: most of what a coarser one would cost is the vertices.
  static PictureSettings quick_layers(const Tracer& tracer, glm::uvec2 size, double budget_ms, bool rests);

  Progressive(gl::FunctionsPtr gl, gl::ProgramsPtr programs) : tracer_(std::move(gl), std::move(programs)) {}

  /// Works on the wish until about the deadline. Throws once where a picture cannot be made, and goes on with what
  /// there is, or coarser, later.
  void advance(const PictureWish& wish, const MarchData& data, const Obstacles& obstacles, Deadline deadline,
               double budget_ms);
  /// Forgets all pictures.
  void reset();

  /// The newest whole picture; null before the first.
  [[nodiscard]] Picture* shown() const { return shown_ ? shown_->picture : nullptr; }
  /// The same for all pictures of what was wished when it was begun.
  [[nodiscard]] std::uint64_t shown_wish() const { return shown_ ? shown_->wish : 0; }
  /// Of sequences, the frames that it shows.
  [[nodiscard]] scene::SequenceFrames shown_frames() const { return shown_ ? shown_->frames : scene::SequenceFrames(); }
  /// The same for all pictures of the same scene, from wherever.
  [[nodiscard]] std::uint64_t shown_scene() const { return shown_ ? shown_->scenes : 0; }
  /// What was shown before, where that may have pixels without a sample; else null.
  [[nodiscard]] const Picture* before() const { return shown_ && shown_->picture->has_holes() ? before_ : nullptr; }
  /// Waits for what is under way, so that what is read back is all there is.
  void settle();
  /// What is to be read back: without preview the picture under way.
  [[nodiscard]] Picture* newest() { return newest_work() ? newest_work()->picture : nullptr; }
  /// The picture under way where nothing but its samples makes it: a shaded one at full resolution, without previews.
  /// Throws Error(invalid_argument) where there is none.
  [[nodiscard]] Picture& accumulating();
  /// That goes on from what Tracer::save gave. Throws Error(invalid_argument) likewise, and for what is not of it.
  void restore(std::span<const std::byte> saved);
  /// Whether that is of these data, where they stand now.
  [[nodiscard]] bool newest_is_of(Revision<MarchData> data, Revision<InstanceData> instances) const {
    return newest_work() && newest_work()->data == data && newest_work()->instances == instances;
  }
  /// Whether it is of the view, and of where things were before it, that the scene has now.
  [[nodiscard]] bool newest_is_seen_as(const scene::Snapshot& scene) const {
    return newest_work() && newest_work()->wish == wishes_ && wish_.content.viewpoint == scene.view &&
           wish_.content.previous == scene.previous;
  }
  [[nodiscard]] Schedule::State state() const { return schedule_.state(); }
  /// Whether pictures may come coarse first, and need not be the same whatever was before.
  [[nodiscard]] bool previews() const { return wish_.content.preview; }
  [[nodiscard]] bool converged() const;
  /// Whether no picture of the wish is shown yet, but one is to come.
  [[nodiscard]] bool owes_picture() const;
  /// Whether advance has anything left to do.
  [[nodiscard]] bool more() const;
  /// Part of the work on the wish that is done, 0 to 1: never less than before, as long as the wish is the same.
  [[nodiscard]] double progress() const;
  [[nodiscard]] Tracer& tracer() { return tracer_; }
  [[nodiscard]] const Tracer& tracer() const { return tracer_; }
  [[nodiscard]] std::uint64_t bytes() const;
  /// Seconds spent on the picture at full resolution.
  [[nodiscard]] double trace_seconds() const { return trace_seconds_; }

 private:
  // Samples a pixel of a picture with that divisor that take it to the next.
  [[nodiscard]] std::uint32_t enough(std::uint32_t divisor) const;
  [[nodiscard]] glm::uvec2 size_of(std::uint32_t divisor) const;
  // That are made of a picture with that divisor; and how many beyond the region, for those that are enlarged.
  [[nodiscard]] double pixels_of(std::uint32_t divisor) const;
  [[nodiscard]] unsigned margin_of(std::uint32_t divisor) const;
  [[nodiscard]] bool is_enough() const;
  // A picture, and what it is of.
  struct Work {
    Picture* picture = nullptr;
    Revision<MarchData> data;
    Revision<InstanceData> instances;
    std::uint32_t divisor = 1;              // of the resolution
    std::shared_ptr<const void> scene;      // PlacedModels::numbering() of the triangles that its paths meet
    Revision<EnvironmentData> environment;  // that they escape to
    scene::SequenceFrames frames;
    std::uint64_t wish = 0;    // that it is of
    std::uint64_t scenes = 0;  // that there had been
  };
  [[nodiscard]] const std::optional<Work>& newest_work() const {
    return wish_.content.preview || !working_ ? shown_ : working_;
  }
  [[nodiscard]] std::uint32_t coarsest(double budget_ms) const;
  [[nodiscard]] PictureSettings settings(std::uint32_t divisor, const Obstacles& obstacles, double budget_ms,
                                         bool still) const;
  // Whether what is under way is over a coarser surface pass than what rests shall be.
  [[nodiscard]] bool blurs() const;
  // Whether start() can begin; until then there is what there was.
  bool able(const MarchData& data, const Obstacles& obstacles, const PictureSettings& settings);
  Picture& acquire(glm::uvec2 size);
  void start(std::uint32_t divisor, const MarchData& data, const Obstacles& obstacles, const PictureSettings& settings);
  [[nodiscard]] bool needs_depth() const;
  // Rays that guides are of by now: the more samples a picture has, the more can be lost by guides that are rough.
  [[nodiscard]] std::uint32_t guide_rays(const Work& work) const;
  [[nodiscard]] bool needs_guides(const Work& work) const;
  // Finds them, where it is time: before samples, so that the first are filtered as soon as they are shown.
  void find_guides(const MarchData& data, const Obstacles& obstacles, Deadline deadline);
  // What of the work under way is still of use for this wish.
  void take(const PictureWish& wish, const Obstacles& obstacles);
  // Goes on with what is under way, and shows it once it is whole.
  void work(const MarchData& data, const Obstacles& obstacles, Deadline deadline);
  // Tells the schedule how far what is under way has come.
  void follow();

  Tracer tracer_;
  std::vector<std::unique_ptr<Picture>> pictures_;
  PictureWish wish_;
  std::uint64_t wishes_ = 0;
  std::uint64_t scenes_ = 0;
  std::optional<glm::uvec2> no_guides_for_;  // of this size
  std::optional<Error> no_guides_;           // to be told
  Schedule schedule_;
  Stillness stillness_;
  std::optional<Work> working_;
  std::optional<Work> shown_;
  Picture* before_ = nullptr;
  std::uint32_t first_divisor_ = 1;  // of the wish
  std::uint32_t finest_ = 1;         // finer ones do not fit the driver's memory
  double trace_seconds_ = 0.0;
  double answer_seconds_ = 0.0;  // that the picture under way took until it was complete
  double answer_rate_ = 100.0;   // pixels a millisecond, until complete
};

}  // namespace cumulet::render
