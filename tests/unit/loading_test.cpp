// Loading: which failures are reported and for how long, and that relative paths are resolved at the call.
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "base/file_path.hpp"
#include "cumulet/cumulet.h"
#include "jobs/reported_failures.hpp"
#include "support/c_host.hpp"
#include "support/clip.hpp"
#include "support/folder.hpp"
#include "support/radiance.hpp"

namespace {

using namespace cumulet;
using test::Clip;
using test::Folder;
using test::InstanceRef;
using test::LiveRef;
using test::make_ball;
using test::make_desc;
using test::make_quad;
using test::ModelRef;
using test::SequenceRef;
using test::SurfacesRef;
using test::ViewerPtr;
using test::VolumeRef;

constexpr const char* triangle = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
  "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
  "buffers": [{"byteLength": 36, "uri": "triangle.bin"}], "bufferViews": [{"buffer": 0, "byteLength": 36}],
  "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                 "min": [-1, -1, 0], "max": [1, 1, 0]}]})";

void write_triangle(const std::filesystem::path& folder) {
  std::ofstream(folder / "triangle.gltf") << triangle;
  const std::array<float, 9> corners{-1, -1, 0, 1, -1, 0, 0, 1, 0};
  std::ofstream(folder / "triangle.bin", std::ios::binary)
      .write(reinterpret_cast<const char*>(corners.data()), sizeof corners);
}

SequenceRef make_sequence(const std::vector<std::string>& paths) {
  std::vector<const char*> names;
  for (const std::string& path : paths) names.push_back(path.c_str());
  auto desc = make_desc<cumulet_sequence_desc>();
  desc.paths = names.data();
  desc.count = names.size();
  return test::made_by<SequenceRef>(cumulet_sequence_create, desc);
}

ViewerPtr make_detached() {
  const auto desc = make_desc<cumulet_create_desc>();
  cumulet_viewer* out = nullptr;
  EXPECT_EQ(cumulet_create(&desc, &out, nullptr, 0), CUMULET_OK);
  return ViewerPtr(out);
}

class Loading : public testing::Test {
 protected:
  Loading() {
    write_triangle(folder_.path());
    std::ofstream(folder_ / "sky.hdr", std::ios::binary) << test::radiance_file(16, 8);
    std::ofstream(folder_ / "broken.vdb") << "no volume";
  }

  cumulet_status wait() { return cumulet_wait(v_, -1.0); }
  [[nodiscard]] std::string error() const { return cumulet_last_error(v_); }
  cumulet_progress progress() {
    auto progress = make_desc<cumulet_progress>();
    EXPECT_EQ(cumulet_get_progress(v_, &progress), CUMULET_OK);
    return progress;
  }
  // Expects that the status and the frame report a failure of this file.
  void expect_reported(const std::string& file) {
    SCOPED_TRACE(file);
    EXPECT_EQ(wait(), CUMULET_ERROR_FILE);
    EXPECT_NE(error().find(file), std::string::npos) << error();
    const cumulet_progress reported = progress();
    EXPECT_EQ(reported.status, CUMULET_ERROR_FILE);
    EXPECT_EQ(reported.message, error()) << "in one order";
  }
  void expect_none() {
    EXPECT_EQ(wait(), CUMULET_OK) << error();
    EXPECT_EQ(progress().status, CUMULET_OK) << progress().message;
  }

  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }

  Folder folder_;
  Clip clip_{2};
  VolumeRef volume_ = make_ball(8);
  SurfacesRef surfaces_ = make_quad({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0});
  ViewerPtr viewer_ = make_detached();
  cumulet_viewer* v_ = viewer_.get();
};

