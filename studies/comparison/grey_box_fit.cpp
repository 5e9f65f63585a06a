// Fits chosen numbers of a plant file by output error, as grey-box fitting of a fixed structure does: the
// sum of squares of simulated minus measured, in units of each sensor's noise, is minimised by Ceres
// (Levenberg-Marquardt) over these numbers and the initial state of each piece. Nothing is selected and
// nothing added. The plant is the project's own, so that models differ in what is fitted, not in how they
// are simulated.
//
//   grey_box_fit PLANT --data D... --free NUMBER... --out PLANT [--horizon S] [--fixed-starts]
//
// A NUMBER is cart_mass_kg, pendulum.inertia_about_pivot_kgm2, or KIND.PARAMETER of an effect of the plant
// file. Its start is the value in the file, which must not be 0. Without a horizon whole records are fitted.
// With --fixed-starts the initial states are those of local parabolas through the first samples.
#include <ceres/ceres.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "estimation/fit.hpp"
#include "estimation/segment_start.hpp"
#include "upright/base/error.hpp"
#include "upright/model/plant_file.hpp"

namespace {

using namespace upright;

/// A number of a plant that is fitted. Its unit in the fit is its start value.
class FreeNumber {
 public:
  FreeNumber(const std::string& name, const Plant& plant) : name_(name) {
    const std::size_t dot = name.find('.');
    if (name != "cart_mass_kg" && name != "pendulum.inertia_about_pivot_kgm2") find_in_effects(dot, plant);
    Plant copy = plant;
    double* start = place(copy);
    if (start == nullptr || *start == 0.0)
      throw ConfigError("the plant file gives no start for " + name + ": give it a value other than 0");
    scale_ = std::abs(*start);
    start_ = *start / scale_;
  }

  double start() const { return start_; }
  /// In the unit of the fit. A scale, a time or a mass stays above 0.
  double lower_bound() const {
    constexpr double above_zero = 1e-3;
    if (effect_ == effect_count) return above_zero;
    const Range& range = effect_registry()[effect_].parameters[parameter_].range;
    return range.low_open ? range.low / scale_ + above_zero : range.low / scale_;
  }
  /// Numerical derivatives at the bound look beyond it.
  void set(Plant& plant, double value) const { *place(plant) = std::max(value, lower_bound()) * scale_; }

 private:
  void find_in_effects(std::size_t dot, const Plant& plant) {
    const std::string kind = name_.substr(0, dot);
    effect_ = effect_number(kind);
    if (dot == std::string::npos || effect_ == effect_count || plant.find(effect_) == nullptr)
      throw ConfigError("the plant file has no number " + name_ + ": name one that it has");
    const auto parameters = effect_registry()[effect_].parameters;
    while (parameter_ < parameters.size() && parameters[parameter_].name != name_.substr(dot + 1))
      ++parameter_;
    if (parameter_ == parameters.size())
      throw ConfigError(kind + " has no parameter " + name_.substr(dot + 1) +
                        ": see `upright effects` for its parameters");
  }

  double* place(Plant& plant) const {
    if (name_ == "cart_mass_kg") return &plant.cart_mass_kg;
    if (effect_ == effect_count) {
      if (!plant.pendulum) return nullptr;
      if (!plant.pendulum->given_inertia_kgm2)
        plant.pendulum->given_inertia_kgm2 = plant.pendulum->inertia_about_pivot_kgm2();
      return &*plant.pendulum->given_inertia_kgm2;
    }
    for (PlantEffect& effect : plant.effects)
      if (effect.number == effect_) return &effect.values[parameter_];
    return nullptr;
  }

  std::string name_;
  std::size_t effect_ = effect_count, parameter_ = 0;
  double start_ = 1.0, scale_ = 1.0;
};

constexpr int state_size = 4;

/// Simulated minus measured of one piece, as a function of the free numbers and the initial state.
class PieceResidual {
 public:
  PieceResidual(const Plant& plant, const std::vector<FreeNumber>& numbers, const Measurement& run,
                const Segment& piece)
      : plant_(plant), numbers_(numbers), run_(run), piece_(piece) {
    if (run.has_cart()) cart_noise_m_ = run.cart_noise_m();
    if (run.has_theta()) theta_noise_rad_ = run.theta_noise_rad();
  }

  bool operator()(double const* const* blocks, double* residual) const {
    Plant plant = plant_;
    for (std::size_t i = 0; i < numbers_.size(); ++i) numbers_[i].set(plant, blocks[0][i]);
    const double* state = blocks[1];
    constexpr std::size_t margin = 64;
    Simulator<double> simulator(make_model<double>(plant, run_.cart_locked), {},
                                margin + piece_.last - piece_.first);
    start_segment(simulator, run_, piece_, PlantState<double>{state[0], state[1], state[2], state[3]});
    for (std::size_t k = piece_.first; k <= piece_.last; ++k) {
      simulator.advance_to(run_.time_s[k]);
      const Outputs<double> shown = simulator.engine().outputs();
      if (run_.has_cart()) *residual++ = (shown.cart_m - run_.cart_m[k]) / cart_noise_m_;
      if (run_.has_theta()) *residual++ = (shown.theta_rad - run_.theta_rad[k]) / theta_noise_rad_;
      if (!std::isfinite(shown.cart_m) || !std::isfinite(shown.theta_rad)) return false;
      simulator.command(run_.time_s[k], run_.voltage_v[k]);
    }
    return true;
  }

