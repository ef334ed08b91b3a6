#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/revision.hpp"
#include "base/slot.hpp"
#include "denoise/network.hpp"
#include "denoise/oidn_library.hpp"
#include "gl/programs.hpp"
#include "gl/share_group.hpp"
#include "render/dynamic/voxel_transfers.hpp"
#include "render/film/film_reader.hpp"
#include "render/frame/progressive.hpp"
#include "render/frame/shader_warm_up.hpp"
#include "render/pacing/pass_timer.hpp"
#include "render/passes/compositor.hpp"
#include "render/passes/transmittance_map.hpp"
#include "render/raster/host_depth.hpp"
#include "render/scene/gpu_scene.hpp"
#include "viewer/frame.hpp"
#include "viewer/settings.hpp"
#include "viewer/sharing.hpp"

namespace cumulet::viewer {

struct GlStrings {
  std::string vendor;
  std::string renderer;
  std::string version;
};

/// Everything that determines an image, captured at one time. Later changes of settings do not affect it.
struct Shot {
  scene::SnapshotPtr scene;
  glm::uvec2 size{0U};   // of the image
  double depth_a = 0.0;  // as in ViewFrame, if the scene has a view
  double depth_b = 0.0;
  bool view_rests = false;  // the view equals that of the last traced frame
  bool held = false;        // the user is dragging the view
  std::uint32_t max_bounces = 0;
  std::uint32_t sun_group = 0;
  std::uint32_t sky_group = 0;
  Sampling sampling;
  SurfaceSettings surfaces;
  DisplaySettings display;
  std::uint64_t settings = 0;  // revision of all settings; failed work is retried when it changes

  [[nodiscard]] const std::optional<scene::Viewpoint>& view() const { return *scene->view; }
};

/// The denoiser of an image that is read back: a library, else a network, else the real-time filter.
struct Denoisers {
  denoise::NetworkPtr network;
  denoise::OidnLibraryPtr library;

  [[nodiscard]] bool any() const { return network != nullptr || library != nullptr; }
};

/// A color behind an image. Pixels outside of the box have none.
struct Backdrop {
  glm::uvec2 size{0U};
  render::PixelBox box;
  std::optional<glm::vec3> color;
  void put_behind(std::span<float> rgba) const;
};

/// All of a viewer's objects in one GL context: renders shots. All calls except simple queries need the context current
/// and a StateGuard.
class Context {
 public:
  /// commons: resources shared with other viewers.
  Context(gl::FunctionsPtr gl, Commons commons);

  [[nodiscard]] const gl::FunctionsPtr& functions() const { return functions_; }
  [[nodiscard]] const gl::ShareGroup& group() const { return group_; }
  [[nodiscard]] const gl::ProgramsPtr& programs() const { return programs_; }
  [[nodiscard]] Commons commons() const { return {programs_, memories_, marches_}; }
  [[nodiscard]] const GlStrings& strings() const { return strings_; }
  [[nodiscard]] const render::GpuScene& scene() const { return scene_; }
  [[nodiscard]] render::Progressive& progressive() { return progressive_; }
  [[nodiscard]] render::VoxelTransfers& transfers() { return transfers_; }
  [[nodiscard]] render::DeviceMemories& memories() { return *memories_; }
  /// Returns true if all bricks of the state are in this share group.
  [[nodiscard]] bool has(const scene::StateInGl& state) const {
    return std::ranges::all_of(state.all(), [&](const auto* bricks) { return memories_->has(*bricks); });
  }
  /// Must be called once, before anything else.
  void find_out_dispatches();

  // ---- frames ----

  /// Returns true if GL executes on CPU cores that the host's own GL work is still using.
  [[nodiscard]] bool shares_cores() const;
  /// Returns the deadline for tracing in a call that started at `begun`. The budget also covers the expected drawing
  /// time.
  [[nodiscard]] render::Deadline deadline_of(const Frame& frame, render::Deadline begun, bool shares) const;
  struct UploadLimits {
    std::int64_t page_texels = 0;  ///< as in GpuScene
    std::uint64_t max_bytes = 0;   ///< limit of all GPU memory; no volume is uploaded beyond it
  };
  void upload(const Shot& shot, const UploadLimits& limits, render::Deadline deadline);
  void trace(const Shot& shot, const Frame& frame, render::Deadline deadline);
  /// Draws surfaces before the volume is ready.
  void draw_surfaces_alone(const Shot& shot, const Frame& frame);
  void draw(const Shot& shot, const Frame& frame, FrameResult& result);
  /// Continues denoising for the next frame that draws.
  void denoise_undrawn(const Shot& shot, const Frame& frame, render::Picture& shown);
  [[nodiscard]] FramesInContext frames() const;
  /// Fills in the result after the frame.
  void report(const Shot& shot, const Frame& frame, FrameResult& result);
  /// Returns true if a failure should be reported. A program that fails to build fails in every frame until a setting
  /// changes.
  [[nodiscard]] bool is_news(const Shot& shot, const Error& failure);
  /// Updates the time-budget margin with the time taken, for frames in which the host shared the cores.
  void learn(const Frame& frame, double taken_ms) { reserve_.learn(frame.budget_ms, taken_ms); }

