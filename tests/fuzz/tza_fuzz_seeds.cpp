// Writes the seeds of tza_fuzz into a folder.

#include "fuzz/seed_folder.hpp"
#include "support/tza.hpp"

int main(int argc, char** argv) {
  const cumulet::test::SeedFolder folder(argc, argv);
  cumulet::test::NetworkWidths narrow;
  narrow.fill(1);
  narrow.back() = 3;
  for (const std::uint32_t inputs : {3U, 9U}) {
    for (const char type : {'h', 'f'}) {
      const auto bytes = cumulet::test::tza_file(cumulet::test::random_archive(narrow, inputs), type);
      folder.write(std::to_string(inputs) + type + ".tza", {bytes.begin(), bytes.end()});
    }
  }
  return 0;
}
