// How far a pushed cart rolls with an effect of one's own in its plant file.
//   brake PLANT
#include <cmath>
#include <iostream>

#include "upright/base/error.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/sim/simulator.hpp"

namespace {

double rolls_m(const upright::Plant& plant) {
  constexpr double push_mps = 0.5, longest_s = 5.0;
  upright::Simulator<double> simulator(upright::make_model<double>(plant));
  upright::PlantState<double> start;
  start.cart_mps = push_mps;
  simulator.start(start);
  simulator.advance_to(longest_s);
  return simulator.engine().state().cart_m;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: brake PLANT\n";
    return 2;
  }
  try {
    upright::Plant plant = upright::read_plant_file(argv[1]);
    const double with_m = rolls_m(plant);
    plant.remove(upright::effect_number("eddy_current_brake"));
    const double without_m = rolls_m(plant);
    std::cout << "rolls " << with_m << " m with the brake, " << without_m << " m without\n";
    return with_m < without_m ? 0 : 3;
  } catch (const upright::Error& error) {
    std::cerr << "brake: " << error.what() << "\n";
    return static_cast<int>(error.code());
  }
}
