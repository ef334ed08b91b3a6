#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace cumulet::demo {

/// Replaces flags of earlier versions by those of this one, up to "--", and reports each of them in one line on
/// standard error. Flags that the app does not have stay as they are.
void replace_old_flags(const CLI::App& app, std::vector<std::string>& arguments);

/// Reports that a flag or a value has another name now, in one line on standard error.
void report_renamed(const CLI::App& app, const std::string& old, const std::string& now);

}  // namespace cumulet::demo
