#include "card.hpp"

#include <cerrno>
#include <cmath>

#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

namespace {

/// Volts of two tables, in the kernel in millionths, are the same.
bool same_volts(double a, double b) {
  return std::abs(a - b) < 1e-5;
}

std::string range_text(double low_v, double high_v) {
  std::string text = "[";
  text += exact_text(low_v) + ", " + exact_text(high_v) + "]";
  return text;
}

std::string remedy_for(int problem) {
  if (problem == EACCES || problem == EPERM) return "give this user read and write access (group iocard)";
  if (problem == ENOENT || problem == ENXIO || problem == ENODEV)
    return "load the card's driver; attach an ISA card with comedi_config";
  return "check the card and comedi.device";
}

}  // namespace

std::string comedi_problem() {
  return comedi_strerror(comedi_errno());
}

ComediCard::ComediCard(const std::string& device, const std::string& rig_file)
    : device_(device), rig_file_(rig_file), handle_(comedi_open(device.c_str())) {
  if (handle_ == nullptr) {
    const int problem = comedi_errno();
    throw DeviceError(device + " of " + rig_file + " cannot be opened (" + comedi_strerror(problem) +
                      "): " + remedy_for(problem));
  }
}

ComediCard::~ComediCard() {
  comedi_close(handle_);
}

std::string ComediCard::driver() const {
  const char* name = comedi_get_driver_name(handle_);
  return name == nullptr ? "" : name;
}

void ComediCard::require(const ComediChannel& at) const {
  const int subdevices = comedi_get_n_subdevices(handle_);
  if (at.subdevice >= subdevices)
    refuse(at, "the device has no subdevice " + std::to_string(at.subdevice),
           "use subdevice 0 to " + std::to_string(subdevices - 1));
  const int channels = comedi_get_n_channels(handle_, static_cast<unsigned int>(at.subdevice));
  if (at.channel >= channels)
    refuse(at, "subdevice " + std::to_string(at.subdevice) + " has no channel " + std::to_string(at.channel),
           channels > 0 ? "use channel 0 to " + std::to_string(channels - 1) : "use another subdevice");
}

void ComediCard::require_type(const ComediChannel& at, int type, const char* name) const {
  if (comedi_get_subdevice_type(handle_, static_cast<unsigned int>(at.subdevice)) == type) return;
  const int there = comedi_find_subdevice_by_type(handle_, type, 0);
  refuse(at, "subdevice " + std::to_string(at.subdevice) + " is not " + name,
         there < 0 ? std::string("use a device with ") + name : "use subdevice " + std::to_string(there));
}

void ComediCard::lock(const ComediChannel& at) {
  if (comedi_lock(handle_, static_cast<unsigned int>(at.subdevice)) == 0) return;
  if (comedi_errno() != EBUSY) fail(at, "locking the subdevice");
  throw DeviceError("subdevice " + std::to_string(at.subdevice) + " of " + device_ + ", comedi." + at.key +
                    " of " + rig_file_ + ", already has a controller: end the other program first");
}

unsigned int ComediCard::find_range(const ComediChannel& at, const ComediRange& range) const {
  const auto subdevice = static_cast<unsigned int>(at.subdevice);
  const auto channel = static_cast<unsigned int>(at.channel);
  const int ranges = comedi_get_n_ranges(handle_, subdevice, channel);
  std::string there;
  for (int i = 0; i < ranges; ++i) {
    const comedi_range* offered = comedi_get_range(handle_, subdevice, channel, static_cast<unsigned int>(i));
    if (offered == nullptr || offered->unit != UNIT_volt) continue;
    if (same_volts(offered->min, range.low_v) && same_volts(offered->max, range.high_v))
      return static_cast<unsigned int>(i);
    there += (there.empty() ? "" : " or ") + range_text(offered->min, offered->max);
  }
  refuse(at, "the channel does not support the range " + range_text(range.low_v, range.high_v) + " V",
         there.empty() ? "use a channel with a range in volts" : "set range_v to " + there);
}

lsampl_t ComediCard::maxdata(const ComediChannel& at) const {
  return comedi_get_maxdata(handle_, static_cast<unsigned int>(at.subdevice),
                            static_cast<unsigned int>(at.channel));
}

void ComediCard::refuse(const ComediChannel& at, const std::string& problem,
                        const std::string& remedy) const {
  throw ConfigError(rig_file_ + ":1: comedi." + at.key + ": " + problem + " (" + device_ + ", driver " +
                    driver() + "): " + remedy);
}

void ComediCard::fail(const ComediChannel& at, const std::string& doing) const {
  throw DeviceError(comedi_problem() + " while " + doing + ", subdevice " + std::to_string(at.subdevice) +
                    " channel " + std::to_string(at.channel) + ", comedi." + at.key + " of " + rig_file_ +
                    ": check the card at " + device_);
}

}  // namespace upright
