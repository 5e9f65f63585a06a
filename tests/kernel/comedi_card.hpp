// A device of the kernel's own comedi_test driver, seen from outside: what is put on its analog outputs comes
// back on the analog inputs of the same numbers.
#pragma once

#include <comedilib.h>
#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

namespace upright::test {

class ComediCardUnderTest {
 public:
  static constexpr unsigned int inputs = 0, outputs = 1;
  static constexpr lsampl_t middle = 0x8000, top = 0xffff;

  /// Attaches the driver to one of the minor numbers that comedi.comedi_num_legacy_minors keeps free.
  explicit ComediCardUnderTest(const std::string& file) : file_(file) {
    comedi_devconfig config{};
    std::strcpy(config.board_name, "comedi_test");
    if (!configure(&config)) throw std::runtime_error(file + " cannot be attached: " + std::strerror(errno));
    handle_ = comedi_open(file.c_str());
    if (handle_ == nullptr) throw std::runtime_error(file + " was attached and cannot be opened");
  }
  ~ComediCardUnderTest() {
    comedi_close(handle_);
    configure(nullptr);
  }
  ComediCardUnderTest(const ComediCardUnderTest&) = delete;
  ComediCardUnderTest& operator=(const ComediCardUnderTest&) = delete;

  /// The data that a channel shows for volts, and what they mean. The middle is zero volts.
  static lsampl_t datum_of(double volts) {
    comedi_range range = ten_v();
    return comedi_from_phys(volts, &range, top);
  }
  static double volts_of(lsampl_t datum) {
    // Not by comedi_to_phys, which makes NaN of either end of the range until somebody tells it otherwise.
    const comedi_range range = ten_v();
    const double share = static_cast<double>(datum) / static_cast<double>(top);
    return datum == middle ? 0.0 : range.min + share * (range.max - range.min);
  }

  const std::string& file() const { return file_; }
  /// The card goes, as one on a bus that can be unplugged does.
  void detach() const {
    if (!configure(nullptr)) throw std::runtime_error(file_ + " cannot be detached: " + std::strerror(errno));
  }
  /// What is on an output.
  lsampl_t seen(unsigned int channel) const {
    lsampl_t datum = 0;
    if (comedi_data_read(handle_, inputs, channel, 0, AREF_GROUND, &datum) != 1)
      throw std::runtime_error(file_ + " cannot be read");
    return datum;
  }
  /// False where somebody else has locked the outputs.
  bool put(unsigned int channel, lsampl_t datum) const {
    return comedi_data_write(handle_, outputs, channel, 0, AREF_GROUND, datum) == 1;
  }

 private:
  static comedi_range ten_v() { return {-10, 10, UNIT_volt}; }
  bool configure(comedi_devconfig* config) const {
    const int descriptor = ::open(file_.c_str(), O_RDWR | O_CLOEXEC);
    if (descriptor < 0) return false;
    const bool done = ioctl(descriptor, COMEDI_DEVCONFIG, config) == 0;
    const int problem = errno;
    ::close(descriptor);
    errno = problem;
    return done;
  }

  std::string file_;
  comedi_t* handle_ = nullptr;
};

}  // namespace upright::test
