// A GPIO chip by name, label or path, and the sentences for what goes wrong with it.
#pragma once

#include <gpiod.h>

#include <memory>
#include <string>

#include "upright/hal/wiring.hpp"

namespace upright {

class GpioChip {
 public:
  /// Throws DeviceError. `file` is the rig file that names the chip.
  GpioChip(const std::string& chip, const std::string& file);

  /// The line with this number. Throws DeviceError where the chip has none. `use` is the key in the rig file.
  gpiod_line* line(int number, const std::string& use) const;
  /// "/dev/gpiochip0"
  std::string path() const;
  /// Throws the DeviceError for a line that could not be had, from errno.
  [[noreturn]] void refuse(int number, const std::string& use) const;

 private:
  struct Close {
    void operator()(gpiod_chip* chip) const noexcept { gpiod_chip_close(chip); }
  };
  std::string file_;
  std::unique_ptr<gpiod_chip, Close> chip_;
};

inline constexpr const char* gpio_consumer = "upright";

/// libgpiod's flag for a bias.
int bias_flag(LineBias bias) noexcept;

}  // namespace upright
