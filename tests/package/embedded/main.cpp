// Opens files that need features without which the library may have been built.
// Usage: embedding FILE...; prints "ok" or the error per file.
#include <cumulet/cumulet.hpp>
#include <iostream>
#include <span>
#include <string>

int main(int count, char** arguments) {
  for (const std::string file : std::span(arguments, static_cast<std::size_t>(count)).subspan(1)) {
    const auto print = [](const auto& result) {
      std::cout << (result.has_value() ? "ok" : result.error().message.c_str()) << '\n';
    };
    file.ends_with(".gltf") ? print(cumulet::Surfaces::open(file)) : print(cumulet::Volume::open(file));
  }
}