  // ---- transmittance maps for the host's own drawing ----

  [[nodiscard]] MapResult update_map(const Shot& shot, const MapRequest& request, render::Deadline deadline);
  void drop_map(std::uint32_t slot) { maps_.erase(slot); }

  // ---- warm-up before the first frame ----

  /// Compiles the programs that frames like this need and uses each once, until about the deadline. all: also compiles
  /// all other programs, and finally throws the first build failure. waits: further programs may be needed later.
  WarmUp warm_up(const Shot& shot, const Frame& frame, bool all, bool waits, render::Deadline deadline);

  // ---- read-back; waits for in-flight dispatches ----

  /// Returns the image for read-back. Throws Error(invalid_argument) before the first one.
  render::Picture& readable();
  [[nodiscard]] Pick pick(const Shot& shot, double x, double y);
  /// Throws Error(invalid_argument) if `count` is too small or the data was not accumulated.
  void read_aov(const Shot& shot, Aov aov, float* values, std::size_t count);
  void read_light_group(const DisplaySettings& settings, std::uint32_t group, float* rgb, std::size_t count);
  /// Calls id_of for each volume instance, each model and the ground, except holdouts; tags are not filled in.
  void read_mattes(const Shot& shot, const MatteIdOf& id_of, std::uint32_t ranks, float* values, std::size_t count);
  void read_linear(const DisplaySettings& settings, float* rgba, std::size_t count);
  /// Returns true if read_denoised() supports this image.
  [[nodiscard]] bool can_denoise(const render::Picture& picture) const;
  /// Reads the denoised image; only for shaded images with traced surfaces. Throws Error(unsupported) for others.
  /// Without a network it uses the real-time filter.
  void read_denoised(const Shot& shot, const Denoisers& by, float* rgba, std::size_t count);
  /// Read without waiting. number: of the read, a new one. Throws Error(invalid_argument) for values that samples do
  /// not accumulate, and if too many reads are pending.
  void begin_read(const DisplaySettings& settings, const ReadRequest& request, std::uint64_t number);
  /// values: receives the values if they are ready, which ends the read; null: none. Throws Error(invalid_argument) if
  /// there is no such read, or `count` is too small.
  ReadState finish_read(std::uint64_t number, float* values, std::size_t count);
  void cancel_read(std::uint64_t number) { reads_.erase(number); }
  /// State of the accumulated samples. Both throw Error(invalid_argument) for images with previews and for debug views.
  [[nodiscard]] std::size_t accumulation_bytes();
  void read_accumulation(std::span<std::byte> bytes);
  /// Continues the image from a saved accumulation. Throws Error(invalid_argument) for data of another image, and then
  /// leaves the image unchanged.
  void restore_accumulation(std::span<const std::byte> bytes);
  [[nodiscard]] render::Totals totals() { return render::FilmReader(functions_).totals(readable()); }

  /// Totals since the context was attached.
  [[nodiscard]] render::PassSeconds pass_seconds() const;
  /// GPU memory in bytes.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Those of pending reads. They are short-lived: budgets of volumes, and thus images, do not depend on them.
  [[nodiscard]] std::uint64_t read_bytes() const;

 private:
  // State that determines the drawn image.
  struct DrawnAs {
    std::uint64_t revision = 0;
    bool done = false;
    bool holes = false;
    bool depth = false;
    std::uint64_t denoised = 0;
    bool operator==(const DrawnAs&) const = default;
  };
  struct TargetKind {
    glm::uvec2 size{0U};
    GLenum format = 0;
    bool depth = false;
    bool operator==(const TargetKind&) const = default;
    [[nodiscard]] std::uint64_t bytes() const;
  };
  struct TargetTextures {
    gl::Object color;
    gl::Object depth;
  };

