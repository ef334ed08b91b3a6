#include "samples.hpp"

#include <fcntl.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): kill() is POSIX
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <program.hpp>
#include <scene_file.hpp>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "sample_pictures.hpp"

namespace cumulet::demo {
namespace {

namespace fs = std::filesystem;

constexpr const char* frame = "12";  // of the explosion, which sample_explosion.json shows
constexpr std::array files = {"sample.json", "cumulus.vdb", "mountains.glb", "sample_explosion.json",
                              "explosion_0012.vdb"};

/// Returns the bytes of an array as text.
template <std::size_t size>
std::string_view text_of(const unsigned char (&bytes)[size]) {
  return {reinterpret_cast<const char*>(bytes), size};
}

}  // namespace

const std::array<Sample, 2>& samples() {
  static const std::array<Sample, 2> all = {
      Sample{"Cloud", "A cumulus over mountains, with a lake and a tower.", "sample.json", text_of(cumulus_picture)},
      Sample{"Explosion", "Fire and soot in the evening.", "sample_explosion.json", text_of(explosion_picture)}};
  return all;
}

SampleFiles::SampleFiles(std::string program, std::string folder)
    : program_(std::move(program)), folder_(std::move(folder)) {}

SampleFiles::~SampleFiles() {
  if (process_ == 0) return;
  ::kill(process_, SIGTERM);
  while (!has_ended()) ::usleep(1000);
}

bool SampleFiles::are_complete() const {
  return std::ranges::all_of(files, [&](const char* file) {
    std::error_code error;
    return fs::exists(fs::path(folder_) / file, error);
  });
}

void SampleFiles::request(const std::string& scene) {
  if (!exist()) throw std::runtime_error("the sample scenes need cumulet-scene beside this program");
  wanted_ = scene;
  if (writes() || are_complete()) return;
  std::string option = "--frame";
  std::string number = frame;
  std::array<char*, 5> arguments = {program_.data(), folder_.data(), option.data(), number.data(), nullptr};
  posix_spawn_file_actions_t actions{};
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  const int failure = ::posix_spawn(&process_, program_.c_str(), &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failure == 0) return;
  process_ = 0;
  wanted_.clear();
  throw std::runtime_error(program_ + ": " + std::generic_category().message(failure));
}

bool SampleFiles::has_ended() {
  const pid_t ended = ::waitpid(process_, &status_, WNOHANG);
  if (ended == 0 || (ended < 0 && errno == EINTR)) return false;
  process_ = 0;
  return true;
}

std::optional<std::string> SampleFiles::take() {
  if (wanted_.empty() || (writes() && !has_ended())) return std::nullopt;
  const std::string scene = std::exchange(wanted_, {});
  if (!are_complete()) throw std::runtime_error(folder_ + ": cumulet-scene has not written the sample scenes");
  return (fs::path(folder_) / scene).string();
}

std::string sample_program() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (error) return "";
  const fs::path program = self.parent_path() / "cumulet-scene";
  return fs::is_regular_file(program, error) ? program.string() : "";
}

std::string sample_folder() {
  const std::string cache = user_folder("XDG_CACHE_HOME", ".cache");
  return cache.empty() ? "" : cache + "/cumulet/samples-" + version_text();
}

}  // namespace cumulet::demo
