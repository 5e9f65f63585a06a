#include "fake_comedi.hpp"

#include <algorithm>
#include <cerrno>
#include <span>
#include <thread>

struct comedi_t_struct {
  upright::test::FakeCard* card;
};

namespace upright::test {

namespace {

int last_problem = 0;

int failed(int problem) {
  last_problem = problem;
  return -1;
}

FakeSubdevice subdevice(int type, std::size_t channels, lsampl_t maxdata, lsampl_t datum,
                        std::vector<comedi_range> ranges = {}) {
  return {type, maxdata, std::vector<lsampl_t>(channels, datum), std::move(ranges), nullptr};
}

const comedi_range ten_v{-10, 10, UNIT_volt}, five_v{-5, 5, UNIT_volt};

/// As the kernel does it: locks, ranges of data, then the driver. Neither allocates nor locks, so that what
/// the backend does can be counted.
int execute(comedi_t* device, comedi_insn& given) {
  FakeCard& card = *device->card;
  FakeSubdevice& subdevice = card.subdevices.at(given.subdev);
  if (subdevice.owner != nullptr && subdevice.owner != device) return failed(EACCES);
  const unsigned int channel = CR_CHAN(given.chanspec);
  const std::span<const lsampl_t> data(given.data, given.n);
  if (given.insn != INSN_READ && subdevice.type == COMEDI_SUBD_COUNTER)
    card.set_up.push_back({given.insn, given.subdev, channel, {data.begin(), data.end()}});
  if (given.insn == INSN_CONFIG) {
    const auto& refused = card.refused_configurations;
    return std::find(refused.begin(), refused.end(), data[0]) == refused.end() ? static_cast<int>(given.n)
                                                                               : failed(EINVAL);
  }
  if (card.problem != 0) return failed(card.problem);
  if (given.insn == INSN_READ) {
    given.data[0] = subdevice.data.at(channel);
  } else if (subdevice.type != COMEDI_SUBD_COUNTER) {
    if (data[0] > subdevice.maxdata) return failed(EINVAL);
    subdevice.data.at(channel) = data[0];
  }
  return 1;
}

FakeSubdevice& subdevice_of(comedi_t* device, unsigned int number) {
  return device->card->subdevices.at(number);
}

}  // namespace

std::map<std::string, FakeCard>& fake_cards() {
  static std::map<std::string, FakeCard> cards;
  return cards;
}

FakeCard fake_multiq3() {
  FakeCard card;
  card.driver = "multiq3";
  card.subdevices = {subdevice(COMEDI_SUBD_AI, 8, 0x1fff, 0x1000, {five_v}),
                     subdevice(COMEDI_SUBD_AO, 8, 0xfff, 0, {five_v}), subdevice(COMEDI_SUBD_DI, 16, 1, 0),
                     subdevice(COMEDI_SUBD_DO, 16, 1, 0),
                     subdevice(COMEDI_SUBD_COUNTER, 4, 0xffffff, 0x800000)};
  return card;
}

FakeCard fake_s626() {
  FakeCard card;
  card.driver = "s626";
  card.subdevices = {subdevice(COMEDI_SUBD_AI, 16, 0x3fff, 0x2000, {five_v, ten_v}),
                     subdevice(COMEDI_SUBD_AO, 4, 0x3fff, 0, {ten_v}),
                     subdevice(COMEDI_SUBD_DIO, 16, 1, 0),
                     subdevice(COMEDI_SUBD_DIO, 16, 1, 0),
                     subdevice(COMEDI_SUBD_DIO, 16, 1, 0),
                     subdevice(COMEDI_SUBD_COUNTER, 6, 0xffffff, 0)};
  return card;
}

FakeCard fake_ni_pcimio() {
  FakeCard card;
  card.driver = "ni_pcimio";
  card.subdevices.resize(14);  // those between are of no concern here
  card.subdevices[0] = subdevice(COMEDI_SUBD_AI, 16, 0xffff, 0x8000, {ten_v, five_v});
  card.subdevices[1] = subdevice(COMEDI_SUBD_AO, 2, 0xffff, 0, {ten_v, five_v});
  card.subdevices[11] = card.subdevices[12] = subdevice(COMEDI_SUBD_COUNTER, 3, 0xffffffff, 0);
  return card;
}

FakeCard fake_analog() {
  FakeCard card;
  card.driver = "comedi_test";
  card.subdevices = {subdevice(COMEDI_SUBD_AI, 8, 0xffff, 0x8000, {ten_v, five_v}),
                     subdevice(COMEDI_SUBD_AO, 8, 0xffff, 0, {ten_v, five_v})};
  return card;
}

}  // namespace upright::test

