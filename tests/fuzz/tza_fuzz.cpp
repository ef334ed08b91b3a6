// libFuzzer over tensor archives and their networks: for any bytes, a network or a one-line error. See README.md.

#include <cstdint>
#include <span>
#include <string>

#include "base/error.hpp"
#include "denoise/network.hpp"
#include "denoise/tza.hpp"
#include "finding.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto archive = cumulet::denoise::read_tza(std::span(data, size), "fuzzed");
    static_cast<void>(cumulet::denoise::make_network(archive, "fuzzed"));
  } catch (const cumulet::Error& error) {
    const std::string line = error.what();
    if (!line.starts_with("fuzzed: ") || line.find_first_of("\n\r") != std::string::npos) {
      cumulet::fuzz::fail("not one line: " + line);
    }
  }
  return 0;
}
