// A host that exits while its viewer works.
//
//   host WORK WAY MILLISECONDS FOLDER
//
// WORK: load, build, pose, sequence, live or frames, restarted continuously. WAY: how the process ends after this time:
// exit, return, thread (a second thread calls exit), callback (the trace callback calls exit), static (a static object
// destroys the viewer), fork (a child exits, and the parent returns). Compiled with CUMULET_EXIT_LOADS, the host loads
// the library, and WAY may be unload (dlclose, then return). FOLDER has the files of exits.py. The exit status is 7 on
// success.
#include <dlfcn.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "cumulet/cumulet.h"
#ifndef CUMULET_EXIT_LOADS
#include "headless.hpp"
#endif

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr int left_well = 7;
constexpr int failed = 1;

// The functions of the library: linked, or those of the loaded file.
struct Library {
#define CUMULET_FUNCTIONS(each)                                                                                 \
  each(cumulet_create) each(cumulet_destroy) each(cumulet_last_error) each(cumulet_wait) each(cumulet_set_grid) \
      each(cumulet_load_volume) each(cumulet_set_volume) each(cumulet_volume_from_dense) each(cumulet_rebuild)  \
          each(cumulet_load_surfaces) each(cumulet_set_surface_settings) each(cumulet_sequence_create)          \
              each(cumulet_sequence_set_frame) each(cumulet_set_sequence) each(cumulet_dynamic_volume_create)   \
                  each(cumulet_dynamic_volume_set) each(cumulet_set_dynamic_volume) each(cumulet_render)        \
                      each(cumulet_frame_all) each(cumulet_load_environment)
#define CUMULET_MEMBER(name) decltype(&::name) name = nullptr;
  CUMULET_FUNCTIONS(CUMULET_MEMBER)
  void* handle = nullptr;

  Library() {
#ifdef CUMULET_EXIT_LOADS
    handle = dlopen(CUMULET_EXIT_LOADS, RTLD_NOW | RTLD_LOCAL);
    if (handle == nullptr) {
      std::fprintf(stderr, "%s\n", dlerror());
      std::_Exit(failed);
    }
#define CUMULET_FIND(name) name = reinterpret_cast<decltype(name)>(dlsym(handle, #name));
#else
#define CUMULET_FIND(name) name = &::name;
#endif
    CUMULET_FUNCTIONS(CUMULET_FIND)
  }
};

template <class Desc>
Desc make_desc() {
  Desc desc{};
  desc.struct_size = sizeof desc;
  return desc;
}

// A static object of the host that is created by its first use, on any thread.
class Journal {
 public:
  Journal() = default;
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;
  ~Journal() { open_ = false; }
  void note() {
    if (!open_) {
      std::fputs("a callback came after the host's statics were destroyed\n", stderr);
      std::_Exit(failed);
    }
    ++notes_;
  }

 private:
  std::atomic<bool> open_ = true;
  std::atomic<long> notes_ = 0;
};

Journal& journal() {
  static Journal only;
  return only;
}

std::atomic<bool> leave_in_callback = false;

void log(void* /*user*/, cumulet_log_level /*level*/, const char* /*message*/) { journal().note(); }

void update(void* /*user*/) { journal().note(); }

// Called when a job ends, on its thread; in a frame, inside the call.
void trace(void* /*user*/, const char* /*name*/, double /*begin*/, double /*end*/) {
  journal().note();
  if (leave_in_callback.exchange(false)) std::exit(left_well);
}

// A viewer with continuous work.
class Host {
 public:
  Host(std::string work, std::string folder) : work_(std::move(work)), folder_(std::move(folder)) {
    auto desc = make_desc<cumulet_create_desc>();
    desc.log = log;
    desc.update = update;
    desc.trace = trace;
#ifndef CUMULET_EXIT_LOADS
    if (work_ == "frames") {
      context_ = cumulet::headless::Context::create(cumulet::headless::Backend::automatic);
      desc.get_proc = cumulet::headless::Context::get_proc;
      desc.get_proc_user = &*context_;
    }
#endif
    char error[512] = "";
    if (of.cumulet_create(&desc, &viewer, error, sizeof error) != CUMULET_OK) give_up(error);
    begin();
  }

