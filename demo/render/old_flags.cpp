#include "old_flags.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <set>
#include <string_view>

namespace cumulet::demo {
namespace {

struct OldFlag {
  std::string_view old;
  std::string_view now;
};
constexpr std::array old_flags = {
    OldFlag{"--march", "--grid-type"},
    OldFlag{"--build", "--build-device"},
    OldFlag{"--lamp", "--light"},
    OldFlag{"--surface-light", "--surface-lighting"},
    OldFlag{"--second-share", "--second-weight"},
    OldFlag{"--between", "--frame-interpolation"},
    OldFlag{"--settled", "--sequence-cache"},
};

}  // namespace

void report_renamed(const CLI::App& app, const std::string& old, const std::string& now) {
  std::fprintf(stderr, "%s: %s is now %s\n", app.get_name().c_str(), old.c_str(), now.c_str());
}

void replace_old_flags(const CLI::App& app, std::vector<std::string>& arguments) {
  std::set<std::string_view> reported;
  for (std::string& argument : arguments) {
    if (argument == "--") return;
    for (const OldFlag& flag : old_flags) {
      const bool has_value = argument.starts_with(flag.old) && argument.substr(flag.old.size()).starts_with('=');
      if (argument != flag.old && !has_value) continue;
      if (app.get_option_no_throw(std::string(flag.now)) == nullptr) continue;
      argument.replace(0, flag.old.size(), flag.now);
      if (reported.insert(flag.old).second) report_renamed(app, std::string(flag.old), std::string(flag.now));
      break;
    }
  }
}

}  // namespace cumulet::demo
