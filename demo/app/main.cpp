// cumulet-demo: an interactive viewer.

#include <signal.h>  // NOLINT(modernize-deprecated-headers): SIGCHLD is of POSIX

#include <algorithm>
#include <iostream>
#include <program.hpp>

#include "app.hpp"

int main(int argc, char** argv) {
  // The programs that it starts have statuses, even if its own parent ignores those of children, which is inherited.
  ::signal(SIGCHLD, SIG_DFL);
  return cumulet::demo::run_program("cumulet-demo", [&] {
    const auto options = cumulet::demo::parse_demo_options({argv + std::min(argc, 1), argv + argc}, std::cout);
    if (options) cumulet::demo::App(*options).run();
  });
}
