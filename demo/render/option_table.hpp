#pragma once

#include <string>

namespace CLI {
class App;
}

namespace cumulet::demo {

/// Returns the content of --help in a machine-readable form. cmake/manual.py generates manual pages and shell
/// completions from it. One line per entry, fields separated by tabs: "about" and a sentence; "footer" and a line of
/// the text below the options; "option", or "argument" without dashes, with its group, its spellings separated by
/// commas, the type of its value, "required" or nothing, and its description. The type is empty for a flag without
/// value; "..." marks an option that takes several values or can be repeated.
[[nodiscard]] std::string option_table(const CLI::App& app);

}  // namespace cumulet::demo
