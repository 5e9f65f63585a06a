// faults_document RECORDS PAGE BENCH... [--write]: compares the columns of docs/reference/faults.md that
// these benches have with what the fault suite has seen of them, or writes them. The other columns stay as
// they are, and so do the cells of tests that the machine kept from judging.
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

#include "fault_table.hpp"

namespace {

int refuse() {
  std::cerr << "usage: faults_document RECORDS PAGE BENCH... [--write]\n";
  return 2;
}

std::string text_of(const std::string& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  const bool writes = !words.empty() && words.back() == "--write";
  if (writes) words.pop_back();
  if (words.size() < 3) return refuse();
  std::vector<upright::test::Bench> benches;
  for (std::size_t i = 2; i < words.size(); ++i) {
    const auto bench = upright::test::bench_named(words[i]);
    if (!bench) return refuse();
    benches.push_back(*bench);
  }
  const std::string committed = text_of(words[1]);
  const std::string page = upright::test::page_of(words[0], committed, benches);
  if (writes) {
    std::ofstream out(words[1]);
    out << page;
    return out.flush() ? 0 : 2;
  }
  if (committed == page) return 0;
  std::cerr << "the page differs from the results of the suite: run `" << argv[0];
  for (const std::string& word : words) std::cerr << " " << word;
  std::cerr << " --write` and check the difference; the page would be:\n" << page;
  return 1;
}
