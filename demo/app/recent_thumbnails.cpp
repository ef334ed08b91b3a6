#include "recent_thumbnails.hpp"

#include <signal.h>  // NOLINT(modernize-deprecated-headers): signals of POSIX
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <frame_row.hpp>
#include <functional>
#include <program.hpp>
#include <scene_file.hpp>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "model.hpp"

namespace cumulet::demo {
namespace {

namespace fs = std::filesystem;

constexpr int low_priority = 10;       // the user's work comes first
constexpr const char* part = ".part";  // ending of an unfinished thumbnail, behind the number of its process
constexpr std::size_t max_kept = 64;   // thumbnails that are kept for files that are not listed

/// Returns a text that changes with the file's content; "" if it does not exist.
std::string state_of(const std::string& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return "";
  return file + '\n' + std::to_string(status.st_mtim.tv_sec) + '.' + std::to_string(status.st_mtim.tv_nsec) + '\n' +
         std::to_string(status.st_size);
}

void add_volume(std::vector<std::string>& files, const std::string& volume) {
  const auto row = FrameRow::of_name(volume);
  if (!row) return files.push_back(volume);
  const std::vector<std::string> frames = row->files();
  files.insert(files.end(), frames.begin(), frames.end());
}

/// Returns the files that a scene file refers to; those before an error if it cannot be read.
std::vector<std::string> files_of_scene(const std::string& path) {
  std::vector<std::string> files;
  try {
    const SceneOptions scene = load_scene(path);
    files = {scene.surfaces, scene.environment, scene.ocio.config};
    for (const SceneModel& model : scene.models) files.push_back(model.file);
    add_volume(files, scene.volume);
    for (const SceneVolume& other : scene.others) add_volume(files, other.volume);
  } catch (const std::exception&) {  // the program reports that
  }
  std::erase(files, "");
  return files;
}

bool is_thumbnail(const fs::path& path) {
  constexpr std::string_view digits = "0123456789abcdef";
  const std::string stem = path.stem().string();
  return path.extension() == ".png" && stem.size() == 16 && stem.find_first_not_of(digits) == std::string::npos;
}

}  // namespace

RecentThumbnails::RecentThumbnails(std::string program, std::string folder)
    : program_(std::move(program)), folder_(std::move(folder)) {}

RecentThumbnails::~RecentThumbnails() { stop(); }

void RecentThumbnails::stop() {
  if (!making_) return;
  making_->process->end(SIGKILL);  // SIGTERM would first write the picture
  std::error_code error;
  fs::remove(making_->unfinished, error);
  making_.reset();
}

std::string RecentThumbnails::path_for(const std::string& file) const {
  std::string version = state_of(file);
  if (is_environment(file) || version.empty()) return "";
  if (has_ending(file, ".json")) {
    Scene& scene = scenes_[file];
    if (scene.state != version) scene = {version, files_of_scene(file)};
    for (const std::string& used : scene.files) version += '\n' + state_of(used);
  }
  std::array<char, 24> name{};
  std::snprintf(name.data(), name.size(), "%016llx.png", static_cast<unsigned long long>(fnv1a(version)));
  return (fs::path(folder_) / name.data()).string();
}

std::string RecentThumbnails::find(const std::string& file) const {
  if (folder_.empty()) return "";
  const std::string picture = path_for(file);
  std::error_code error;
  return !picture.empty() && fs::is_regular_file(picture, error) ? picture : "";
}

bool RecentThumbnails::follow(std::span<const std::string> files, double now) {
  constexpr double pause = 1.0;  // seconds between two looks at unchanged files
  if (program_.empty() || folder_.empty()) return false;
  const bool worked = works();
  if (worked && !finish()) return false;
  if (!worked && now < next_look_ && std::ranges::equal(files, followed_)) return false;
  followed_.assign(files.begin(), files.end());
  next_look_ = now + pause;
  if (!std::exchange(removed_left_, true)) {
    remove_left();
    remove_old();
  }
  for (const std::string& file : files) {
    const std::string picture = path_for(file);
    std::error_code error;
    if (picture.empty() || fs::exists(picture, error)) continue;
    const auto failed = failed_.find(file);
    if (failed != failed_.end() && failed->second == picture) continue;
    begin(file, picture);
    break;
  }
  return true;
}

bool RecentThumbnails::finish() {
  const auto status = making_->process->status();
  if (!status) return false;
  std::error_code error;
  const bool made = WIFEXITED(*status) && WEXITSTATUS(*status) == 0;
  if (made) fs::rename(making_->unfinished, making_->picture, error);
  if (!made || error) {
    failed_[making_->file] = making_->picture;
    fs::remove(making_->unfinished, error);
  }
  making_.reset();
  remove_old();
  return true;
}

void RecentThumbnails::remove_old() const {
  std::set<std::string> listed;
  for (const std::string& file : followed_) listed.insert(path_for(file));
  std::vector<std::pair<fs::file_time_type, fs::path>> others;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error))
    if (is_thumbnail(entry.path()) && !listed.contains(entry.path().string()))
      others.emplace_back(entry.last_write_time(error), entry.path());
  std::ranges::sort(others, std::greater());
  for (std::size_t i = max_kept; i < others.size(); ++i) fs::remove(others[i].second, error);
}

void RecentThumbnails::remove_left() const {
  std::error_code error;
  std::vector<fs::path> left;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    if (entry.path().extension() != part) continue;
    const std::string owner = entry.path().stem().extension().string();  // ".123"
    const long process = owner.empty() ? 0 : std::strtol(owner.c_str() + 1, nullptr, 10);
    if (process > 0 && ::kill(static_cast<pid_t>(process), 0) != 0 && errno == ESRCH) left.push_back(entry.path());
  }
  for (const fs::path& path : left) fs::remove(path, error);
}

void RecentThumbnails::begin(const std::string& file, const std::string& picture) {
  std::error_code error;
  fs::create_directories(folder_, error);
  const std::string unfinished = picture + '.' + std::to_string(::getpid()) + part;
  std::vector<std::string> arguments = {program_, "--thumbnail", std::to_string(side), "-o", unfinished};
  if (has_ending(file, ".json")) arguments.emplace_back("--scene");
  arguments.push_back(file);
  try {
    auto process = std::make_unique<ChildProcess>(std::move(arguments), ChildProcess::Streams{});
    process->yield(low_priority);
    making_ = Making{std::move(process), file, picture, unfinished};
  } catch (const std::system_error&) {
    failed_[file] = picture;
  }
}

std::string thumbnail_program() { return find_program("cumulet-render"); }

std::string thumbnail_folder() {
  const std::string cache = user_folder("XDG_CACHE_HOME", ".cache");
  return cache.empty() ? "" : cache + "/cumulet/thumbnails";
}

}  // namespace cumulet::demo
