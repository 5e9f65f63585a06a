// Any bytes at all, given to every file reader: each either reads them or throws an Error. What a reader
// accepts must survive being written and read again. A table of measured data is checked for mistakes too,
// as diagnose and identify do before anything else.
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "experiment/experiment_file.hpp"
#include "measurement/data_check.hpp"
#include "measurement/dataset_file.hpp"
#include "upright/base/error.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/measurement/measurement.hpp"
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

void read_dataset_lines_twice(const YamlMap& document) {
  const upright::Dataset dataset = upright::read_dataset(document);
  std::string text = "dataset:\n  file: x.csv\n  columns:\n";
  for (const auto& [quantity, column] : dataset.columns)
    text += "    " + upright::column_line(quantity, column) + "\n";
  const upright::Dataset again = upright::read_dataset(YamlMap::from_text(text, "again.yaml"));
  for (const auto& [quantity, column] : dataset.columns)
    if (upright::column_line(quantity, again.columns.find(quantity)->second) !=
        upright::column_line(quantity, column))
      std::abort();
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

/// The readers of tables take files.
class MemoryFile {
 public:
  MemoryFile(const std::uint8_t* data, std::size_t size) : descriptor_(memfd_create("table", 0)) {
    if (descriptor_ < 0 || ::write(descriptor_, data, size) != static_cast<ssize_t>(size)) std::abort();
  }
  ~MemoryFile() { ::close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

void feed_table(const std::uint8_t* data, std::size_t size) {
  upright::Plant plant;
  plant.cart_mass_kg = 0.8;
  plant.pendulum = upright::Pendulum{0.2, 0.3, {}};
  plant.motor = {1.7, 7.7};
  const MemoryFile file(data, size);
  try {
    upright::refuse_mistakes({upright::read_measurement(file.path())}, plant);
  } catch (const upright::Error& error) {
    // The message says which file it is about.
    if (std::string(error.what()).find(file.path()) == std::string::npos) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  feed(text, read_plant_twice);
  feed(text, read_gains_twice);
  feed(text, read_rig_twice);
  feed(text, read_dataset_lines_twice);
  feed(text, [&](const YamlMap&) { upright::read_experiment_text(text, "fuzz.yaml"); });
  feed_table(data, size);
  return 0;
}
