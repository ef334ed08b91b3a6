// Shader programs: shared by all viewers of a cumulet_shader_cache, compiled once, and cached in files.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "base/error.hpp"
#include "gl/programs.hpp"
#include "support/c_host.hpp"
#include "support/fake_gl.hpp"
#include "support/folder.hpp"

namespace {

using cumulet::Error;
using cumulet::gl::Program;
using cumulet::gl::ProgramFiles;
using cumulet::gl::ProgramKey;
using cumulet::gl::ProgramPool;
using cumulet::gl::Programs;
using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::test::FakeGl;
using cumulet::test::Folder;
using cumulet::test::HostTarget;
using cumulet::test::make_ball;
using cumulet::test::make_desc;
using cumulet::test::make_plain_viewer;
using cumulet::test::picture_of;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
namespace fs = std::filesystem;
namespace gl = cumulet::gl;

const ProgramKey resolve{"resolve.comp", {"CM_HOLES 0", "CM_BACKGROUND 0"}};
const ProgramKey composite{"composite.frag", {"CM_DEPTH 1"}, "composite.vert"};

std::vector<fs::path> files_in(const Folder& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder.path())) files.push_back(entry.path());
  return files;
}

std::vector<std::byte> bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto* data = reinterpret_cast<const std::byte*>(text.data());
  return {data, data + text.size()};
}

void write(const fs::path& path, const std::vector<std::byte>& bytes) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

class ProgramsTest : public testing::Test {
 protected:
  [[nodiscard]] std::uint64_t compiled() const { return fake_.calls("CompileShader") + fake_.calls("LinkProgram"); }
  [[nodiscard]] std::shared_ptr<ProgramFiles> files() const { return std::make_shared<ProgramFiles>(folder_.path()); }
  // Creates a viewer as a host would, for one image.
  [[nodiscard]] ViewerPtr viewer(cumulet_shader_cache* programs) {
    auto desc = make_desc<cumulet_create_desc>();
    desc.get_proc = FakeGl::get_proc;
    desc.get_proc_user = &fake_;
    desc.shader_cache = programs;
    return make_plain_viewer(desc);
  }

  Folder folder_;
  Context context_ = Context::create(Backend::automatic);
  FakeGl fake_{Context::get_proc, &context_};
  gl::FunctionsPtr gl_ = gl::load_functions(FakeGl::get_proc, &fake_);
};

TEST_F(ProgramsTest, AreCreatedOnceWithStableAddresses) {
  Programs programs(*gl_, nullptr);
  const Program& first = programs.get(resolve);
  EXPECT_EQ(first.state(), Program::State::linked);
  const auto before = compiled();
  EXPECT_EQ(&programs.get(resolve), &first);
  EXPECT_EQ(compiled(), before);
  first.use(*gl_);
  EXPECT_EQ(first.state(), Program::State::ready);
  EXPECT_NE(programs.get(composite).name(), first.name());
  gl_->UseProgram(0);
}

TEST_F(ProgramsTest, FailedBuildIsReportedAndRetriedOnRequest) {
  for (const int call : {1, 2}) {  // after glCreateProgram and glCreateShader
    SCOPED_TRACE(call);
    Programs programs(*gl_, nullptr);
    const auto message = [&] {
      try {
        programs.ask(resolve);
      } catch (const Error& error) {
        return std::string(error.what());
      }
      return std::string();
    };
    fake_.fail_allocation(call + 1);
    const std::string first = message();
    fake_.fail_allocation(-1);
    EXPECT_NE(first.find("resolve.comp"), std::string::npos) << first;
    EXPECT_EQ(programs.state(resolve), Program::State::failed);
    EXPECT_EQ(programs.counts().failed, 1U);
    const auto before = compiled();
    EXPECT_EQ(message(), first);
    EXPECT_EQ(compiled(), before);
    programs.try_again();
    EXPECT_EQ(message(), "");
    EXPECT_EQ(programs.state(resolve), Program::State::linked);
    fake_.fail_allocation(call + 1);
    EXPECT_THROW(programs.get(composite), Error);
    fake_.fail_allocation(-1);
    EXPECT_TRUE(programs.get(composite).usable());
    EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
  }
}

TEST_F(ProgramsTest, AreSharedBetweenSharingContexts) {
  ProgramPool pool;
  const auto first = pool.of_current(*gl_);
  EXPECT_EQ(pool.of_current(*gl_), first);
  const Context other = Context::create(Backend::automatic);
  FakeGl other_fake(Context::get_proc, const_cast<Context*>(&other));
  const auto others = gl::load_functions(FakeGl::get_proc, &other_fake);
  EXPECT_NE(pool.of_current(*others), first);
}

