#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>

namespace cumulet::fuzz {

/// Ends the program with this message, which libFuzzer reports as a finding.
[[noreturn]] inline void fail(const std::string& why) {
  std::fprintf(stderr, "finding: %s\n", why.c_str());
  std::abort();
}

}  // namespace cumulet::fuzz
