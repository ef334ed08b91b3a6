#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/log.hpp"
#include "base/slot.hpp"
#include "base/trace.hpp"
#include "gl/programs.hpp"
#include "gl/share_group.hpp"
#include "render/compositor.hpp"
#include "render/host_depth.hpp"
#include "render/progressive.hpp"
#include "viewer/builder.hpp"
#include "viewer/camera.hpp"
#include "viewer/navigation.hpp"
#include "viewer/settings.hpp"
#include "viewer/surface_builder.hpp"

namespace cumulet::viewer {

/// cumulet_aov.
enum class Aov {
  beauty = 0,
  volume = 1,
  transmittance = 2,
  surface_depth = 3,
  volume_depth = 4,
  normal = 5,
  albedo = 6
};

enum class Target { framebuffer = 0, texture = 1, none = 2 };

/// cumulet_frame_desc, checked.
struct Frame {
  double budget_ms = 10.0;  // negative: trace nothing
  Target target = Target::framebuffer;
  GLuint framebuffer = 0;
  glm::uvec2 size{0U};
  glm::ivec4 viewport{0};  // never zero where size is not
  bool flip_y = false;
  GLenum format = GL_RGBA8;
  render::ColourEncoding encoding = render::ColourEncoding::srgb;
  bool blend_over = true;
  bool write_depth = false;
  render::DepthSource depth_source = render::DepthSource::none;
  GLuint depth_name = 0;
  bool depth_flip_y = false;
  bool depth_unchanged = false;
};

struct FrameResult {
  bool more = false;
  bool converged = false;
  bool loading = false;
  bool failed = false;
  bool preview = false;
  bool undrawn = false;
  double progress = 0.0;
  glm::uvec2 size{0U};
  GLuint texture = 0;
  GLuint depth_texture = 0;
};

struct Pick {
  bool hit = false;
  glm::dvec3 position{0.0};
  double distance = 0.0;
};

struct GlStrings {
  std::string vendor;
  std::string renderer;
  std::string version;
};

struct Stats {
  std::uint64_t cells = 0;
  std::uint32_t levels = 0;
  bool limited = false;
  std::uint64_t cell_bytes = 0;
  std::uint64_t gl_bytes = 0;
  std::uint64_t active_voxels = 0;
  BuildSeconds build_seconds;
  double trace_seconds = 0.0;
  std::uint64_t samples = 0;
  std::uint64_t steps = 0;
  GlStrings strings;
};

/// The facade behind the C ABI: settings in, pictures out. Rebuilds what a change makes out of date, and nothing else.
/// Threads, context and GL state as cumulet.h says. Throws Error; a call that throws leaves the viewer as it was.
class Viewer {
 public:
  using GetProc = void* (*)(void* user, const char* name);
  /// restore_state: [GL] calls leave the GL state as they found it.
  /// programs: of viewers that share them; null: of its own.
  Viewer(Log log, std::function<void()> update, bool restore_state, Trace trace = {},
         std::shared_ptr<gl::ProgramPool> programs = nullptr);
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  void attach(GetProc get_proc, void* user);
  void detach();
  void context_lost();
  [[nodiscard]] bool attached() const { return gl_ != nullptr; }

  void load_volume(const VolumeFile& file);
  void set_volume(VolumePtr volume);
  /// The newest volume; null if there is none.
  VolumePtr volume();
  void rebuild();
  void cancel();
  /// Throws how the last job ended, or Error(timeout).
  void wait(double timeout_ms);
  /// As Builder's, and uploading.
  [[nodiscard]] Worker::Status status() const;

  void load_surfaces(const std::string& path);
  /// Shows these at once. Cancels a load under way.
  void show_surfaces(SurfacePtr surfaces);
  /// Poses these, then shows them; null: none, at once. Cancels a load under way.
  void set_surfaces(SurfaceAssetPtr surfaces);
  /// The newest; null if there are none.
  SurfaceAssetPtr surfaces_asset();
  void set_surface_settings(const SurfaceSettings& settings);
  /// Looks through a camera of the newest surfaces. Throws Error(invalid_argument) if there is none such.
  void use_surface_camera(std::size_t index);

  void set_grid(const GridSettings& settings);
  void set_medium(const Medium& medium);
  void set_light(const Light& light);
  void set_sampling(const Sampling& sampling);
  void set_display(const DisplaySettings& display);
  void set_camera(std::shared_ptr<Camera> camera);
  [[nodiscard]] const std::shared_ptr<Camera>& camera() const { return camera_; }
  void set_navigation(const NavigationSettings& settings);
  bool input(const InputEvent& event);
  void frame_all();

  FrameResult render(const Frame& frame);
  Pick pick(double x, double y);
  /// Throws Error(invalid_argument) without a volume.
  Bounds bounds();
  void read_linear(float* rgba, std::size_t count);
  void read_display(std::uint8_t* rgba, std::size_t count);
  void read_aov(Aov aov, float* values, std::size_t count);
  double measure_noise();
  Stats stats();

  /// Tells the host that there is something new. Coalesced; any thread.
  void notify();

  /// What the shaders were told of the picture under way; for tests.
  const core::CmParameters& trace_parameters();
  /// Where every dispatch of paths that ends is told, or null; for tests.
  void set_dispatch_log(std::vector<render::DispatchRecord>* log) { gl().progressive.tracer().set_log(log); }
  /// Pages of cell records end after so many texels; 0: at the driver's limit; for tests.
  void set_page_texels(std::int64_t texels) { page_texels_ = texels; }

