// Cards that exist only here: functions of libcomedi with the same names stand in front of the library's own.
// What converts volts is the library's.
#pragma once

#include <comedilib.h>

#include <array>
#include <chrono>
#include <map>
#include <string>
#include <vector>

namespace upright::test {

/// An instruction as a driver got it.
struct GivenInstruction {
  unsigned int instruction = 0;
  unsigned int subdevice = 0;
  unsigned int channel = 0;
  std::vector<lsampl_t> data;

  bool operator==(const GivenInstruction&) const = default;
};

struct FakeSubdevice {
  int type = COMEDI_SUBD_UNUSED;
  lsampl_t maxdata = 0;
  std::vector<lsampl_t> data;  ///< of each channel: what a reading gives, what a writing left
  std::vector<comedi_range> ranges;
  const void* owner = nullptr;  ///< who has locked it
};

struct FakeCard {
  std::string driver;
  std::vector<FakeSubdevice> subdevices;
  std::vector<GivenInstruction> set_up;          ///< configurations, and writes to counters
  std::vector<lsampl_t> refused_configurations;  ///< first data that INSN_CONFIG refuses
  int problem = 0;                               ///< errno of every reading and writing
  std::chrono::microseconds takes{0};            ///< each reading
  int lists_read = 0;
};

/// By device file. A device that is not here cannot be opened.
std::map<std::string, FakeCard>& fake_cards();

FakeCard fake_multiq3();
FakeCard fake_s626();
/// An M series card.
FakeCard fake_ni_pcimio();
/// Like comedi_test, without the loopback: 8 analog inputs, 8 analog outputs, 16 bits, 10 V and 5 V.
FakeCard fake_analog();

}  // namespace upright::test
