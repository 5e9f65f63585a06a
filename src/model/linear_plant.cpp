#include "linear_plant.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <string>
#include <unsupported/Eigen/MatrixFunctions>
#include <utility>

#include "upright/base/error.hpp"
#include "upright/model/dual_number.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

namespace {

constexpr int bristle_place = 4;
constexpr int attached_place = 5;
constexpr int motor_place = 7;
constexpr int state_places = 8;
using Dual = DualNumber<state_places>;
using Slopes = Eigen::Matrix<double, state_places, state_places>;

/// Small enough to change no slope, and not zero, so that a kink shows the slope of its side.
constexpr double beside_a_kink = 1e-30;

PlantState<Dual> seeded_state(double side) {
  return {Dual(0.0, 0),
          Dual(0.0, 1),
          Dual(side * beside_a_kink, 2),
          Dual(side * beside_a_kink, 3),
          Dual(0.0, motor_place),
          Dual(0.0, bristle_place),
          Dual(0.0, attached_place),
          Dual(0.0, attached_place + 1)};
}

struct Line {
  Slopes slopes = Slopes::Zero();
  Eigen::Matrix<double, state_places, 1> rate = Eigen::Matrix<double, state_places, 1>::Zero();
};

/// Half the line on either side of rest, added up.
Line line_of(const Dynamics<Dual>& dynamics) {
  Line line;
  for (const double side : {1.0, -1.0}) {
    const PlantState<Dual> state = seeded_state(side);
    const PlantState<Dual> rate = dynamics.derivative(state, state.motor_v, Contacts{});
    const std::array<const Dual*, motor_place> rows = {&rate.cart_m,      &rate.theta_rad, &rate.cart_mps,
                                                       &rate.theta_radps, &rate.bristle_m, &rate.attached_m,
                                                       &rate.attached_mps};
    for (std::size_t row = 0; row < rows.size(); ++row) {
      for (int place = 0; place < state_places; ++place)
        line.slopes(static_cast<Eigen::Index>(row), place) += 0.5 * rows[row]->v[place];
      line.rate(static_cast<Eigen::Index>(row)) += 0.5 * rows[row]->a;
    }
  }
  return line;
}

struct Place {
  int index;
  std::string name;
};

std::vector<Place> places_of(const Dynamics<Dual>& dynamics) {
  std::vector<Place> places;
  for (int i = 0; i < static_cast<int>(fed_back_count); ++i)
    if (dynamics.has_pendulum() || i % 2 == 0)
      places.push_back({i, std::string(fed_back_names[static_cast<std::size_t>(i)])});
  if (dynamics.has_bristle_state()) places.push_back({bristle_place, "bristle_m"});
  if (dynamics.has_attached_mass()) {
    places.push_back({attached_place, "attached_m"});
    places.push_back({attached_place + 1, "attached_mps"});
  }
  if (dynamics.has_motor_lag()) places.push_back({motor_place, "motor_v"});
  return places;
}

void read_sensors(const Dynamics<Dual>& dynamics, LinearPlant& linear) {
  const Outputs<Dual> outputs = outputs_of_true_encoder(dynamics.model(), Dual(0.0, 0), Dual(0.0, 1));
  const Eigen::Vector4d scale(outputs.cart_m.v[0], outputs.theta_rad.v[1], outputs.cart_m.v[0],
                              outputs.theta_rad.v[1]);
  const Eigen::Vector4d offset(outputs.cart_m.a, outputs.theta_rad.a, 0.0, 0.0);
  const auto count = static_cast<Eigen::Index>(linear.fed_back.size());
  linear.sensor_scale.resize(count);
  linear.sensor_offset.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto place = static_cast<Eigen::Index>(linear.fed_back[static_cast<std::size_t>(i)]);
    linear.sensor_scale(i) = scale(place);
    linear.sensor_offset(i) = offset(place);
  }
}

/// What does nothing within a dead zone has the slope outside it.
Plant without_dead_zones(Plant plant, LinearPlant& linear) {
  for (const auto& [kind, note] :
       {std::pair{"voltage_dead_zone",
                  "the slope outside the zone is used, inside it the voltage does nothing"},
        std::pair{"backlash",
                  "the motor is taken as fixed to the cart, inside the gap it does not move the cart"}}) {
    if (plant.find(kind) == nullptr) continue;
    plant.remove(effect_number(kind));
    linear.notes.push_back(std::string(kind) + ": " + note);
  }
  return plant;
}

