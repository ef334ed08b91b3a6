#include "program.hpp"

#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <locale>
#include <new>

namespace cumulet::demo {

std::string one_line(std::string text) {
  const auto breaks = [](char c) { return c == '\n' || c == '\r'; };
  while (!text.empty() && breaks(text.back())) text.pop_back();
  for (char& c : text)
    if (breaks(c)) c = ' ';
  return text;
}

std::uint64_t fnv1a(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return hash;
}

std::string environment_variable(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nothing sets the environment
  return value == nullptr ? "" : value;
}

std::string user_folder(const char* variable, const std::string& in_home) {
  if (std::string named = environment_variable(variable); !named.empty()) return named;
  const std::string home = environment_variable("HOME");
  return home.empty() ? "" : home + "/" + in_home;
}

namespace {

/// Sets the classic locale, so that command lines and files have the same number format everywhere. The programs do not
/// set a locale, but a loaded library may have done so.
void use_classic_locale() {
  static_cast<void>(std::setlocale(LC_NUMERIC, "C"));
  const std::locale& classic = std::locale::classic();
  std::locale::global(classic);
  static_cast<void>(std::cin.imbue(classic));
  for (std::ostream* stream : {&std::cout, &std::cerr, &std::clog}) static_cast<void>(stream->imbue(classic));
}

}  // namespace

int run_program(const char* name, const std::function<void()>& body) {
  use_classic_locale();
  const auto fail = [name](const std::string& message, int status) {
    std::fprintf(stderr, "%s: %s\n", name, one_line(message).c_str());
    return status;
  };
  try {
    body();
    std::cout.flush();
    return std::cout.good() ? 0 : fail("standard output: cannot be written", 1);
  } catch (const UsageError& error) {
    return fail(std::string(error.what()) + " (see --help)", 2);
  } catch (const std::bad_alloc&) {
    return fail("out of memory", 1);
  } catch (const std::exception& error) {
    return fail(error.what(), 1);
  }
}

}  // namespace cumulet::demo
