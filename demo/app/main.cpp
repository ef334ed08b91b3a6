// cumulet-demo: a window in which volumes are looked at.

#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <string>

#include "app.hpp"

namespace {

int fail(std::string message, int status) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  std::fprintf(stderr, "cumulet-demo: %s\n", message.c_str());
  return status;
}

}  // namespace

int main(int argc, char** argv) try {
  const auto options = cumulet::demo::parse_demo_options({argv + std::min(argc, 1), argv + argc}, std::cout);
  if (options) cumulet::demo::App(*options).run();
  std::cout.flush();
  return std::cout.good() ? 0 : fail("standard output: cannot be written", 1);
} catch (const cumulet::demo::UsageError& error) {
  return fail(std::string(error.what()) + " (see --help)", 2);
} catch (const std::bad_alloc&) {
  return fail("out of memory", 1);
} catch (const std::exception& error) {
  return fail(error.what(), 1);
}
