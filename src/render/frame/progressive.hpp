#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/error.hpp"
#include "base/revision.hpp"
#include "render/frame/tracer.hpp"
#include "render/pacing/schedule.hpp"
#include "render/raster/host_depth.hpp"
#include "scene/snapshot.hpp"

namespace cumulet::render {

/// A request for a picture.
struct PictureRequest {
  /// Inputs that samples depend on: if any changes, a new picture is started. Values are the newest ones. Data that are
  /// uploaded over several frames are identified by the revision that is on the GPU.
  struct Content {
    scene::Part<std::optional<scene::Viewpoint>> viewpoint;
    scene::Part<scene::Previous> previous;
    scene::Part<std::optional<scene::ViewEnds>> view_ends;
    scene::Part<light::DistantLights> lights;
    scene::Part<light::Surroundings> surroundings;
    scene::Part<light::AnalyticLights> analytic_lights;
    scene::Part<std::optional<scene::Ground>> ground;
    std::vector<scene::Volume> volumes;  // without sources and frames: `data` identifies the uploaded ones
    Revision<MarchData> data;
    Revision<InstanceData> instances;
    Revision<ModelData> model;
    Revision<EnvironmentData> environment;
    Revision<HostDepth> host_depth;
    Revision<gl::Programs> programs;
    core::CmIntegrator integrator{};
    glm::uvec2 size{0U};  // at full resolution
    PictureOptions options;
    bool surfaces_traced = true;  // paths hit triangles
    bool stops_by_noise = false;  // there is a noise target
    bool operator==(const Content&) const = default;
    /// True if only the view, the host's depth or the settings of rendering differ.
    [[nodiscard]] bool shows_same(const Content& other) const;
  };
  Content content;
  PictureParameters parameters;        // of the content, at full resolution
  scene::SequenceFrames frames;        // frames that the data belong to
  std::uint32_t samples = 1;           // samples per pixel
  std::optional<double> noise_target;  // at full resolution: the picture is done at this noise, even with fewer samples
  bool depth = false;                  // compute the volume's depth at half opacity as well
  bool guides = false;                 // render feature buffers for the denoiser as well
  bool held = false;                   // the user is dragging: another change is likely
};

/// Progressive refinement. Keeps the newest complete picture to show while the next is rendered. After a change, a
/// coarse picture that fits the frame time comes first. Pictures of twice the resolution each follow. The full one is
/// last, and continues to its target samples.
/// Each coarse picture is shown as soon as it is complete. It then continues to a few samples per pixel, so that it has
/// little noise while the next is rendered. These samples take at most a quarter of the work of one sample per pixel at
/// full resolution.
/// If requests change faster than a coarse picture takes, each is finished before the newest request is processed. Once
/// requests do not change any more, a picture over a coarse surface pass is replaced. The new one has a full-size
/// surface pass, which later pictures share. All calls need a current context and an active StateGuard.
class Progressive {
 public:
  /// Returns size and layer count of the surface pass for pictures that must appear soon. rests: the request has not
  /// changed for a while; the pass then has full size, otherwise at least half of it. Coarser passes would save little,
  /// because most of their cost is vertex processing.
  static PictureSettings quick_layers(const Tracer& tracer, glm::uvec2 size, double budget_ms, bool rests);

  Progressive(gl::FunctionsPtr gl, gl::ProgramsPtr programs) : tracer_(std::move(gl), std::move(programs)) {}

  /// Processes the request until about the deadline. If a picture cannot be made, throws once. Later calls continue
  /// with the existing picture, or a coarser one.
  void advance(const PictureRequest& request, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
               double budget_ms);
  /// Deletes all pictures.
  void reset();

  /// The newest complete picture; null before the first.
  [[nodiscard]] Picture* shown() const { return shown_ ? shown_->picture : nullptr; }
  /// Number of the request for which the shown picture was started.
  [[nodiscard]] std::uint64_t shown_request() const { return shown_ ? shown_->request : 0; }
  /// Frames of sequences that the shown picture shows.
  [[nodiscard]] scene::SequenceFrames shown_frames() const { return shown_ ? shown_->frames : scene::SequenceFrames(); }
  /// Number of the scene of the shown picture; equal for all pictures of the same scene from any view.
  [[nodiscard]] std::uint64_t shown_scene() const { return shown_ ? shown_->scenes : 0; }
  /// The picture shown before, if the shown one may have pixels without a sample; else null.
  [[nodiscard]] const Picture* before() const { return shown_ && shown_->picture->has_holes() ? before_ : nullptr; }
  /// Waits for dispatches in flight, so that a read-back is complete.
  void settle();
  /// The picture to read back: the shown one, or without previews the one being rendered.
  [[nodiscard]] Picture* newest() { return newest_work() ? newest_work()->picture : nullptr; }
  /// Returns the picture being rendered if only its samples decide its content: a shaded one at full resolution,
  /// without previews. Throws Error(invalid_argument) if there is none.
  [[nodiscard]] Picture& accumulating();
  /// Restores a checkpoint (render/film/checkpoint.hpp) into accumulating(). Throws Error(invalid_argument) if there is
  /// no such picture or the data do not match it.
  void restore(std::span<const std::byte> saved);
  /// True if newest() was started with these data and instance transforms.
  [[nodiscard]] bool newest_is_of(Revision<MarchData> data, Revision<InstanceData> instances) const {
    return newest_work() && newest_work()->data == data && newest_work()->instances == instances;
  }
  /// True if newest() has the scene's current view and previous-frame state.
  [[nodiscard]] bool newest_is_seen_as(const scene::Snapshot& scene) const {
    return newest_work() && newest_work()->request == requests_ && request_.content.viewpoint == scene.view &&
           request_.content.previous == scene.previous;
  }
  [[nodiscard]] Schedule::State state() const { return schedule_.state(); }
  /// True if coarse pictures may come first, so that the result may depend on earlier pictures.
  [[nodiscard]] bool previews() const { return request_.content.options.preview; }
  [[nodiscard]] bool converged() const;
  /// True if no picture of the request has been shown yet, but one will be.
  [[nodiscard]] bool has_pending_picture() const;
  /// True if advance() has work left.
  [[nodiscard]] bool more() const;
  /// Fraction of the request's work that is done, 0 to 1. It does not decrease while the request is the same.
  [[nodiscard]] double progress() const;
  [[nodiscard]] Tracer& tracer() { return tracer_; }
  [[nodiscard]] const Tracer& tracer() const { return tracer_; }
  [[nodiscard]] std::uint64_t bytes() const;
  /// Time spent on the picture at full resolution, in seconds.
  [[nodiscard]] double trace_seconds() const { return trace_seconds_; }