TEST_F(ProgramsTest, ASecondViewerCompilesNothing) {
  auto desc = make_desc<cumulet_shader_cache_desc>();
  cumulet_shader_cache* programs = nullptr;
  ASSERT_EQ(cumulet_shader_cache_create(&desc, &programs, nullptr, 0), CUMULET_OK);
  const VolumeRef volume = make_ball(16, 2.0F);
  const HostTarget target(fake_.real(), 32, 32);
  const ViewerPtr first = viewer(programs);
  ViewerPtr second = viewer(programs);
  cumulet_shader_cache_release(programs);
  const auto picture = picture_of(first.get(), volume.get(), target);
  const auto before = compiled();
  EXPECT_GT(before, 0U);
  EXPECT_EQ(picture_of(second.get(), volume.get(), target), picture);
  EXPECT_EQ(compiled(), before);
  // Programs stay available to the other viewer.
  second.reset();
  EXPECT_EQ(picture_of(first.get(), volume.get(), target), picture);
  EXPECT_EQ(compiled(), before);
  const ViewerPtr own = viewer(nullptr);
  EXPECT_EQ(picture_of(own.get(), volume.get(), target), picture);
  EXPECT_GT(compiled(), before);
}

TEST_F(ProgramsTest, ProgramsEndWithTheLastViewer) {
  auto desc = make_desc<cumulet_shader_cache_desc>();
  cumulet_shader_cache* programs = nullptr;
  ASSERT_EQ(cumulet_shader_cache_create(&desc, &programs, nullptr, 0), CUMULET_OK);
  const VolumeRef volume = make_ball(16, 2.0F);
  {
    const HostTarget target(fake_.real(), 32, 32);
    const ViewerPtr first = viewer(programs);
    const ViewerPtr second = viewer(programs);
    picture_of(first.get(), volume.get(), target);
    picture_of(second.get(), volume.get(), target);
  }
  EXPECT_TRUE(fake_.alive().empty()) << fake_.alive().begin()->first;
  EXPECT_EQ(fake_.wrong_deletes(), 0U);
  cumulet_shader_cache_release(programs);
}

TEST_F(ProgramsTest, BinariesOfAnEarlierRunAreUsed) {
  { EXPECT_TRUE(Programs(*gl_, files()).get(resolve).usable()); }
  if (files_in(folder_).empty()) GTEST_SKIP() << "the driver gives no program binaries";
  const auto before = compiled();
  EXPECT_TRUE(Programs(*gl_, files()).get(resolve).usable());
  EXPECT_EQ(compiled(), before);
  EXPECT_TRUE(Programs(*gl_, files()).get(composite).usable());
  EXPECT_GT(compiled(), before);
}

TEST_F(ProgramsTest, DamagedBinariesAreIgnoredAndRewritten) {
  { EXPECT_TRUE(Programs(*gl_, files()).get(resolve).usable()); }
  if (files_in(folder_).empty()) GTEST_SKIP() << "the driver gives no program binaries";
  ASSERT_EQ(files_in(folder_).size(), 1U);
  const fs::path path = files_in(folder_)[0];
  const auto whole = bytes_of(path);
  const std::vector<std::function<void(std::vector<std::byte>&)>> damages{
      [](auto& bytes) { bytes.clear(); },
      [](auto& bytes) { bytes.resize(20); },
      [](auto& bytes) { bytes.pop_back(); },
      [](auto& bytes) { bytes.push_back(std::byte{0}); },
      [](auto& bytes) { bytes[0] ^= std::byte{1}; },                 // another kind of file
      [](auto& bytes) { bytes[9] ^= std::byte{1}; },                 // of another source or driver
      [](auto& bytes) { bytes[24] ^= std::byte{1}; },                // length
      [](auto& bytes) { bytes[bytes.size() / 2] ^= std::byte{1}; },  // content
      [](auto& bytes) { bytes[40] ^= std::byte{1}; },                // a binary format unknown to the driver
      [](auto& bytes) { std::ranges::fill(bytes, std::byte{0xff}); },
  };
  for (std::size_t i = 0; i < damages.size(); ++i) {
    auto bytes = whole;
    damages[i](bytes);
    write(path, bytes);
    const auto before = compiled();
    EXPECT_TRUE(Programs(*gl_, files()).get(resolve).usable()) << i;
    EXPECT_GT(compiled(), before) << i;
    EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR}) << i;
    EXPECT_EQ(bytes_of(path).size(), whole.size()) << i;
    const auto again = compiled();
    EXPECT_TRUE(Programs(*gl_, files()).get(resolve).usable()) << i;
    EXPECT_EQ(compiled(), again) << i;
  }
}

