#include <cumulet/cumulet.h>

#include <iostream>

int main() {
  const auto v = cumulet_version();
  std::cout << v / 10000 << '.' << v / 100 % 100 << '.' << v % 100 << '\n';
}
