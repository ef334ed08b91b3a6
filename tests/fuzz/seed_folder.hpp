#pragma once

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace cumulet::test {

/// The output folder of a seed program, its only argument. Created if missing.
class SeedFolder {
 public:
  SeedFolder(int argc, char** argv) {
    if (argc != 2) {
      std::fprintf(stderr, "usage: %s FOLDER\n", argc > 0 ? argv[0] : "seeds");
      std::exit(2);
    }
    path_ = argv[1];
    std::filesystem::create_directories(path_);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path_ / name, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }

 private:
  std::filesystem::path path_;
};

}  // namespace cumulet::test
