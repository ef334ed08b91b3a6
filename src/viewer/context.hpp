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

#include "base/error.hpp"
#include "base/revision.hpp"
#include "base/slot.hpp"
#include "denoise/network.hpp"
#include "gl/programs.hpp"
#include "gl/share_group.hpp"
#include "render/compositor.hpp"
#include "render/gpu_scene.hpp"
#include "render/host_depth.hpp"
#include "render/pass_timer.hpp"
#include "render/progressive.hpp"
#include "render/rehearsal.hpp"
#include "render/transmittance_map.hpp"
#include "render/voxel_transfers.hpp"
#include "viewer/frame.hpp"
#include "viewer/settings.hpp"
#include "viewer/sharing.hpp"

namespace cumulet::viewer {

struct GlStrings {
  std::string vendor;
  std::string renderer;
  std::string version;
};

/// All that pictures are made of, frozen at one moment: settings change beside it.
struct Shot {
  scene::SnapshotPtr scene;
  glm::uvec2 size{0U};   // of the picture
  double depth_a = 0.0;  // as ViewFrame's, where the scene has a view
  double depth_b = 0.0;
  bool view_rests = false;  // as it was in the last frame that traced
  bool held = false;        // a hand is at the view
  std::uint32_t max_bounces = 0;
  std::uint32_t sun_group = 0;
  std::uint32_t sky_group = 0;
  Sampling sampling;
  SurfaceSettings surfaces;
  DisplaySettings display;
  std::uint64_t settings = 0;  // another after each change of one: what failed is tried again

  [[nodiscard]] const std::optional<scene::Viewpoint>& view() const { return *scene->view; }
};

/// All that a viewer has in one GL context: shots in, pictures out. All calls but those that tell need the context
/// current and a StateGuard around.
class Context {
 public:
  /// commons: with other viewers.
  Context(gl::FunctionsPtr gl, Commons commons);

  [[nodiscard]] const gl::FunctionsPtr& functions() const { return functions_; }
  [[nodiscard]] const gl::ShareGroup& group() const { return group_; }
  [[nodiscard]] const gl::ProgramsPtr& programs() const { return programs_; }
  [[nodiscard]] Commons commons() const { return {programs_, memories_}; }
  [[nodiscard]] const GlStrings& strings() const { return strings_; }
  [[nodiscard]] const render::GpuScene& scene() const { return scene_; }
  [[nodiscard]] render::Progressive& progressive() { return progressive_; }
  [[nodiscard]] render::VoxelTransfers& transfers() { return transfers_; }
  [[nodiscard]] render::DeviceMemories& memories() { return *memories_; }
  /// Whether all of its bricks are here.
  [[nodiscard]] bool has(const scene::StateInGl& state) const {
    return std::ranges::all_of(state.all(), [&](const auto* bricks) { return memories_->has(*bricks); });
  }
  /// Before anything else, once.
  void find_out_dispatches();

  // ---- a frame ----

  /// Whether the host's own work takes of the cores that ours runs on.
  [[nodiscard]] bool shares_cores() const;
  /// When tracing ends of a call that was begun then: what drawing will take is the budget's, too.
  [[nodiscard]] render::Deadline deadline_of(const Frame& frame, render::Deadline begun, bool shares) const;
  struct UploadLimits {
    std::int64_t page_texels = 0;  ///< as GpuScene's
    std::uint64_t most_bytes = 0;  ///< of all GL memory: no volume is brought beyond that
  };
  void upload(const Shot& shot, const UploadLimits& limits, render::Deadline deadline);
  void trace(const Shot& shot, const Frame& frame, render::Deadline deadline);
  /// The surfaces need not wait for the volume.
  void draw_surfaces_alone(const Shot& shot, const Frame& frame);
  void draw(const Shot& shot, const Frame& frame, FrameResult& result);
  /// Goes on with what a frame that draws will show.
  void denoise_undrawn(const Shot& shot, const Frame& frame, render::Picture& shown);
  /// Of sequences, the frames that are drawn.
  [[nodiscard]] scene::SequenceFrames shown_frames() const { return progressive_.shown_frames(); }
  /// Whether that frame, which was uploaded last, or is being uploaded, is still to be seen, and will be.
  [[nodiscard]] bool owes(const scene::SequenceFrame& frame) const;
  /// What is known after the frame.
  void tell(const Shot& shot, const Frame& frame, FrameResult& result);
  /// Whether the frame's failure is to be told: what does not build fails in each until a setting changes.
  [[nodiscard]] bool is_news(const Shot& shot, const Error& failure);
  /// What it took, where the host shared the cores.
  void learn(const Frame& frame, double taken_ms) { reserve_.learn(frame.budget_ms, taken_ms); }

  // ---- for the host's own drawing ----

  [[nodiscard]] MapResult update_map(const Shot& shot, const MapRequest& request, render::Deadline deadline);
  void drop_map(std::uint32_t slot) { maps_.erase(slot); }

  // ---- before the first ----

  /// Compiles and uses once the programs that frames like this need, until about the deadline; all: compiles every
  /// other, too, and throws what does not build in the end. waits: for what may need others still.
  WarmUp warm_up(const Shot& shot, const Frame& frame, bool all, bool waits, render::Deadline deadline);

  // ---- reading back: waits for what is under way ----