  // Starts work for the worker threads.
  void step() {
    ++steps_;
    if (work_ == "load") {
      if (steps_ % 3 == 0) of.cumulet_load_volume(viewer, path("cloud.vdb").c_str(), nullptr);
      if (steps_ % 5 == 0) of.cumulet_load_environment(viewer, path("sky.hdr").c_str());
    } else if (work_ == "build" || work_ == "frames") {
      auto grid = make_desc<cumulet_grid_desc>();
      grid.threshold = 0.05 + 0.01 * (steps_ % 7);
      if (steps_ % 3 == 0) of.cumulet_set_grid(viewer, &grid);
    } else if (work_ == "pose") {
      if (steps_ % 16 == 0) of.cumulet_load_surfaces(viewer, path("wave.gltf").c_str());
      auto settings = make_desc<cumulet_surface_settings_desc>();
      settings.time = 0.01 * (steps_ % 100);
      of.cumulet_set_surface_settings(viewer, &settings);
    } else if (work_ == "sequence") {
      of.cumulet_sequence_set_frame(sequence_, steps_ % 4);
      if (steps_ % 16 == 0) of.cumulet_rebuild(viewer);
    } else if (work_ == "live") {
      set_live();
    }
    if (work_ == "frames") {
      auto frame = make_desc<cumulet_frame_desc>();
      frame.target = CUMULET_TARGET_TEXTURE;
      frame.width = frame.height = 64;
      frame.budget_ms = 5.0;
      of.cumulet_render(viewer, &frame, nullptr);
    } else {
      of.cumulet_wait(viewer, 2.0);
    }
  }

  Library of;
  cumulet_viewer* viewer = nullptr;

 private:
  [[noreturn]] static void give_up(const char* cause) {
    std::fprintf(stderr, "%s\n", cause);
    std::_Exit(failed);
  }
  [[nodiscard]] std::string path(const char* name) const { return folder_ + "/" + name; }
  void require(cumulet_status status) const {
    if (status != CUMULET_OK) give_up(of.cumulet_last_error(viewer));
  }

  void fill() {
    voxels_.resize(std::size_t{side} * side * side);
    for (std::size_t i = 0; i < voxels_.size(); ++i)
      voxels_[i] = std::max(
          0.0F, std::sin(0.37F * static_cast<float>(i % side)) * std::sin(0.11F * static_cast<float>(i / side % side)));
  }
  [[nodiscard]] cumulet_dense_desc dense() const {
    auto desc = make_desc<cumulet_dense_desc>();
    desc.values = voxels_.data();
    desc.value_count = voxels_.size();
    for (int32_t& size : desc.size) size = side;
    return desc;
  }
  void set_live() {
    const cumulet_dense_desc voxels = dense();
    auto field = make_desc<cumulet_field>();
    field.dense = &voxels;
    auto state = make_desc<cumulet_volume_fields_desc>();
    state.fields = &field;
    state.field_count = 1;
    of.cumulet_dynamic_volume_set(live_, &state, nullptr, 0);
  }

