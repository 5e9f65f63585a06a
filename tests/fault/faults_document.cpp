// faults_document RECORDS PAGE [--write]: compares docs/faults.md with what the fault suite has seen, or
// writes it.
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>

#include "fault_table.hpp"

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: faults_document RECORDS PAGE [--write]\n";
    return 2;
  }
  const std::string page = upright::test::page_of(argv[1]);
  if (argc > 3 && std::string(argv[3]) == "--write") {
    std::ofstream out(argv[2]);
    out << page;
    return out.flush() ? 0 : 2;
  }
  std::ifstream in(argv[2]);
  const std::string committed((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (committed == page) return 0;
  std::cerr << "run `" << argv[0] << " " << argv[1] << " " << argv[2]
            << " --write` and look at the difference: the page does not say what the suite has seen:\n"
            << page;
  return 1;
}
