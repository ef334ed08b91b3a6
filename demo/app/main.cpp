// cumulet-demo: an interactive viewer.

#include <algorithm>
#include <iostream>
#include <program.hpp>

#include "app.hpp"

int main(int argc, char** argv) {
  return cumulet::demo::run_program("cumulet-demo", [&] {
    const auto options = cumulet::demo::parse_demo_options({argv + std::min(argc, 1), argv + argc}, std::cout);
    if (options) cumulet::demo::App(*options).run();
  });
}
