#pragma once

#include <string>

namespace CLI {
class App;
}

namespace cumulet::demo {

/// What --help says, for programs: cmake/manual.py makes manual pages and shell completions of it. A line each, its
/// fields between tabs: "about" and a sentence; "footer" and a line of what --help ends with; "option" (or "argument",
/// which has no dashes) with its group, its spellings between commas, the type of its value (empty: it takes none;
/// "...": it takes several, or is given several times), "required" or nothing, and what it does.
[[nodiscard]] std::string option_table(const CLI::App& app);

}  // namespace cumulet::demo
