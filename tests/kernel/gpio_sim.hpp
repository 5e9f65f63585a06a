// A simulated GPIO chip of the kernel (gpio-sim): what is wired to its lines, from the outside.
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace upright::test {

class GpioSim {
 public:
  GpioSim(const std::string& name, int lines) : device_(root() / name), bank_(device_ / "bank") {
    std::filesystem::create_directory(device_);
    std::filesystem::create_directory(bank_);
    put(bank_ / "num_lines", std::to_string(lines));
    put(bank_ / "label", name);
    put(device_ / "live", "1");
    chip_ = get(bank_ / "chip_name");
    const std::filesystem::path lines_folder =
        std::filesystem::path("/sys/devices/platform") / get(device_ / "dev_name") / chip_;
    for (int line = 0; line < lines; ++line) {
      const std::filesystem::path folder = lines_folder / ("sim_gpio" + std::to_string(line));
      pulls_.push_back(opened(folder / "pull", O_WRONLY));
      values_.push_back(opened(folder / "value", O_RDONLY));
    }
  }
  ~GpioSim() {
    for (const int descriptor : pulls_) ::close(descriptor);
    for (const int descriptor : values_) ::close(descriptor);
    std::ofstream(device_ / "live") << "0";
    std::error_code ignored;
    std::filesystem::remove(bank_, ignored);
    std::filesystem::remove(device_, ignored);
  }
  GpioSim(const GpioSim&) = delete;
  GpioSim& operator=(const GpioSim&) = delete;

  /// "gpiochip0", ...
  const std::string& chip() const { return chip_; }
  /// The chip goes, as a USB one does.
  void unplug() { put(device_ / "live", "0"); }
  /// Drives an input line from the outside.
  void pull(int line, bool high) {
    const std::string level = high ? "pull-up" : "pull-down";
    const auto size = static_cast<ssize_t>(level.size());
    if (::pwrite(pulls_.at(static_cast<std::size_t>(line)), level.data(), level.size(), 0) != size)
      throw std::runtime_error("cannot pull line " + std::to_string(line));
  }
  /// The level on a line, whoever drives it.
  bool level(int line) const {
    char digit = '?';
    if (::pread(values_.at(static_cast<std::size_t>(line)), &digit, 1, 0) != 1)
      throw std::runtime_error("cannot read line " + std::to_string(line));
    return digit == '1';
  }

 private:
  static std::filesystem::path root() { return "/sys/kernel/config/gpio-sim"; }
  static void put(const std::filesystem::path& file, const std::string& text) {
    std::ofstream out(file);
    out << text;
    if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
  }
  static std::string get(const std::filesystem::path& file) {
    std::string text;
    if (!(std::ifstream(file) >> text)) throw std::runtime_error("cannot read " + file.string());
    return text;
  }
  static int opened(const std::filesystem::path& file, int mode) {
    const int descriptor = ::open(file.c_str(), mode | O_CLOEXEC);
    if (descriptor < 0) throw std::runtime_error("cannot open " + file.string());
    return descriptor;
  }

  std::filesystem::path device_, bank_;
  std::string chip_;
  std::vector<int> pulls_, values_;
};

}  // namespace upright::test