  // Uploaded frames of sequences.
  [[nodiscard]] scene::SequenceFrames uploaded_frames() const;
  // Returns true if the frame draws to a target of non-zero size.
  [[nodiscard]] static bool draws(const Shot& shot, const Frame& frame);
  [[nodiscard]] render::TraceInputs trace_inputs(const Shot& shot);
  [[nodiscard]] render::PictureParameters parameters(const Shot& shot, const render::TraceInputs& trace_inputs) const;
  void take_host_depth(const Shot& shot, const Frame& frame);
  [[nodiscard]] render::PictureRequest request(const Shot& shot, const Frame& frame,
                                               const render::TraceInputs& inputs) const;
  [[nodiscard]] static render::Display display(const Shot& shot, const Frame& frame, const render::Picture& shown);
  [[nodiscard]] render::FrameTarget target(const Shot& shot, const Frame& frame, const render::Picture& shown) const;
  // Warms up programs. Returns true once all are warm.
  bool warm_up_step(const Shot& shot, const Frame& frame, bool all, render::Deadline deadline);
  // Warms up the programs of such a frame.
  bool warm_up_frame(const Shot& shot, const Frame& frame, render::Deadline deadline);
  // Returns the result of `part`. If it throws Error(gl), the error is stored and true is returned, because other
  // programs need not wait for one that fails to build.
  template <class Part>
  bool done_or_failed(Part&& part);
  void warm_up_drawing(const Shot& shot, const Frame& frame, const render::Picture& shown);
  void make_target_textures(const Shot& shot, const Frame& frame);
  // The pass that draws an image's film, with the filter's inputs if denoising is on.
  static render::Pass display_pass(const char* name, const render::PictureTextures& picture,
                                   const render::Display& display);
  // The last pass: Compositor::draw() of a film with these textures.
  void composite(render::Film& film, const render::PictureTextures& picture, const render::Display& display,
                 const render::FrameTarget& target);
  // Computes feature buffers. Throws Error(invalid_argument) if the image is of another scene than the current one.
  void find_features(const Shot& shot, render::Picture& picture, render::FeatureSet features,
                     std::uint32_t rays = render::feature_rays);
  // Returns readable(); throws for debug views.
  render::Picture& readable_shaded();
  // Throws if the displayed data differs from that of the image, or if `also` is false.
  void require_present(bool also) const;
  // Returns the image denoised by the network, row 0 at the top. The image must have its feature buffers.
  gl::Object by_network(const Shot& shot, const render::Picture& picture, const Denoisers& by);
  gl::Object filtered(const render::Picture& picture, bool with_background);
  // Mean radiance, with or without that of the background, and alpha, including surfaces drawn beneath a preview.
  // drawn: receives the textures that are drawn for it, which must live until the values were copied.
  render::FilmValues means_of(render::Picture& picture, bool with_background, std::vector<gl::Object>& drawn);
  void read_means(render::Picture& picture, bool with_background, float* rgba);
  // Values that samples accumulate. Both throw Error(invalid_argument) for values that were not accumulated.
  render::FilmValues accumulated_aov(render::Picture& picture, Aov aov, std::vector<gl::Object>& drawn);
  static render::FilmValues light_group_of(const DisplaySettings& settings, const render::Picture& picture,
                                           std::uint32_t group);
  // Returns an image that consists only of samples, after all in-flight dispatches have completed. Throws if there is
  // none.
  render::Picture& accumulating();
  // Draws the compositor's output as linear radiance.
  gl::Object draw_composite(render::Picture& picture, bool transparent);
  [[nodiscard]] static render::PictureGuides guides_of(const render::Picture& picture);
  [[nodiscard]] render::PictureView view_of(const render::Picture& picture) const;
  [[nodiscard]] render::PictureTextures textures_of(const render::Picture& picture,
                                                    const render::Picture* before) const;
  // Textures of the displayed image, or of the empty image.
  [[nodiscard]] render::PictureTextures textures_to_draw(const render::Picture& picture) const;

  gl::FunctionsPtr functions_;
  gl::ShareGroup group_;
  gl::ProgramsPtr programs_;
  gl::Limits limits_;
  GlStrings strings_;
  render::DeviceMemoriesPtr memories_;
  render::SharedMarchesPtr marches_;
  render::GpuScene scene_;
  render::Progressive progressive_;
  render::Compositor compositor_;
  render::Reserve reserve_;
  render::PassTimer upload_timer_;
  render::PassTimer host_depth_timer_;
  render::PassTimer display_timer_;
  render::HostDepth host_depth_;
  render::VoxelTransfers transfers_;
  Revision<render::HostDepth> host_depth_revision_;
  std::optional<std::pair<std::uint64_t, std::string>> reported_;  // the last GL failure that was reported, and its
                                                                   // settings
  std::optional<DrawnAs> drawn_;  // state drawn last; nullopt if an older image was drawn
  render::Picture empty_;
  std::optional<std::uint64_t> alone_failed_;  // settings at which drawing surfaces without a volume failed
  Slot<TargetTextures, TargetKind> target_;
  std::map<std::uint32_t, render::TransmittanceMap> maps_;  // by slot
  struct Read {
    render::PendingRead pending;
    Backdrop backdrop;
  };
  std::map<std::uint64_t, Read> reads_;                   // by number
  std::unique_ptr<render::ShaderWarmUp> shader_warm_up_;  // in progress
  double warm_ = 0.0;                                     // fraction of the warm-up that was reported
  std::optional<Error> unbuilt_;                          // the first build failure of the warm-up, thrown at its end
  std::optional<std::uint64_t> tried_;                    // settings at which failed programs were retried
  bool knows_dispatches_ = false;
};

}  // namespace cumulet::viewer
