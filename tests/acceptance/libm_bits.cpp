// Prints what libm's functions give on many arguments, as one number: it changes with the variants that libm
// picks.
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <initializer_list>

int main() {
  std::uint64_t digest = 0;
  for (int i = 1; i <= 200000; ++i) {
    const double x = 1e-4 * i;
    for (const double y : {std::sin(x), std::cos(x), std::exp(-x), std::log(x), std::pow(x, 1.3)})
      digest = digest * 31 + std::bit_cast<std::uint64_t>(y);
  }
  std::printf("%016llx\n", static_cast<unsigned long long>(digest));
}