void record_ideal_sensors(const Plant& plant, LinearPlant& linear) {
  for (const auto& [kind, note] : {std::pair{"drive_compliance", "the drive is taken as stiff"},
                                   std::pair{"encoder_eccentricity", "the encoder is taken to run true"},
                                   std::pair{"lost_counts", "the counter is taken to lose nothing"}})
    if (plant.find(kind) != nullptr) linear.notes.push_back(std::string(kind) + ": " + note);
}

void refuse_not_finite(const LinearPlant& linear) {
  if (linear.a.allFinite() && linear.b.allFinite()) return;
  throw ConfigError("the linearised plant has values that are not finite, " + matrix_text("A", linear.a) +
                    ", " + matrix_text("b", linear.b) + ": correct the plant's parameters");
}

}  // namespace

std::string matrix_text(std::string_view name, const Eigen::MatrixXd& matrix) {
  std::string text = std::string(name) + " = [";
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    if (row > 0) text += ';';
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      char number[32];
      std::snprintf(number, sizeof number, "%.6g", matrix(row, column));
      if (row + column > 0) text += ' ';
      text += number;
    }
  }
  return text + "]";
}

Plant sliding_plant(const Plant& plant) {
  Plant sliding = plant;
  std::erase_if(sliding.effects, is_dry);
  sliding.remove(effect_number("bristle_friction"));
  return sliding;
}

Plant without_vibrations(Plant plant) {
  const std::size_t sprung = effect_index<effects::SprungMass>();
  if (const PlantEffect* found = plant.find(sprung); found != nullptr) {
    const double corrected = make_model<double>(plant).corrected().cart_mass_kg / plant.cart_mass_kg;
    plant.cart_mass_kg +=
        effects::SprungMass::attached_mass_kg(found->values.data(), plant.cart_mass_kg) / corrected;
    plant.remove(sprung);
  }
  plant.remove(effect_index<effects::FlexibleRod>());
  return plant;
}

SampledPlant hold_input(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double duration_s) {
  const Eigen::Index n = a.rows(), inputs = b.cols();
  Eigen::MatrixXd block = Eigen::MatrixXd::Zero(n + inputs, n + inputs);
  block.topLeftCorner(n, n) = a * duration_s;
  block.topRightCorner(n, inputs) = b * duration_s;
  const Eigen::MatrixXd step = block.exp();
  return {step.topLeftCorner(n, n), step.topRightCorner(n, inputs)};
}

LinearPlant linearize(const Plant& plant, double smoothing) {
  if (!(smoothing > 0.0) || !std::isfinite(smoothing))
    throw ConfigError("sgn(v) cannot be linearised at rest without smoothing: use a smoothing above 0");
  LinearPlant linear;
  PlantModel<Dual> model = make_model<Dual>(without_dead_zones(plant, linear));
  model.smoothing = smoothing;
  const Dynamics<Dual> dynamics(model);
  const std::vector<Place> places = places_of(dynamics);
  const auto n = static_cast<Eigen::Index>(places.size());
  const Line line = line_of(dynamics);
  linear.a = Eigen::MatrixXd::Zero(n, n);
  linear.b = Eigen::VectorXd::Zero(n);
  linear.constant = Eigen::VectorXd::Zero(n);
  for (Eigen::Index row = 0; row < n; ++row) {
    const Place& place = places[static_cast<std::size_t>(row)];
    linear.states.push_back(place.name);
    if (place.index < static_cast<int>(fed_back_count))
      linear.fed_back.push_back(static_cast<std::size_t>(place.index));
    linear.constant(row) = line.rate(place.index);
    for (Eigen::Index column = 0; column < n; ++column)
      linear.a(row, column) = line.slopes(place.index, places[static_cast<std::size_t>(column)].index);
    if (!dynamics.has_motor_lag()) linear.b(row) = line.slopes(place.index, motor_place);
  }
  if (dynamics.has_motor_lag()) {
    const double rate = 1.0 / dynamics.motor_time_constant_s().a;
    linear.a(n - 1, n - 1) = -rate;
    linear.b(n - 1) = rate;
  }
  linear.actuator_slope = dynamics.actuate(Dual(0.0, 0)).v[0];
  linear.input_delay_s = dynamics.input_delay_s().a;
  read_sensors(dynamics, linear);
  record_ideal_sensors(plant, linear);
  refuse_not_finite(linear);
  return linear;
}

}  // namespace upright