 private:
  // Returns the samples per pixel at which a picture with this divisor gives way to the next.
  [[nodiscard]] std::uint32_t enough(std::uint32_t divisor) const;
  [[nodiscard]] glm::uvec2 size_of(std::uint32_t divisor) const;
  // Number of pixels that are rendered with this divisor. margin_of(): extra pixels around the region, for pictures
  // that are enlarged.
  [[nodiscard]] double pixels_of(std::uint32_t divisor) const;
  [[nodiscard]] unsigned margin_of(std::uint32_t divisor) const;
  [[nodiscard]] bool is_enough() const;
  // A picture with the inputs that it was started with.
  struct Work {
    Picture* picture = nullptr;
    Revision<MarchData> data;
    Revision<InstanceData> instances;
    std::uint32_t divisor = 1;              // of the resolution
    std::shared_ptr<const void> scene;      // ModelInstances::numbering() of the triangles that its paths hit
    Revision<EnvironmentData> environment;  // hit by paths that escape
    scene::SequenceFrames frames;
    std::uint64_t request = 0;  // number of its request
    std::uint64_t scenes = 0;   // number of its scene
  };
  [[nodiscard]] const std::optional<Work>& newest_work() const {
    return request_.content.options.preview || !working_ ? shown_ : working_;
  }
  [[nodiscard]] std::uint32_t coarsest(double budget_ms) const;
  [[nodiscard]] PictureSettings settings(std::uint32_t divisor, const TraceInputs& trace_inputs, double budget_ms,
                                         bool still) const;
  // True if the picture being rendered uses a coarser surface pass than pictures at rest do.
  [[nodiscard]] bool blurs() const;
  // Returns whether start() can begin. Until then the previous picture is shown.
  bool able(const MarchData& data, const TraceInputs& trace_inputs, const PictureSettings& settings);
  Picture& acquire(glm::uvec2 size);
  void start(std::uint32_t divisor, const MarchData& data, const TraceInputs& trace_inputs,
             const PictureSettings& settings);
  [[nodiscard]] bool needs_depth() const;
  // Returns the number of feature rays that the picture's guides should have now. It grows with the samples, because
  // rough guides then lose more detail.
  [[nodiscard]] std::uint32_t guide_rays(const Work& work) const;
  [[nodiscard]] bool needs_guides(const Work& work) const;
  // Renders the guides if they are due: before the samples, so that the first samples are denoised as soon as they are
  // shown.
  void find_guides(const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline);
  // Accepts a request, and decides whether the picture being rendered can be kept for it.
  void take(const PictureRequest& request, const TraceInputs& trace_inputs);
  // Continues the picture being rendered, and shows it once it is complete.
  void work(const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline);
  // Updates the schedule with the state of the picture being rendered.
  void follow();

  Tracer tracer_;
  std::vector<std::unique_ptr<Picture>> pictures_;
  PictureRequest request_;
  std::uint64_t requests_ = 0;
  std::uint64_t scenes_ = 0;
  std::optional<glm::uvec2> no_guides_for_;  // size of pictures without memory for guides
  std::optional<Error> no_guides_;           // error to be thrown by advance()
  Schedule schedule_;
  Stillness stillness_;
  std::optional<Work> working_;
  std::optional<Work> shown_;
  Picture* before_ = nullptr;
  std::uint32_t first_divisor_ = 1;                 // of the request
  std::uint32_t finest_ = 1;                        // finer ones do not fit the driver's memory
  std::optional<std::uint64_t> out_of_memory_for_;  // request whose lack of memory has been thrown
  double trace_seconds_ = 0.0;
  double answer_seconds_ = 0.0;  // time that the picture being rendered took until it was complete
  double answer_rate_ = 100.0;   // pixels per millisecond, until complete
};

}  // namespace cumulet::render