using upright::test::execute;
using upright::test::failed;
using upright::test::last_problem;
using upright::test::subdevice_of;

extern "C" {

comedi_t* comedi_open(const char* file) {
  auto& cards = upright::test::fake_cards();
  const auto found = cards.find(file);
  if (found == cards.end()) {
    last_problem = ENOENT;
    return nullptr;
  }
  return new comedi_t_struct{&found->second};
}

int comedi_close(comedi_t* device) {
  for (auto& subdevice : device->card->subdevices)
    if (subdevice.owner == device) subdevice.owner = nullptr;
  delete device;
  return 0;
}

int comedi_errno() {
  return last_problem;
}

const char* comedi_get_driver_name(comedi_t* device) {
  return device->card->driver.c_str();
}

int comedi_get_n_subdevices(comedi_t* device) {
  return static_cast<int>(device->card->subdevices.size());
}

int comedi_get_n_channels(comedi_t* device, unsigned int subdevice) {
  return static_cast<int>(subdevice_of(device, subdevice).data.size());
}

int comedi_get_subdevice_type(comedi_t* device, unsigned int subdevice) {
  return subdevice_of(device, subdevice).type;
}

int comedi_find_subdevice_by_type(comedi_t* device, int type, unsigned int from) {
  for (unsigned int i = from; i < device->card->subdevices.size(); ++i)
    if (subdevice_of(device, i).type == type) return static_cast<int>(i);
  return -1;
}

lsampl_t comedi_get_maxdata(comedi_t* device, unsigned int subdevice, unsigned int) {
  return subdevice_of(device, subdevice).maxdata;
}

int comedi_get_n_ranges(comedi_t* device, unsigned int subdevice, unsigned int) {
  return static_cast<int>(subdevice_of(device, subdevice).ranges.size());
}

comedi_range* comedi_get_range(comedi_t* device, unsigned int subdevice, unsigned int, unsigned int range) {
  return &subdevice_of(device, subdevice).ranges.at(range);
}

int comedi_lock(comedi_t* device, unsigned int subdevice) {
  auto& wanted = subdevice_of(device, subdevice);
  if (wanted.owner != nullptr) return failed(EBUSY);
  wanted.owner = device;
  return 0;
}

int comedi_do_insn(comedi_t* device, comedi_insn* given) {
  return execute(device, *given);
}

int comedi_do_insnlist(comedi_t* device, comedi_insnlist* list) {
  ++device->card->lists_read;
  std::this_thread::sleep_for(device->card->takes);
  for (unsigned int i = 0; i < list->n_insns; ++i)
    if (execute(device, list->insns[i]) < 0) return -1;
  return static_cast<int>(list->n_insns);
}

int comedi_data_write(comedi_t* device, unsigned int subdevice, unsigned int channel, unsigned int range,
                      unsigned int reference, lsampl_t datum) {
  comedi_insn given{};
  given.insn = INSN_WRITE;
  given.n = 1;
  given.data = &datum;
  given.subdev = subdevice;
  given.chanspec = CR_PACK(channel, range, reference);
  return execute(device, given);
}
}