TEST_F(ProgramsTest, ShadersOfAFolderAreReloaded) {
  fs::copy(CUMULET_GLSL_DIR, folder_.path(), fs::copy_options::recursive);
  const fs::path file = folder_ / "display/resolve.comp";
  const auto original = bytes_of(file);
  const auto edit = [&](const std::string& more) {
    auto bytes = original;
    for (const char c : more) bytes.push_back(static_cast<std::byte>(c));
    const auto before = fs::last_write_time(file);
    write(file, bytes);
    fs::last_write_time(file, before + std::chrono::seconds(2));
    std::this_thread::sleep_for(std::chrono::milliseconds(300));  // the interval at which it checks the folder
  };
  std::vector<std::string> warnings;
  std::vector<std::string> read;
  const cumulet::Log log([&](cumulet::LogLevel level, const char* message) {
    (level == cumulet::LogLevel::info ? read : warnings).emplace_back(message);
  });
  const auto programs = std::make_shared<Programs>(*gl_, nullptr, std::make_shared<gl::ShaderFolder>(folder_.path()));
  const Programs::Turn turn(programs, log);
  const Program& program = programs->get(resolve);
  const std::string from = "shader resolve.comp: read from " + folder_.path().string();
  EXPECT_EQ(read, std::vector{from + ", identical to the library's"});
  programs->refresh();
  const GLuint first = program.name();
  const auto revision = programs->revision();
  edit("\n");
  programs->refresh();
  const GLuint second = program.name();
  EXPECT_NE(second, first);
  EXPECT_NE(programs->revision(), revision);
  EXPECT_TRUE(program.usable());
  const auto newer = programs->revision();
  edit("nonsense\n");
  programs->refresh();
  EXPECT_EQ(program.name(), second);
  EXPECT_EQ(programs->revision(), newer);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].find('\n'), std::string::npos);
  EXPECT_NE(warnings[0].find("resolve.comp"), std::string::npos);
  fs::remove(file);
  EXPECT_THROW(programs->get({"resolve.comp", {"CM_HOLES 1", "CM_BACKGROUND 0"}}), Error);
}

TEST(ProgramFilesTest, KeepRecentlyUsedBinariesWithinTheLimit) {
  const Folder folder;
  ProgramFiles files(folder.path(), 2500);
  const ProgramFiles::Binary binary{7, std::vector<std::byte>(1000, std::byte{42})};
  const auto age = [&] {
    for (const auto& path : files_in(folder))
      fs::last_write_time(path, fs::last_write_time(path) - std::chrono::hours(1));
  };
  files.keep("driver", "one", binary);
  age();
  files.keep("driver", "two", binary);
  age();
  EXPECT_TRUE(files.find("driver", "one"));
  files.keep("driver", "three", binary);
  EXPECT_EQ(files_in(folder).size(), 2U);
  const auto one = files.find("driver", "one");
  ASSERT_TRUE(one);
  EXPECT_EQ(one->format, 7U);
  EXPECT_EQ(one->bytes, binary.bytes);
  EXPECT_FALSE(files.find("driver", "two"));
  EXPECT_FALSE(files.find("another driver", "one"));
}

TEST(ProgramFilesTest, TouchOnlyTheirOwnFiles) {
  const Folder folder;
  const std::string ours(32, 'a');
  const std::vector<std::string> foreign{"notes.program",          "film.part",
                                         ours + ".part",           ours + ".program.part",
                                         ours + "a.program1.part", "x" + ours.substr(1) + ".program",
                                         ours + ".programme1.part"};
  const std::string left = ours + ".program123.part";
  for (const std::string& name : foreign) write(folder / name, std::vector<std::byte>(5000));
  write(folder / left, {std::byte{0}});
  for (const auto& path : files_in(folder)) {
    fs::last_write_time(path, fs::last_write_time(path) - std::chrono::hours(2));
  }
  ProgramFiles files(folder.path(), 1500);
  files.keep("driver", "one", {7, std::vector<std::byte>(1000)});
  EXPECT_TRUE(files.find("driver", "one"));
  for (const std::string& name : foreign) EXPECT_TRUE(fs::exists(folder / name)) << name;
  EXPECT_FALSE(fs::exists(folder / left));
}

TEST(ProgramFilesTest, DamagedHeadersAreDetected) {
  const Folder folder;
  ProgramFiles files(folder.path());
  files.keep("driver", "source", {7, std::vector<std::byte>(100, std::byte{42})});
  const fs::path path = files_in(folder).at(0);
  const auto whole = bytes_of(path);
  for (std::size_t i = 0; i < 48; ++i) {
    auto bytes = whole;
    bytes[i] ^= std::byte{1};
    write(path, bytes);
    EXPECT_FALSE(files.find("driver", "source")) << i;
  }
  write(path, whole);
  EXPECT_TRUE(files.find("driver", "source"));
}

TEST(ProgramFilesTest, WriteFailureGivesAOneLineError) {
  const Folder folder;
  write(folder / "file", {});  // where a folder is needed
  ProgramFiles files(folder / "file" / "inside");
  EXPECT_FALSE(files.find("driver", "source"));
  try {
    files.keep("driver", "source", {1, {std::byte{1}}});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), cumulet::ErrorCode::file);
    EXPECT_NE(std::string(error.what()).find(folder.path().string()), std::string::npos);
  }
}

}  // namespace
