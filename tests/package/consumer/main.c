#include <cumulet/cumulet.h>
#include <stdio.h>

int main(void) {
  const unsigned v = cumulet_version();
  printf("%u.%u.%u\n", v / 10000, v / 100 % 100, v % 100);
  return v == CUMULET_VERSION_MAJOR * 10000 + CUMULET_VERSION_MINOR * 100 + CUMULET_VERSION_PATCH ? 0 : 1;
}
