#include "option_table.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace cumulet::demo {
namespace {

/// Checks that the text contains no separator of fields or lines.
std::string field(const std::string& text) {
  if (text.find_first_of("\t\n") != std::string::npos) throw std::logic_error("a tab or a new line in '" + text + "'");
  return text;
}

}  // namespace

std::string option_table(const CLI::App& app) {
  std::ostringstream table;
  table << "about\t" << field(app.get_description()) << '\n';
  std::istringstream footer(app.get_footer());
  for (std::string line; std::getline(footer, line);) table << "footer\t" << field(line) << '\n';

  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;  // options that --help also hides
    std::string spellings;
    const auto add = [&](const std::string& spelling) { spellings += (spellings.empty() ? "" : ",") + spelling; };
    for (const std::string& name : option->get_snames()) add("-" + name);
    for (const std::string& name : option->get_lnames()) add("--" + name);
    if (option->get_positional()) add(option->get_name(true));
    const int values = option->get_items_expected_max();
    const bool repeats = values > 1 || option->get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
    const std::string type = values > 0 ? option->get_type_name() + (repeats ? "..." : "") : "";
    table << (option->get_positional() ? "argument" : "option") << '\t' << field(option->get_group()) << '\t'
          << field(spellings) << '\t' << field(type) << '\t' << (option->get_required() ? "required" : "") << '\t'
          << field(option->get_description()) << '\n';
  }
  return table.str();
}

}  // namespace cumulet::demo
