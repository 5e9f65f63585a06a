#include "chip.hpp"

#include <cerrno>
#include <cstring>

#include "upright/base/error.hpp"

namespace upright {

GpioChip::GpioChip(const std::string& chip, const std::string& file)
    : file_(file), chip_(gpiod_chip_open_lookup(chip.c_str())) {
  if (!chip_)
    throw DeviceError(chip + " cannot be opened (" + std::strerror(errno) + "): check gpio.chip in " + file +
                      " against the output of gpiodetect, and the permissions of the device");
}

std::string GpioChip::path() const {
  return std::string("/dev/") + gpiod_chip_name(chip_.get());
}

gpiod_line* GpioChip::line(int number, const std::string& use) const {
  const unsigned lines = gpiod_chip_num_lines(chip_.get());
  if (static_cast<unsigned>(number) >= lines)
    throw DeviceError(path() + " has no line " + std::to_string(number) + ": set gpio." + use + " in " +
                      file_ + " to a line below " + std::to_string(lines));
  gpiod_line* line = gpiod_chip_get_line(chip_.get(), static_cast<unsigned>(number));
  if (line == nullptr) refuse(number, use);
  return line;
}

void GpioChip::refuse(int number, const std::string& use) const {
  const int problem = errno;
  const std::string line =
      "line " + std::to_string(number) + " of " + path() + " (gpio." + use + " in " + file_ + ")";
  if (problem == EBUSY) throw DeviceError(line + " is in use: end the other program first");
  throw DeviceError(line + " cannot be reserved (" + std::strerror(problem) +
                    "): check that the chip supports gpio." + use + " with its settings, including bias");
}

int bias_flag(LineBias bias) noexcept {
  switch (bias) {
    case LineBias::pull_up:
      return GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP;
    case LineBias::pull_down:
      return GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN;
    case LineBias::as_is:
      break;
  }
  return 0;
}

}  // namespace upright
