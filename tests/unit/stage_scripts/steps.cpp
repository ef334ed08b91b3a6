#include <utility>

#include "stage_scripts/scripts.hpp"

namespace cumulet::test {

void set_grid(StageRecorder& r, const std::string& name, const viewer::GridSettings& settings) {
  r.call(name, [&] { r.viewer().set_grid(settings); });
}

void add(StageRecorder& r, const std::string& name, const InstancePtr& instance) {
  r.call("add " + name, [&] { r.viewer().add_instance(instance); });
}

void remove(StageRecorder& r, const std::string& name, const InstancePtr& instance) {
  r.call("remove " + name, [&] { r.viewer().remove_instance(*instance); });
}

void edit(StageRecorder& r, const std::string& name, const InstancePtr& instance,
          const std::function<void(viewer::InstanceSettings&)>& change) {
  r.call(name, [&] { instance->edit(change); });
  r.wait();
  r.frame();
}

SequencePtr sequence_of(const std::vector<std::string>& paths, std::uint64_t memory_bytes, bool suggested) {
  auto files = std::make_shared<viewer::FrameFiles>();
  files->paths = paths;
  files->shown.suggested_density_scale = suggested;
  viewer::SequenceState state;
  state.playback.count = files->count();
  state.memory_bytes = memory_bytes;
  return std::make_shared<viewer::Sequence>(std::move(files), state);
}

void set_sequence(StageRecorder& r, const SequencePtr& sequence) {
  r.call(sequence ? "set the sequence" : "remove the sequence", [&] { r.viewer().set_sequence(sequence); });
}

void simulate_display(StageRecorder& r, bool displays) {
  r.call(displays ? "frames are displayed" : "no frame is displayed", [&] {
    viewer::Viewer::SimulatedGl gl;
    gl.displays_frames = displays;
    r.viewer().simulate_gl(gl);
  });
}

}  // namespace cumulet::test