TEST_F(Loading, FailureIsReportedUntilOtherWorkStarts) {
  struct Kind {
    const char* file;
    std::function<void()> fail;
  };
  const std::vector<Kind> kinds{
      {"none.vdb", [&] { EXPECT_EQ(cumulet_load_volume(v_, "none.vdb", nullptr), CUMULET_OK); }},
      {"none.1.vdb",
       [&] {
         EXPECT_EQ(cumulet_set_sequence(v_, make_sequence({"none.1.vdb", "none.2.vdb"}).get()), CUMULET_OK);
       }},
      {"none.gltf", [&] { EXPECT_EQ(cumulet_load_surfaces(v_, "none.gltf"), CUMULET_OK); }},
      {"none.hdr", [&] { EXPECT_EQ(cumulet_load_environment(v_, "none.hdr"), CUMULET_OK); }}};
  const std::vector<std::function<void()>> others{
      [&] { EXPECT_EQ(cumulet_load_volume(v_, clip_.path(0).c_str(), nullptr), CUMULET_OK); },
      [&] { EXPECT_EQ(cumulet_set_volume(v_, volume_.get()), CUMULET_OK); },
      [&] { EXPECT_EQ(cumulet_set_sequence(v_, make_sequence(clip_.paths()).get()), CUMULET_OK); },
      [&] { EXPECT_EQ(cumulet_load_surfaces(v_, path("triangle.gltf").c_str()), CUMULET_OK); },
      [&] { EXPECT_EQ(cumulet_set_surfaces(v_, surfaces_.get()), CUMULET_OK); },
      [&] { EXPECT_EQ(cumulet_load_environment(v_, path("sky.hdr").c_str()), CUMULET_OK); }};
  for (const Kind& kind : kinds) {
    for (const auto& other : others) {
      kind.fail();
      expect_reported(kind.file);
      expect_reported(kind.file);  // with each call
      other();
      expect_none();
      expect_none();
      kind.fail();
      expect_reported(kind.file);  // an equal failure of a new load
    }
  }
}

TEST_F(Loading, AnUnreportedFailureIsNotForgotten) {
  ASSERT_EQ(cumulet_load_surfaces(v_, "none.gltf"), CUMULET_OK);
  ASSERT_EQ(cumulet_load_volume(v_, clip_.path(0).c_str(), nullptr), CUMULET_OK);
  ASSERT_EQ(cumulet_set_environment(v_, nullptr), CUMULET_OK);
  expect_reported("none.gltf");
  // Several failures are reported one after another. Each kind also has its own status.
  ASSERT_EQ(cumulet_load_environment(v_, "none.hdr"), CUMULET_OK);
  ASSERT_EQ(cumulet_load_volume(v_, "none.vdb", nullptr), CUMULET_OK);
  expect_reported("none.vdb");
  const cumulet_progress reported = progress();
  EXPECT_EQ(reported.volume_status, CUMULET_ERROR_FILE);
  EXPECT_EQ(reported.surfaces_status, CUMULET_ERROR_FILE);
  EXPECT_EQ(reported.environment_status, CUMULET_ERROR_FILE);
  ASSERT_EQ(cumulet_set_volume(v_, volume_.get()), CUMULET_OK);
  expect_reported("none.hdr");
  ASSERT_EQ(cumulet_set_volume(v_, volume_.get()), CUMULET_OK);
  expect_none();
  EXPECT_EQ(progress().surfaces_status, CUMULET_ERROR_FILE) << "they still are not there";
  EXPECT_EQ(progress().environment_status, CUMULET_ERROR_FILE);
}

TEST_F(Loading, SettingAKindClearsItsFailure) {
  const auto clear = [&](const char* file, cumulet_status set) {
    SCOPED_TRACE(file);
    EXPECT_EQ(set, CUMULET_OK);
    // Cleared by the call, without a wait.
    const cumulet_progress reported = progress();
    EXPECT_EQ(reported.status, CUMULET_OK) << reported.message;
    EXPECT_EQ(reported.volume_status, CUMULET_OK);
    EXPECT_EQ(reported.surfaces_status, CUMULET_OK);
    EXPECT_EQ(reported.environment_status, CUMULET_OK);
    expect_none();
  };
  for (cumulet_volume* volume : {static_cast<cumulet_volume*>(nullptr), volume_.get()}) {
    ASSERT_EQ(cumulet_load_volume(v_, "none.vdb", nullptr), CUMULET_OK);
    expect_reported("none.vdb");
    clear("volume", cumulet_set_volume(v_, volume));
    ASSERT_EQ(cumulet_set_sequence(v_, make_sequence({"none.1.vdb"}).get()), CUMULET_OK);
    expect_reported("none.1.vdb");
    clear("sequence", cumulet_set_volume(v_, volume));
  }
  ASSERT_EQ(cumulet_set_sequence(v_, make_sequence({"none.1.vdb"}).get()), CUMULET_OK);
  expect_reported("none.1.vdb");
  clear("sequence", cumulet_set_sequence(v_, nullptr));
  for (cumulet_surfaces* surfaces : {static_cast<cumulet_surfaces*>(nullptr), surfaces_.get()}) {
    ASSERT_EQ(cumulet_load_surfaces(v_, "none.gltf"), CUMULET_OK);
    expect_reported("none.gltf");
    clear("surfaces", cumulet_set_surfaces(v_, surfaces));
  }
  const test::EnvironmentRef sky = test::make_environment(8, 4);
  for (cumulet_environment* environment : {static_cast<cumulet_environment*>(nullptr), sky.get()}) {
    ASSERT_EQ(cumulet_load_environment(v_, "none.hdr"), CUMULET_OK);
    expect_reported("none.hdr");
    clear("environment", cumulet_set_environment(v_, environment));
  }
}

