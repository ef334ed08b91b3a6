// Preloaded library that sets locales with grouped digits and a decimal comma before a program's main begins.

#include <clocale>
#include <cstdlib>
#include <iostream>
#include <locale>
#include <string>

namespace {

class Grouping final : public std::numpunct<char> {
 protected:
  [[nodiscard]] char do_decimal_point() const override { return ','; }
  [[nodiscard]] char do_thousands_sep() const override { return '.'; }
  [[nodiscard]] std::string do_grouping() const override { return "\3"; }
};

[[gnu::constructor]] void set_locales() {
  const std::locale hostile(std::locale::classic(), new Grouping);
  std::locale::global(hostile);
  for (std::ostream* stream : {&std::cout, &std::cerr, &std::clog}) stream->imbue(hostile);
  // The C locale, if the system has one; LOCPATH is searched.
  for (const char* name : {"cumulet_DE", "de_DE.UTF-8", "fr_FR.UTF-8"}) {
    if (std::setlocale(LC_ALL, name) != nullptr) break;
  }
}

}  // namespace