  void begin() {
    fill();
    if (work_ == "load") require(of.cumulet_load_volume(viewer, path("cloud.vdb").c_str(), nullptr));
    if (work_ == "pose") require(of.cumulet_load_surfaces(viewer, path("wave.gltf").c_str()));
    if (work_ == "build" || work_ == "frames") {
      const cumulet_dense_desc voxels = dense();
      cumulet_volume* volume = nullptr;
      require(of.cumulet_volume_from_dense(&voxels, &volume, nullptr, 0));
      require(of.cumulet_set_volume(viewer, volume));
    }
    if (work_ == "frames") require(of.cumulet_frame_all(viewer));
    if (work_ == "sequence") {
      std::vector<std::string> paths;
      for (int frame = 0; frame < 4; ++frame) paths.push_back(path("clip.") + std::to_string(frame) + ".vdb");
      std::vector<const char*> names;
      for (const std::string& one : paths) names.push_back(one.c_str());
      auto desc = make_desc<cumulet_sequence_desc>();
      desc.paths = names.data();
      desc.count = names.size();
      require(of.cumulet_sequence_create(&desc, &sequence_, nullptr, 0));
      require(of.cumulet_set_sequence(viewer, sequence_));
    }
    if (work_ == "live") {
      auto desc = make_desc<cumulet_dynamic_volume_desc>();
      require(of.cumulet_dynamic_volume_create(&desc, &live_, nullptr, 0));
      set_live();
      require(of.cumulet_set_dynamic_volume(viewer, live_));
    }
  }

  static constexpr int side = 64;
  std::string work_;
  std::string folder_;
  std::vector<float> voxels_;
  cumulet_sequence* sequence_ = nullptr;
  cumulet_dynamic_volume* live_ = nullptr;
  int steps_ = 0;
#ifndef CUMULET_EXIT_LOADS
  std::optional<cumulet::headless::Context> context_;
#endif
};

// Destroys the viewer during the exit, after the library's threads have ended. A forked child ends here: log4cplus,
// which Debian's OpenVDB links, waits for threads that the child does not have.
struct Owner {
  Owner() = default;
  Owner(const Owner&) = delete;
  Owner& operator=(const Owner&) = delete;
  ~Owner() {
    if (host != nullptr) host->of.cumulet_destroy(host->viewer);
    if (is_child) std::_Exit(left_well);
  }
  Host* host = nullptr;
  bool is_child = false;
};

// TBB loads its allocator when it first runs a task. A thread that did so during dlclose() would wait for the loader's
// lock until the library gives up waiting for that thread. It is therefore loaded before the first thread starts.
bool tbb_has_its_allocator() {
  const char* const name = "libtbbmalloc.so.2";
  if (void* const loaded = dlopen(name, RTLD_NOW | RTLD_NOLOAD)) return dlclose(loaded) == 0;
  return dlopen(name, RTLD_NOW) == nullptr;  // without the file, TBB uses malloc
}

int unload(Host& host) {
  if (!tbb_has_its_allocator()) {
    std::fputs("a thread of the library would load TBB's allocator\n", stderr);
    return failed;
  }
  dlclose(host.of.handle);
  if (dlopen(CUMULET_EXIT_LIBRARY, RTLD_NOW | RTLD_NOLOAD) != nullptr) {
    std::fputs("the library was not unloaded\n", stderr);
    return failed;
  }
  std::this_thread::sleep_for(milliseconds(20));  // a thread that was still running would crash
  return left_well;
}

// Continues working until the child has ended. The child must not wait for threads that it does not have.
int wait_for_child(Host& host, pid_t child) {
  const auto until = Clock::now() + std::chrono::seconds(20);
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    if (Clock::now() > until) {
      kill(child, SIGKILL);
      std::fputs("the child hangs\n", stderr);
      return failed;
    }
    host.step();
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : failed;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  const std::string way = argv[2];
  static Owner owner;
  auto* const host = new Host(argv[1], argv[4]);  // a host that never destroys its viewer
  const auto moment = Clock::now() + milliseconds(std::atoi(argv[3]));
  if (way == "static") owner.host = host;
  if (way == "thread") {
    std::thread([moment] {
      std::this_thread::sleep_until(moment);
      std::exit(left_well);
    }).detach();
  }
  while (way == "thread" || Clock::now() < moment) host->step();
  if (way == "callback") {
    leave_in_callback = true;
    for (;;) host->step();
  }
  if (way == "unload") return unload(*host);
  if (way == "fork") {
    const pid_t child = fork();
    if (child != 0) return wait_for_child(*host, child);
    owner.host = host;
    owner.is_child = true;
  }
  if (way == "exit") std::exit(left_well);
  return left_well;
}