// An instance whose file is missing, and a dynamic volume that does not fit.
TEST_F(Loading, LiveVolumesAndInstancesReportFailuresAlike) {
  const auto live_desc = make_desc<cumulet_dynamic_volume_desc>();
  const LiveRef live = test::made_by<LiveRef>(cumulet_dynamic_volume_create, live_desc);
  const auto limit = [&](std::uint64_t bytes) {
    auto limits = make_desc<cumulet_limits_desc>();
    limits.memory_bytes = bytes;
    ASSERT_EQ(cumulet_set_limits(v_, &limits), CUMULET_OK);
  };
  const auto expect_too_large = [&] {
    EXPECT_EQ(wait(), CUMULET_ERROR_OUT_OF_MEMORY);
    const cumulet_progress reported = progress();
    EXPECT_EQ(reported.volume_status, CUMULET_ERROR_OUT_OF_MEMORY);
    EXPECT_EQ(reported.message, error());
  };
  const auto missing = make_sequence({"none.1.vdb"});
  auto desc = make_desc<cumulet_instance_desc>();
  desc.sequence = missing.get();
  const InstanceRef instance = test::make_instance(desc);
  ASSERT_EQ(cumulet_add_instance(v_, instance.get()), CUMULET_OK);
  expect_reported("none.1.vdb");
  ASSERT_EQ(cumulet_set_surfaces(v_, surfaces_.get()), CUMULET_OK);
  expect_none();
  EXPECT_EQ(progress().volume_status, CUMULET_ERROR_FILE);
  ASSERT_EQ(cumulet_remove_instance(v_, instance.get()), CUMULET_OK);
  EXPECT_EQ(progress().volume_status, CUMULET_OK);

  limit(1);
  std::vector<float> values(512, 1.0F);
  auto dense = make_desc<cumulet_dense_desc>();
  dense.values = values.data();
  dense.value_count = values.size();
  for (int32_t& size : dense.size) size = 8;
  auto field = make_desc<cumulet_field>();
  field.dense = &dense;
  auto state = make_desc<cumulet_volume_fields_desc>();
  state.fields = &field;
  state.field_count = 1;
  ASSERT_EQ(cumulet_dynamic_volume_set(live.get(), &state, nullptr, 0), CUMULET_OK);
  ASSERT_EQ(cumulet_set_dynamic_volume(v_, live.get()), CUMULET_OK);
  expect_too_large();
  ASSERT_EQ(cumulet_load_surfaces(v_, path("triangle.gltf").c_str()), CUMULET_OK);
  expect_none();
  ASSERT_EQ(cumulet_set_dynamic_volume(v_, nullptr), CUMULET_OK);
  EXPECT_EQ(progress().volume_status, CUMULET_OK);
}