  int size() const {
    const int channels = (run_.has_cart() ? 1 : 0) + (run_.has_theta() ? 1 : 0);
    return channels * static_cast<int>(piece_.last - piece_.first + 1);
  }

 private:
  const Plant& plant_;
  const std::vector<FreeNumber>& numbers_;
  const Measurement& run_;
  Segment piece_;
  double cart_noise_m_ = 1.0, theta_noise_rad_ = 1.0;
};

/// Steps of the numerical derivatives, relative: between the error of the engine and the curvature.
ceres::NumericDiffOptions derivative_steps() {
  ceres::NumericDiffOptions steps;
  steps.relative_step_size = 1e-5;
  return steps;
}

struct Fitted {
  Plant plant;
  ceres::Solver::Summary summary;
};

/// States of what a piece does not measure stay at 0.
std::vector<int> unmeasured(const Measurement& run) {
  std::vector<int> fixed;
  if (!run.has_cart() || run.cart_locked) fixed.insert(fixed.end(), {0, 2});
  if (!run.has_theta()) fixed.insert(fixed.end(), {1, 3});
  return fixed;
}

Fitted fit_by_output_error(const Plant& plant, const std::vector<FreeNumber>& numbers,
                           const std::vector<Measurement>& runs, double longest_s, bool fixed_starts) {
  const std::vector<Segment> pieces = cut_segments(runs, longest_s);
  std::vector<double> values;
  values.reserve(numbers.size());
  for (const FreeNumber& number : numbers) values.push_back(number.start());
  std::vector<std::array<double, state_size>> states;
  for (const PlantState<double>& start : estimate_initial_states(runs, pieces, plant))
    states.push_back({start.cart_m, start.theta_rad, start.cart_mps, start.theta_radps});
  ceres::Problem problem;
  using Cost = ceres::DynamicNumericDiffCostFunction<PieceResidual, ceres::CENTRAL>;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Measurement& run = runs[pieces[i].run];
    auto* residual = new PieceResidual(plant, numbers, run, pieces[i]);
    auto* cost = new Cost(residual, ceres::TAKE_OWNERSHIP, derivative_steps());
    cost->AddParameterBlock(static_cast<int>(values.size()));
    cost->AddParameterBlock(state_size);
    cost->SetNumResiduals(residual->size());
    problem.AddResidualBlock(cost, nullptr, values.data(), states[i].data());
    if (fixed_starts) {
      problem.SetParameterBlockConstant(states[i].data());
    } else if (const std::vector<int> fixed = unmeasured(run); !fixed.empty()) {
      problem.SetManifold(states[i].data(), new ceres::SubsetManifold(state_size, fixed));
    }
  }
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (std::isfinite(numbers[i].lower_bound()))
      problem.SetParameterLowerBound(values.data(), static_cast<int>(i), numbers[i].lower_bound());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-8;
  options.num_threads = 2;
  Fitted fitted{plant, {}};
  ceres::Solve(options, &problem, &fitted.summary);
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i].set(fitted.plant, values[i]);
  return fitted;
}

struct Flags {
  std::string plant, out;
  std::vector<std::string> data, free;
  double horizon_s = std::numeric_limits<double>::infinity();
  bool fixed_starts = false;
};

void run(const Flags& flags) {
  const Plant plant = read_plant_file(flags.plant);
  std::vector<Measurement> runs;
  for (const std::string& data : flags.data) runs.push_back(read_measurement(data));
  std::vector<FreeNumber> numbers;
  for (const std::string& name : flags.free) numbers.emplace_back(name, plant);
  const Fitted fitted = fit_by_output_error(plant, numbers, runs, flags.horizon_s, flags.fixed_starts);
  std::printf("%s\n", fitted.summary.BriefReport().c_str());
  if (!fitted.summary.IsSolutionUsable())
    throw ConfigError("the fit failed: start from other values, or choose a shorter --horizon");
  write_plant_file(fitted.plant, flags.out);
}

}  // namespace

int main(int argc, char** argv) {
  Flags flags;
  CLI::App app("Fit numbers of a plant file by output error");
  app.add_option("plant", flags.plant)->required();
  app.add_option("--data", flags.data)->required();
  app.add_option("--free", flags.free)->required();
  app.add_option("--out", flags.out)->required();
  app.add_option("--horizon", flags.horizon_s)->check(CLI::PositiveNumber);
  app.add_flag("--fixed-starts", flags.fixed_starts);
  CLI11_PARSE(app, argc, argv);
  try {
    run(flags);
    return 0;
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "%s\n", problem.what());
    return 1;
  }
}
