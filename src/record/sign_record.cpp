#include "sign_record.hpp"

#include <fstream>

#include "base/input_file.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

namespace {

/// What the signs belong to.
std::string wiring_of(const RigFile& rig) {
  RigFile plain = rig;
  plain.simulated.reset();
  plain.track_limit_m = plain.fall_angle_rad = plain.watchdog_s = 1.0;
  plain.coast_s = 0.0;
  plain.amplifier.limit_v = 1.0;
  plain.calibration.zero_at_start = true;
  return rig_text(plain);
}

}  // namespace

std::filesystem::path sign_record_of(const RigFile& rig) {
  return rig.file.string() + ".signs";
}

bool signs_are_checked(const RigFile& rig) {
  if (const auto in = InputFile::if_there(sign_record_of(rig)); !in) return false;
  const std::string text = whole_file(sign_record_of(rig));
  const std::size_t body = text.find('\n');
  return body != std::string::npos && text.substr(body + 1) == wiring_of(rig);
}

void require_checked_signs(const RigFile& rig, const std::string& otherwise) {
  if (is_simulated(rig) || signs_are_checked(rig)) return;
  throw ConfigError(
      "the signs of this rig have not been checked with its present wiring (there is no matching " +
      sign_record_of(rig).string() +
      "); with a wrong sign the loop drives the cart into the end stop: run upright "
      "experiment config/experiments/sign-check.yaml --rig " +
      rig.file.string() + " first" + otherwise);
}

void write_sign_record(const RigFile& rig, const std::string& sentence) {
  const std::filesystem::path file = sign_record_of(rig);
  std::ofstream out(file, std::ios::binary);
  out << "# Signs checked: " << sentence << ". Valid for this wiring:\n" << wiring_of(rig);
  out.close();
  if (!out) throw ConfigError("cannot write " + file.string() + ": make the folder of the rig file writable");
}

}  // namespace upright