TEST_F(Loading, RenderReportsFailuresLikeWait) {
  const headless::Context context = headless::Context::create(headless::Backend::automatic);
  ASSERT_EQ(cumulet_attach(v_, headless::Context::get_proc, const_cast<headless::Context*>(&context)), CUMULET_OK);
  const auto failed = [&] {
    const auto frame = [] {
      auto desc = make_desc<cumulet_frame_desc>();
      desc.target = CUMULET_TARGET_NONE;
      return desc;
    }();
    auto result = make_desc<cumulet_frame_result>();
    EXPECT_EQ(cumulet_render(v_, &frame, &result), CUMULET_OK);
    return (result.flags & CUMULET_RENDER_FAILED) != 0;
  };
  // Reported by a frame without a call of cumulet_wait.
  ASSERT_EQ(cumulet_load_surfaces(v_, "none.gltf"), CUMULET_OK);
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!failed() && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(failed());
  ASSERT_EQ(cumulet_set_volume(v_, volume_.get()), CUMULET_OK);
  EXPECT_FALSE(failed());
  expect_none();
  EXPECT_FALSE(failed());
  ASSERT_EQ(cumulet_load_volume(v_, "none.vdb", nullptr), CUMULET_OK);
  expect_reported("none.vdb");
  EXPECT_TRUE(failed());
  ASSERT_EQ(cumulet_set_volume(v_, nullptr), CUMULET_OK);
  EXPECT_FALSE(failed());
  viewer_.reset();  // before its context
}

TEST_F(Loading, AFileThatWasReadButNotShownLeavesNothing) {
  ASSERT_EQ(cumulet_load_volume(v_, clip_.paths().front().c_str(), nullptr), CUMULET_OK);
  // Progress does not take results.
  while (progress().stage != CUMULET_STAGE_IDLE) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  ASSERT_EQ(cumulet_set_volume(v_, nullptr), CUMULET_OK);
  expect_none();  // a result that nobody takes would keep the viewer busy
  ASSERT_EQ(cumulet_set_volume(v_, volume_.get()), CUMULET_OK);
  expect_none();
}

TEST(ReportedFailures, CopiesAreReportedOnce) {
  using viewer::ContentFailures;
  using viewer::ContentKind;
  using viewer::ReportedFailures;
  ReportedFailures reported;
  const auto report = [&](const ContentFailures& failures) {
    const auto first = reported.report(failures, ReportedFailures::Cancelled::reported);
    return first ? std::string(first->what()) : std::string();
  };
  ContentFailures failures;
  EXPECT_EQ(report(failures), "");
  failures[ContentKind::environment] = Error(ErrorCode::file, "sky");
  failures[ContentKind::models] = Error(ErrorCode::file, "model");
  EXPECT_EQ(report(failures), "model");
  reported.retire();
  const ContentFailures copy = failures;
  EXPECT_EQ(report(copy), "sky");
  reported.retire();
  EXPECT_EQ(report(copy), "");
  failures[ContentKind::models] = Error(ErrorCode::file, "model");
  EXPECT_EQ(report(failures), "model") << "it failed again";
  failures[ContentKind::volume] = Error(ErrorCode::cancelled, "cancelled");
  EXPECT_EQ(reported.report(failures, ReportedFailures::Cancelled::left_out)->code(), ErrorCode::file);
  EXPECT_EQ(report(failures), "cancelled");
}

// ---- paths ----

// Sets the process' current folder during its lifetime.
class CurrentFolder {
 public:
  explicit CurrentFolder(const std::filesystem::path& folder) { std::filesystem::current_path(folder); }
  CurrentFolder(const CurrentFolder&) = delete;
  CurrentFolder& operator=(const CurrentFolder&) = delete;
  ~CurrentFolder() { std::filesystem::current_path(before_); }

 private:
  std::filesystem::path before_ = std::filesystem::current_path();
};

TEST(FilePaths, ResolveAtConstructionAndKeepTheGivenName) {
  const Folder here;
  const Folder there;
  const CurrentFolder current(here.path());
  const FilePath path("clouds/a.vdb");
  const FilePath whole((here / "b.vdb").string());
  const FilePath other("c.vdb", path);
  std::filesystem::current_path(there.path());
  EXPECT_EQ(path.given(), "clouds/a.vdb");
  EXPECT_EQ(path.absolute(), here / "clouds/a.vdb");
  EXPECT_EQ(whole.absolute(), here / "b.vdb");
  EXPECT_EQ(other.absolute(), here / "c.vdb");
  EXPECT_EQ(FilePath().absolute(), std::filesystem::path());
  // If the current folder was removed, the name stays as given.
  std::filesystem::current_path(here.path());
  std::filesystem::create_directory("gone");
  std::filesystem::current_path("gone");
  std::filesystem::remove(here / "gone");
  EXPECT_EQ(FilePath("d.vdb").absolute(), std::filesystem::path("d.vdb"));
}

