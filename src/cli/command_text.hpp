// What a command line has, as texts: for manual pages and completion.
#pragma once

#include <string>
#include <vector>

namespace upright::cli {

struct OptionText {
  std::vector<std::string> names;  ///< "--rig"; a word in its place has its bare name
  std::string value;               ///< kind and bounds of its value as in the help; empty: a flag
  std::string meaning;
  std::vector<std::string> words;  ///< the values it can have, where they are few
  bool in_place = false;           ///< a word in its place
  bool required = false;
  bool many = false;  ///< takes more than one word
};

struct CommandText {
  std::string name, summary, footer;
  std::vector<OptionText> options;  ///< in the order of the help
};

}  // namespace upright::cli
