// cumulet-merge: merges partial renders (sample ranges) into one image.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <file.hpp>
#include <filesystem>
#include <iostream>
#include <optional>
#include <program.hpp>
#include <string>
#include <vector>

#include "merge.hpp"
#include "options.hpp"

namespace {

using cumulet::demo::UsageError;

struct Wanted {
  std::vector<std::string> parts;
  std::string output;
};

/// Parses the arguments; nullopt after --help or --version.
std::optional<Wanted> parse(std::vector<std::string> arguments) {
  Wanted wanted;
  CLI::App app("Merges partial renders of cumulet-render (--first-sample) into one image.", "cumulet-merge");
  app.footer("Exit status: 0 success; 1 failure, with one line on standard error; 2 wrong usage.");
  app.add_option("parts", wanted.parts, "OpenEXR files (.exr) of cumulet-render, in any order")
      ->required()
      ->type_name("FILE");
  app.add_option("-o,--output", wanted.output, "Merged image (.exr)")->required()->take_last()->type_name("FILE");
  if (!cumulet::demo::parse_arguments(app, std::move(arguments), std::cout)) return std::nullopt;
  if (std::filesystem::path(wanted.output).extension() != ".exr")
    throw UsageError("--output: '" + wanted.output + "' does not end in .exr");
  std::error_code ignored;
  for (const std::string& part : wanted.parts) {
    if (std::filesystem::equivalent(part, wanted.output, ignored))
      throw UsageError("--output: '" + wanted.output + "' is also an input");
  }
  return wanted;
}

}  // namespace

int main(int argc, char** argv) {
  return cumulet::demo::run_program("cumulet-merge", [&] {
    const auto wanted = parse({argv + std::min(argc, 1), argv + argc});
    if (!wanted) return;
    cumulet::image::check_writable(wanted->output);
    const cumulet::demo::Merged merged = cumulet::demo::merge(wanted->parts, wanted->output);
    if (merged.without_denoised) std::cerr << "warning: the layer denoised is dropped, because it cannot be merged\n";
    if (merged.without_error)
      std::cerr
          << "warning: the layer error is dropped, because it includes the sky, which these images do not contain\n";
    std::cout << wanted->output << ": " << merged.samples << " samples per pixel, " << merged.first << " to "
              << merged.first + merged.samples - 1 << ", of " << wanted->parts.size()
              << (wanted->parts.size() == 1 ? " part" : " parts") << '\n';
  });
}
