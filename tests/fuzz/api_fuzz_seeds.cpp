// Writes the seeds of api_fuzz into a folder: programs of random bytes for libFuzzer to start from.

#include <random>

#include "fuzz/seed_folder.hpp"

int main(int argc, char** argv) {
  const cumulet::test::SeedFolder folder(argc, argv);
  std::mt19937 random(1);
  for (int i = 0; i < 24; ++i) {
    std::string bytes(1500, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    folder.write("program" + std::to_string(i), bytes);
  }
  return 0;
}