 private:
  // All that drawing shows of a picture.
  struct DrawnAs {
    std::uint64_t revision = 0;
    bool done = false;
    bool holes = false;
    GLuint volume_z = 0;
    bool operator==(const DrawnAs&) const = default;
  };
  using MarchSourcePtr = scene::MarchSourcePtr;
  // Under way, and with which settings it was begun.
  struct Upload {
    MarchSourcePtr of;
    std::uint64_t settings = 0;
    std::unique_ptr<render::MarchUpload> work;
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
  // All that lives in one context.
  struct Gl {
    Gl(gl::FunctionsPtr gl, gl::ProgramPool& pool);
    gl::FunctionsPtr functions;
    gl::ShareGroup group;
    gl::ProgramsPtr programs;
    gl::Limits limits;
    GlStrings strings;
    render::Progressive progressive;
    render::Compositor compositor;
    render::Reserve reserve;
    render::HostDepth host_depth;
    Slot<render::MarchData, MarchSourcePtr> data;
    std::optional<Upload> upload;  // of what data will be
    Slot<render::SurfaceData, SurfacePtr> surfaces;
    Slot<render::SurfaceRaster, SurfacePtr> raster;  // where it is of use
    std::optional<DrawnAs> drawn;                    // last; nothing where that was older than what there was
    render::Picture empty;
    std::optional<std::uint64_t> alone_failed;  // settings at which the surfaces beneath it could not be drawn
    Slot<TargetTextures, TargetKind> target;
    bool knows_dispatches = false;
  };

  [[nodiscard]] Gl& gl() const;
  // A setting changed.
  void touch();
  // Runs a [GL] call's body between state guard and error handling.
  template <class Body>
  void with_gl(Body&& body);
  void sync();
  void request_build();
  [[nodiscard]] std::optional<BuildSettings> build_settings() const;
  [[nodiscard]] grid::RefineCamera refine_camera() const;
  [[nodiscard]] render::PictureParameters parameters() const;
  // Whether the host's own work takes of the cores that ours runs on.
  static bool shares_cores(const Gl& g);
  // When tracing ends: what drawing will take is the budget's, too.
  static render::Deadline deadline_of(const Gl& g, const Frame& frame, bool shares);
  void prepare(const Frame& frame, render::Deadline deadline);
  void trace(const Frame& frame, render::Deadline deadline);
  // Whether there is a target of any size.
  [[nodiscard]] bool draws(const Frame& frame) const;
  void draw_surfaces_alone(const Frame& frame);
  void draw(const Frame& frame, FrameResult& result);
  void make_target_textures(Gl& g, const Frame& frame) const;
  void upload(Gl& g, render::Deadline deadline);
  void upload_surfaces(Gl& g);
  [[nodiscard]] std::optional<Bounds> box() const;
  /// What cameras fit; good for as long as nothing changes.
  [[nodiscard]] std::optional<Subject> subject() const;
  [[nodiscard]] std::vector<double> seen_reach(const glm::dvec3& direction, std::span<const glm::dvec3> normals) const;
  VolumePtr empty_volume();
  [[nodiscard]] render::Surfaces surfaces() const;
  render::Picture& readable();
  static void read_means(Gl& g, const render::Picture& picture, bool with_background, float* rgba);
  // What the compositor draws of it, as linear radiance.
  static void read_composite(Gl& g, const render::Picture& picture, bool transparent, float* rgba);
  void upload_raster(Gl& g);

  Log log_;
  Trace trace_;
  std::function<void()> update_;
  std::atomic<bool> update_pending_ = false;
  std::atomic<double> upload_progress_ = 1.0;
  bool restore_state_;
  std::shared_ptr<gl::ProgramPool> programs_;
  std::int64_t page_texels_ = 0;

  GridSettings grid_;
  Medium medium_;
  Light light_;
  SurfaceSettings surface_settings_;
  SurfaceAssetPtr surface_asset_;  // newest
  SurfacePtr surface_source_;      // newest that is posed
  Sampling sampling_;
  DisplaySettings display_;
  std::shared_ptr<Camera> camera_;
  std::shared_ptr<void> camera_listener_;
  Navigation navigation_;
  std::chrono::steady_clock::time_point last_frame_time_{};

  VolumePtr volume_;              // newest
  VolumePtr empty_volume_;        // where there are surfaces alone
  Built built_;                   // newest, and what is uploaded again in a new context
  std::uint64_t generation_ = 1;  // of the data in GL
  std::uint64_t settings_revision_ = 1;
  std::uint64_t surface_generation_ = 1;  // of the host's depth and the surfaces
  glm::uvec2 frame_size_{0U};             // of the last frame's picture
  std::optional<ViewFrame> view_;         // of the last frame
  std::optional<ViewFrame> traced_view_;  // of the last frame that traced
  std::optional<ViewFrame> last_view_;    // of the one before it
  std::optional<ViewFrame> built_view_;   // camera-adaptive: what the grid was last asked for
  glm::uvec2 built_size_{0U};
  render::Totals totals_;

  std::unique_ptr<Gl> gl_;
  Builder builder_;  // these last: their threads use the above
  SurfaceBuilder surface_builder_;
};

}  // namespace cumulet::viewer
