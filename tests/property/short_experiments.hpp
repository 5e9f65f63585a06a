// Short experiments, one for each kind of piece. They name plant and gains beside their own folder.
#pragma once

#include <string>
#include <vector>

namespace upright::testing {

inline std::vector<std::string> short_experiments() {
  const std::string head =
      "experiment:\n  name: test\n  why: a test\n  plant: ../plants/exponential.yaml\n  gains: "
      "../gains/exponential.yaml\n  sample_rate_hz: 200\n  travel_m: 0.3\n  voltage_limit_v: 10\n  pieces:\n"
      "    - ";
  std::vector<std::string> texts;
  for (const char* piece :
       {"{kind: ramp, rate_v_per_s: 0.5, largest_v: 1, repeats: 1}",
        "{kind: constant_voltage, voltages_v: [2.0, 3.0], repeats: 1, fit_to_travel: true}",
        "{kind: coast, voltages_v: [2.0], push_s: 0.3}",
        "{kind: square_wave, amplitude_v: 3, period_s: 0.8, duration_s: 1.6, fit_to_travel: true}",
        "{kind: multisine, amplitude_v: 3, lowest_hz: 0.5, highest_hz: 5, lines: 8, duration_s: 2}",
        "{kind: slow_sine, amplitude_m: 0.1, period_s: 2, duration_s: 2}",
        "{kind: free_decay, angle_deg: 30, duration_s: 1, patience_s: 5}", "{kind: observe, duration_s: 0.5}",
        "{kind: closed_loop, set_points_m: [0, 0.05], hold_s: 1, delay_s: 0.001, start: hand, theta0_deg: 1}",
        "{kind: closed_loop, set_points_m: [0], hold_s: 1, theta0_deg: [1, 2], repeats: 2, gains: {a: "
        "../gains/exponential.yaml, b: ../gains/dynamic.yaml}}",
        "{kind: delay_sweep, delay_s: {from: 0, to: 0.01, count: 3}, duration_s: 1, repeats: 2, "
        "bisect_to_s: 0.001, stable_below_rad: 0.006, start: hand, patience_s: 9}",
        "{kind: delay_sweep, delay_s: [0.0, 0.02], duration_s: 1, start: swing_up}",
        "{kind: sign_check, largest_v: 0.5, patience_s: 4}"})
    texts.push_back(head + piece + "\n");
  return texts;
}

}  // namespace upright::testing
