// fake_hil_card --rig FILE --socket PATH [--trace FILE] [--record FILE] [FLAG VALUE]...: the fake card, until
// SIGTERM. Says "listening on PATH" once it can be opened. SIGUSR1 makes it silent for --silent-s.
#include <signal.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <iostream>
#include <map>
#include <numbers>
#include <string>

#include "fake_card.hpp"
#include "upright/model/plant_file.hpp"

namespace {

volatile int stopped = 0, silence = 0;

using namespace upright;

struct Arguments {
  std::string rig, socket, record;
  VirtualRigOptions options;
  fake_hil::Mishaps mishaps;
};

Arguments read(int argc, char** argv) {
  Arguments a;
  constexpr double degrees_per_rad = 180.0 / std::numbers::pi;
  a.options.theta0_rad = 3.0 / degrees_per_rad;
  fake_hil::Mishaps& m = a.mishaps;
  const auto number = [](double& to) { return [&to](const std::string& text) { to = std::stod(text); }; };
  const auto whole = [](int& to) { return [&to](const std::string& text) { to = std::stoi(text); }; };
  const auto words = [](auto& to) { return [&to](const std::string& text) { to = text; }; };
  const std::map<std::string, std::function<void(const std::string&)>> flags = {
      {"--rig", words(a.rig)},
      {"--socket", words(a.socket)},
      {"--trace", words(a.options.trace)},
      {"--record", words(a.record)},
      {"--theta0-deg",
       [&a](const std::string& text) { a.options.theta0_rad = std::stod(text) / degrees_per_rad; }},
      {"--hang-s", number(a.options.hang_s)},
      {"--late-every", whole(m.late_every)},
      {"--late-s", number(m.late_s)},
      {"--fail-every", whole(m.fail_every)},
      {"--unplug-after", number(m.unplug_after_s)},
      {"--expire-after", number(m.expire_after_s)},
      {"--refuse-after", number(m.refuse_after_s)},
      {"--stick-after", number(m.stick_after_s)},
      {"--stick", [&m](const std::string& text) { m.stick_cart = text == "cart"; }},
      {"--jump-after", number(m.jump_after_s)},
      {"--jump-counts", whole(m.jump_counts)},
      {"--failed-openings", whole(m.failed_openings)},
      {"--locked", [&m](const std::string& text) { m.locked_at_start = text == "true"; }},
      {"--silent-s", number(m.silent_s)},
      {"--drift-ppm", number(m.drift_ppm)},
      {"--drop-every", whole(m.drop_every)},
      {"--never-samples", [&m](const std::string& text) { m.never_samples = text == "true"; }},
      {"--lacks-velocities", [&m](const std::string& text) { m.lacks_velocities = text == "true"; }},
      {"--stop-sampling-after", number(m.stop_sampling_s)},
  };
  for (int i = 1; i + 1 < argc; i += 2) flags.at(argv[i])(argv[i + 1]);
  return a;
}

}  // namespace

int main(int argc, char** argv) {
  signal(SIGTERM, [](int) { stopped = 1; });
  signal(SIGUSR1, [](int) { silence = 1; });
  try {
    const Arguments a = read(argc, argv);
    fake_hil::FakeCard card(read_rig_file(a.rig),
                            read_plant_file(UPRIGHT_SOURCE_DIR "/config/plants/exponential.yaml"), a.options,
                            a.record, a.mishaps);
    fake_hil::serve(card, a.socket, stopped, silence);
  } catch (const std::exception& problem) {
    std::cerr << "fake_hil_card: " << problem.what() << "\n";
    return 2;
  }
  return 0;
}
