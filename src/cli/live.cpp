#include "live.hpp"

#include <charconv>
#include <optional>

#include "signals.hpp"
#include "upright/base/error.hpp"

namespace upright::cli {

namespace {

constexpr const char* usual_port = "8090";
/// From pivot to tip where no plant file says it: the IP02's.
constexpr double usual_pendulum_m = 0.61;

std::optional<int> port_number(const std::string& text) {
  constexpr int highest = 65535;
  int port = -1;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (problem != std::errc{} || end != text.data() + text.size() || port < 0 || port > highest)
    return std::nullopt;
  return port;
}

double pendulum_length_m(const Plant* plant) {
  if (plant == nullptr) return usual_pendulum_m;
  return plant->pendulum ? 2.0 * plant->pendulum->length_to_com_m : 0.0;
}

}  // namespace

void add_live(const Command& command, std::string& port) {
  command.flag_or_text(
      "--live", usual_port, port,
      std::string("Serve a web page that shows the run and can stop it, for this machine only. "
                  "--live PORT chooses the port, 0 any free one (default: ") +
          usual_port + ")");
}

std::unique_ptr<LiveView> open_live(const std::string& port, const LiveSubject& subject, std::FILE* out) {
  if (port.empty()) return nullptr;
  const std::optional<int> number = port_number(port);
  if (!number)
    throw ConfigError("'" + port + "' is not a port: use a number from 0 to 65535, as in --live 8090");
  if (subject.fast)
    throw ConfigError(
        "--live needs real time and --fast is virtual time: remove one of them (upright report shows a "
        "finished run)");
  LiveScene scene;
  scene.title = subject.title;
  scene.track_limit_m = subject.rig->track_limit_m;
  scene.voltage_limit_v = subject.rig->amplifier.limit_v;
  scene.fall_angle_rad = subject.rig->fall_angle_rad;
  scene.period_s = subject.period_s;
  scene.pendulum_m = pendulum_length_m(subject.plant);
  auto view =
      std::make_unique<LiveView>(scene, LiveOptions{*number, loop_cpu(subject.realtime), press_stop_button});
  std::fprintf(out, "Live view: %s\n", view->url().c_str());
  std::fflush(out);
  return view;
}

}  // namespace upright::cli
