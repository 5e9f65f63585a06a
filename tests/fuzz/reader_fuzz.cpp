// Any bytes at all, given to every file reader: each either reads them or throws an Error. What a reader
// accepts must survive being written and read again.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"

namespace {

using upright::YamlMap;

void read_plant_twice(const YamlMap& document) {
  const std::string once = upright::plant_text(upright::read_plant(document));
  const YamlMap again = YamlMap::from_text(once, "again.yaml");
  if (upright::plant_text(upright::read_plant(again)) != once) std::abort();
}

void read_gains_twice(const YamlMap& document) {
  const std::string once = upright::gain_text(upright::read_gains(document));
  const YamlMap again = YamlMap::from_text(once, "again.yaml");
  if (upright::gain_text(upright::read_gains(again)) != once) std::abort();
}

void read_rig_twice(const YamlMap& document) {
  const std::string once = upright::rig_text(upright::read_rig(document));
  const YamlMap again = YamlMap::from_text(once, "again.yaml");
  if (upright::rig_text(upright::read_rig(again)) != once) std::abort();
}

/// An Error is the reader's good right; every other exception, crash or sanitizer report is a find.
template <class Reader>
void feed(const std::string& text, const Reader& reader) {
  try {
    const YamlMap document = YamlMap::from_text(text, "fuzz.yaml");
    reader(document);
    document.finish();
  } catch (const upright::Error& error) {
    if (std::string(error.what()).empty()) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  feed(text, read_plant_twice);
  feed(text, read_gains_twice);
  feed(text, read_rig_twice);
  return 0;
}
