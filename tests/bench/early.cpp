// Measures when a large file is first displayed as a coarse proxy, and when as a whole. Run by hand:
//
//     cumulet-bench-early [--without] FILE.vdb [OUT_FOLDER]
//
// Prints seconds of wall time and of CPU time of the process, from cumulet_load_volume_file to the end of the frame
// that shows it; the host idles in between. With a folder it path traces the proxy meanwhile, and writes early.png (as
// far as it converged) and whole.png. --without: previews are off, so that there is no proxy.
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>
#include <image.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "c_viewer.hpp"

namespace {

using cumulet::bench::must;
using cumulet::headless::Context;
using cumulet::test::make_desc;

constexpr std::uint32_t size = 256;
constexpr std::uint32_t samples = 8;

/// Time since the construction.
class Watch {
 public:
  void print(const char* what) const {
    const std::chrono::duration<double> clock = std::chrono::steady_clock::now() - clock_;
    const double processor = static_cast<double>(std::clock() - processor_) / CLOCKS_PER_SEC;
    std::printf("%s: %.2f s by the clock, %.2f of processors\n", what, clock.count(), processor);
    std::fflush(stdout);
  }

 private:
  std::chrono::steady_clock::time_point clock_ = std::chrono::steady_clock::now();
  std::clock_t processor_ = std::clock();
};

class Bench {
 public:
  explicit Bench(bool with_proxy) {
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = samples;
    sampling.preview = with_proxy ? CUMULET_PREVIEW_AUTO : CUMULET_PREVIEW_OFF;
    must(viewer_.get(), cumulet_set_sampling(viewer_.get(), &sampling));
  }

  void run(const std::string& path, const std::string& folder) {
    auto file = make_desc<cumulet_volume_file_desc>();
    file.path = path.c_str();
    file.suggested_density_scale = 1;
    const Watch watch;
    must(viewer_.get(), cumulet_load_volume_file(viewer_.get(), &file));
    // The camera waits for bounds, which are set when the volume can be displayed.
    std::array<double, 6> box{};
    while (frame().width == 0 || cumulet_get_bounds(viewer_.get(), box.data(), box.data() + 3) != CUMULET_OK)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const bool early = is_loading();
    if (early) {
      watch.print("stand-in");
      if (!folder.empty()) {
        // Refines it until the load ends.
        write(folder + "/early.png");
        while (is_loading() && frame_progress_ < 1.0) {
          frame();
          if (is_loading()) write(folder + "/early.png");
        }
      }
    }
    must(viewer_.get(), cumulet_wait(viewer_.get(), -1.0));
    frame();
    watch.print(early ? "whole, with it" : "whole, without one");
    if (folder.empty()) return;
    while ((frame().flags & CUMULET_RENDER_CONVERGED) == 0) {
    }
    write(folder + "/whole.png");
  }

 private:
  cumulet_frame_result frame() {
    auto desc = make_desc<cumulet_frame_desc>();
    desc.target = CUMULET_TARGET_NONE;
    desc.width = desc.height = size;
    desc.budget_ms = 100.0;
    auto result = make_desc<cumulet_frame_result>();
    must(viewer_.get(), cumulet_render(viewer_.get(), &desc, &result));
    frame_progress_ = result.progress;
    width_ = result.width;
    height_ = result.height;
    return result;
  }
  [[nodiscard]] bool is_loading() const {
    auto progress = make_desc<cumulet_progress>();
    must(viewer_.get(), cumulet_get_progress(viewer_.get(), &progress));
    return progress.stage != CUMULET_STAGE_IDLE && progress.stage != CUMULET_STAGE_UPLOADING;
  }
  void write(const std::string& file) {
    std::vector<std::uint8_t> rgba(std::size_t{4} * width_ * height_);
    must(viewer_.get(), cumulet_read_display(viewer_.get(), rgba.data(), rgba.size()));
    cumulet::image::write_png(file, width_, height_, rgba);
  }

  Context context_ = Context::create(cumulet::headless::Backend::automatic);
  cumulet::test::ViewerPtr viewer_ = cumulet::bench::make_viewer(context_);
  double frame_progress_ = 0.0;
  std::uint32_t width_ = 0;  // of the image: smaller than the frame's in a preview
  std::uint32_t height_ = 0;
};

}  // namespace

int main(int argc, char** argv) try {
  std::vector<std::string> arguments(argv + 1, argv + argc);
  const bool without = std::erase(arguments, "--without") != 0;
  if (arguments.empty() || arguments.size() > 2) {
    std::fputs("usage: cumulet-bench-early [--without] FILE.vdb [OUT_FOLDER]\n", stderr);
    return 2;
  }
  Bench(!without).run(arguments[0], arguments.size() > 1 ? arguments[1] : std::string());
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "cumulet-bench-early: %s\n", error.what());
  return 1;
}
