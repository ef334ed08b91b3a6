#include "up_axis.hpp"

#include <cstdio>
#include <string>
#include <vector>

#include "info.hpp"

namespace cumulet::demo {
namespace {

void print(const std::string& line) { std::fprintf(stderr, "%s\n", one_line(line).c_str()); }

}  // namespace

void choose_up_axis(RenderOptions& options, const std::optional<FramePlan>& plan) {
  if (options.info || options.given.up) return;
  SceneOptions& scene = options.scene;
  const std::vector<std::string> files = plan ? plan->analyzed_by : std::vector{scene.volume};
  if (options.default_up && scene.is_shown() && known_up_axis(files) == UpAxis::z) {
    scene.up = UpAxis::z;
    print(scene.volume + ": Z is up, as its metadata says: using --up z (--up y disables this)");
  }
  SceneOptions first = scene;
  if (!files.empty()) first.volume = files.front();
  for (const std::string& hint : up_hints(first)) print(hint);
}

}  // namespace cumulet::demo
