#include "card.hpp"

#include <cmath>
#include <numbers>

#include "upright/base/error.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/sim/simulator.hpp"

namespace {

constexpr double metres_per_count = 2.27485e-5, radians_per_count = 2.0 * std::numbers::pi / 4096;
constexpr double start_theta_rad = 0.05;  // how the pendulum is let go

}  // namespace

struct Card {
  explicit Card(const char* plant_file)
      : plant(upright::make_model<double>(upright::read_plant_file(plant_file))) {
    upright::PlantState<double> start;
    start.theta_rad = start_theta_rad;
    plant.start(start);
  }
  upright::Simulator<double> plant;
};

Card* card_open(const char* plant_file) {
  try {
    return new Card(plant_file);
  } catch (const upright::Error&) {
    return nullptr;
  }
}

void card_close(Card* card) {
  delete card;
}

bool card_read_encoders(Card* card, double time_s, std::int64_t counts[2]) {
  card->plant.advance_to(time_s);
  const upright::PlantState<double>& state = card->plant.engine().state();
  counts[0] = std::llround(state.cart_m / metres_per_count);
  counts[1] = std::llround(state.theta_rad / radians_per_count);
  return true;
}

bool card_write_volts(Card* card, double time_s, double volts) {
  card->plant.command(time_s, volts);
  return true;
}