  /// What is read. Throws Error(invalid_argument) before the first.
  render::Picture& readable();
  [[nodiscard]] Pick pick(const Shot& shot, double x, double y);
  /// Throws Error(invalid_argument) for too few values, or what was not gathered.
  void read_aov(const Shot& shot, Aov aov, float* values, std::size_t count);
  void read_light_group(const DisplaySettings& settings, std::uint32_t group, float* rgb, std::size_t count);
  /// id_of is asked for each volume's place, each model and the ground that are there, but for holes, and not told
  /// tags.
  void read_mattes(const Shot& shot, const MatteIdOf& id_of, std::uint32_t ranks, float* values, std::size_t count);
  void read_linear(const DisplaySettings& settings, float* rgba, std::size_t count);
  /// Whether read_denoised can give this picture.
  [[nodiscard]] bool can_denoise(const render::Picture& picture) const;
  /// The same denoised; only of shaded pictures whose surfaces are traced. Throws Error(unsupported) of others.
  /// Without a network by the filter of frames.
  void read_denoised(const Shot& shot, const denoise::NetworkPtr& network, float* rgba, std::size_t count);
  /// Of what samples have come to. Throw Error(invalid_argument) of pictures with previews, and of debug views.
  [[nodiscard]] std::size_t accumulation_bytes();
  void read_accumulation(std::span<std::byte> bytes);
  /// The picture goes on from there. Throws Error(invalid_argument), with the picture as it was, for what is not of it.
  void restore_accumulation(std::span<const std::byte> bytes);
  [[nodiscard]] render::Totals totals() { return progressive_.tracer().totals(readable()); }

  /// Of the context's life.
  [[nodiscard]] render::PassSeconds pass_seconds() const;
  /// All that it has there.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  // All that drawing shows of a picture.
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
    gl::Object colour;
    gl::Object depth;
  };

  // Of what has been uploaded.
  [[nodiscard]] scene::SequenceFrames uploaded_frames() const;
  // Whether there is a target of any size.
  [[nodiscard]] static bool draws(const Shot& shot, const Frame& frame);
  [[nodiscard]] render::Obstacles obstacles(const Shot& shot);
  [[nodiscard]] render::PictureParameters parameters(const Shot& shot, const render::Obstacles& obstacles) const;
  void take_host_depth(const Shot& shot, const Frame& frame);
  [[nodiscard]] render::PictureWish wish(const Shot& shot, const Frame& frame, const render::Obstacles& met) const;
  [[nodiscard]] static render::Display display(const Shot& shot, const Frame& frame, const render::Picture& shown);
  [[nodiscard]] render::FrameTarget target(const Shot& shot, const Frame& frame, const render::Picture& shown) const;
  // Whether all programs are warm.
  bool rehearse(const Shot& shot, const Frame& frame, bool all, render::Deadline deadline);
  // Those of such a frame.
  bool rehearse_frame(const Shot& shot, const Frame& frame, render::Deadline deadline);
  // What part returns; true as well where it throws Error(gl), which is kept: others need not wait for what does not
  // build.
  template <class Part>
  bool done_or_failed(Part&& part);
  void rehearse_drawing(const Shot& shot, const Frame& frame, const render::Picture& shown);
  void make_target_textures(const Shot& shot, const Frame& frame);
  // What of a picture's film is drawn, and filtered where that is asked for.
  static render::Pass display_pass(const char* name, const render::PictureTextures& picture,
                                   const render::Display& display);
  // The last pass, as Compositor::draw: of a film, whose textures these are.
  void composite(render::Film& film, const render::PictureTextures& picture, const render::Display& display,
                 const render::FrameTarget& target);
  // Throws Error(invalid_argument) where the picture is of another scene than the one there is.
  void find_facts(const Shot& shot, render::Picture& picture, render::PixelFacts facts,
                  std::uint32_t rays = render::fact_rays);
  // As readable(), and throws where it is a debug view.
  render::Picture& readable_shaded();
  // Throws where what is shown is not what the picture is of any more, or where not this as well.
  void require_present(bool also) const;
  // The picture denoised, which has its facts: row 0 the top.
  gl::Object by_network(const Shot& shot, const render::Picture& picture, const denoise::NetworkPtr& network);
  gl::Object filtered(const render::Picture& picture, bool with_background);
  // Mean radiance, with the background's or without, and alpha, with the surfaces that lie beneath a preview.
  void read_means(render::Picture& picture, bool with_background, float* rgba);
  // The picture that its samples alone make; all that was sent off for it is there. Throws where there is none.
  render::Picture& accumulating();
  // What the compositor draws of it, as linear radiance.
  void read_composite(render::Picture& picture, bool transparent, float* rgba);
  [[nodiscard]] static render::PictureGuides guides_of(const render::Picture& picture);
  [[nodiscard]] render::PictureView view_of(const render::Picture& picture) const;
  [[nodiscard]] render::PictureTextures textures_of(const render::Picture& picture,
                                                    const render::Picture* before) const;
  // Of the picture that is shown, or of the empty one.
  [[nodiscard]] render::PictureTextures textures_to_draw(const render::Picture& picture) const;

  gl::FunctionsPtr functions_;
  gl::ShareGroup group_;
  gl::ProgramsPtr programs_;
  gl::Limits limits_;
  GlStrings strings_;
  render::DeviceMemoriesPtr memories_;
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
  std::optional<std::pair<std::uint64_t, std::string>> told_;  // the last failure of OpenGL's, and at which settings
  std::optional<DrawnAs> drawn_;                               // last; nothing where that was older than what there was
  render::Picture empty_;
  std::optional<std::uint64_t> alone_failed_;  // settings at which the surfaces beneath it could not be drawn
  Slot<TargetTextures, TargetKind> target_;
  std::map<std::uint32_t, render::TransmittanceMap> maps_;  // by slot
  std::unique_ptr<render::Rehearsal> rehearsal_;            // under way
  double warm_ = 0.0;                                       // the part of it that was told
  std::optional<Error> unbuilt_;                            // the first failure in it, to be told in the end
  std::optional<std::uint64_t> tried_;                      // settings at which programs that do not build were tried
  bool knows_dispatches_ = false;
};

}  // namespace cumulet::viewer