// A worker reads after the current folder has changed.
TEST_F(Loading, RelativePathsUseTheWorkingFolderOfTheCall) {
  const Folder elsewhere;
  const CurrentFolder current(folder_.path());
  for (int frame = 0; frame < 2; ++frame)
    std::filesystem::copy_file(clip_.path(frame), "clip." + std::to_string(frame) + ".vdb");
  // Work of other kinds delays the workers until the folder has changed.
  const auto after_leaving = [&](const char* what, const std::function<void()>& call) {
    SCOPED_TRACE(what);
    std::filesystem::current_path(folder_.path());
    call();
    std::filesystem::current_path(elsewhere.path());
    EXPECT_EQ(wait(), CUMULET_OK) << error();
  };
  for (int round = 0; round < 10; ++round) {
    after_leaving("volume", [&] { ASSERT_EQ(cumulet_load_volume(v_, "clip.0.vdb", nullptr), CUMULET_OK); });
    after_leaving("surfaces", [&] { ASSERT_EQ(cumulet_load_surfaces(v_, "triangle.gltf"), CUMULET_OK); });
    after_leaving("environment", [&] { ASSERT_EQ(cumulet_load_environment(v_, "./sky.hdr"), CUMULET_OK); });
    after_leaving("sequence", [&] {
      ASSERT_EQ(cumulet_set_sequence(v_, make_sequence({"clip.0.vdb", "clip.1.vdb"}).get()), CUMULET_OK);
    });
  }
  // A frame is read much later.
  std::filesystem::current_path(folder_.path());
  const SequenceRef sequence = make_sequence({"clip.0.vdb", "clip.1.vdb", "none.vdb"});
  std::filesystem::current_path(elsewhere.path());
  ASSERT_EQ(cumulet_set_sequence(v_, sequence.get()), CUMULET_OK);
  ASSERT_EQ(wait(), CUMULET_OK) << error();
  ASSERT_EQ(cumulet_sequence_set_frame(sequence.get(), 1.0), CUMULET_OK);
  ASSERT_EQ(wait(), CUMULET_OK) << error();
  ASSERT_EQ(cumulet_rebuild(v_), CUMULET_OK);
  ASSERT_EQ(wait(), CUMULET_OK) << error();
  // Messages contain the name as given.
  ASSERT_EQ(cumulet_sequence_set_frame(sequence.get(), 2.0), CUMULET_OK);
  ASSERT_EQ(wait(), CUMULET_OK) << error();
  std::array<char, 256> cause{};
  ASSERT_EQ(cumulet_get_sequence_frame(v_, 2, cause.data(), cause.size()), CUMULET_OK);
  EXPECT_EQ(std::string(cause.data()), "none.vdb: no such file");
  const auto expect_missing = [&](cumulet_status loaded, const std::string& name) {
    ASSERT_EQ(loaded, CUMULET_OK);
    EXPECT_EQ(wait(), CUMULET_ERROR_FILE);
    EXPECT_EQ(error().rfind(name + ": ", 0), 0U) << error();
  };
  expect_missing(cumulet_load_surfaces(v_, "gone.gltf"), "gone.gltf");
  expect_missing(cumulet_load_environment(v_, "gone.hdr"), "gone.hdr");
}

// An inspection reads a grid's voxels later, on request.
TEST_F(Loading, AnInspectionReadsTheFileThatWasNamed) {
  const Folder elsewhere;
  const CurrentFolder current(std::filesystem::path(clip_.path(0)).parent_path());
  cumulet_inspection* inspection = nullptr;
  ASSERT_EQ(cumulet_inspect_volume_file("clip.0.vdb", &inspection, nullptr, 0), CUMULET_OK);
  std::filesystem::current_path(elsewhere.path());
  auto info = make_desc<cumulet_grid_info>();
  EXPECT_EQ(cumulet_inspection_get_grid(inspection, 0, &info), CUMULET_OK);
  EXPECT_GT(info.active_voxels, 0U);
  cumulet_inspection_release(inspection);
}

}  // namespace
