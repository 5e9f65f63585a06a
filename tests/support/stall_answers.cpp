// Detects stalls of the machine for programs in other languages. For each line "BEGIN END" that it reads
// (seconds on the monotonic clock) it prints a stall that overlaps, as "BEGIN END", or "none".
#include <iostream>

#include "stall_detector.hpp"

int main() {
  const upright::test::StallDetector detector;
  std::cout.precision(6);
  std::cout << std::fixed;
  upright::test::Interval asked;
  while (std::cin >> asked.begin_s >> asked.end_s) {
    if (const auto stall = detector.stall_in(asked))
      std::cout << stall->begin_s << ' ' << stall->end_s << std::endl;
    else
      std::cout << "none" << std::endl;
  }
}
