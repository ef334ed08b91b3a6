#include "samples.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <program.hpp>
#include <scene_file.hpp>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

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
  try {
    process_.emplace(std::vector<std::string>{program_, folder_, "--frame", frame},
                     ChildProcess::Streams{.output = {}, .errors = STDERR_FILENO});
  } catch (const std::system_error& error) {
    wanted_.clear();
    throw std::runtime_error(program_ + ": " + error.code().message());
  }
}

bool SampleFiles::has_ended() {
  if (!process_->status()) return false;
  process_.reset();
  return true;
}

std::optional<std::string> SampleFiles::take() {
  if (wanted_.empty() || (writes() && !has_ended())) return std::nullopt;
  const std::string scene = std::exchange(wanted_, {});
  if (!are_complete()) throw std::runtime_error(folder_ + ": cumulet-scene has not written the sample scenes");
  return (fs::path(folder_) / scene).string();
}

std::string sample_program() { return find_program("cumulet-scene"); }

std::string sample_folder() {
  const std::string cache = user_folder("XDG_CACHE_HOME", ".cache");
  return cache.empty() ? "" : cache + "/cumulet/samples-" + version_text();
}

}  // namespace cumulet::demo
