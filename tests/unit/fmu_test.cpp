// The library of an FMU against the engine itself: the same doubles, bit for bit.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "plants.hpp"
#include "sim/fmu/fmi2.hpp"
#include "sim/fmu/fmu_variables.hpp"
#include "temporary_folder.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {
namespace {

/// The library as an importer has it, with the plant in its resources.
class LoadedFmu {
 public:
  LoadedFmu(const FmuPlant& plant, const std::filesystem::path& folder) {
    std::ofstream(folder / "plant.txt") << "{guid}\n" << fmu_plant_text(plant);
    library_ = dlopen(UPRIGHT_FMU_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    if (library_ == nullptr) throw std::runtime_error(dlerror());
    component_ =
        function<fmi2Component(fmi2String, fmi2Type, fmi2String, fmi2String, const fmi2CallbackFunctions*,
                               fmi2Boolean, fmi2Boolean)>("fmi2Instantiate")(
            "one", fmi2CoSimulation, "{guid}", ("file://" + folder.string()).c_str(), nullptr, 0, 0);
    if (component_ == nullptr) throw std::runtime_error("no instance");
    function<fmi2Status(fmi2Component)>("fmi2ExitInitializationMode")(component_);
  }
  ~LoadedFmu() {
    function<void(fmi2Component)>("fmi2FreeInstance")(component_);
    dlclose(library_);
  }
  LoadedFmu(const LoadedFmu&) = delete;
  LoadedFmu& operator=(const LoadedFmu&) = delete;

  void step(double voltage_v, double at_s, double step_s) {
    const fmi2ValueReference voltage = fmu_voltage_reference;
    using SetReal = fmi2Status(fmi2Component, const fmi2ValueReference*, size_t, const fmi2Real*);
    EXPECT_EQ(function<SetReal>("fmi2SetReal")(component_, &voltage, 1, &voltage_v), fmi2OK);
    using DoStep = fmi2Status(fmi2Component, fmi2Real, fmi2Real, fmi2Boolean);
    EXPECT_EQ(function<DoStep>("fmi2DoStep")(component_, at_s, step_s, 1), fmi2OK);
  }
  double output(FmuOutput which) {
    const auto reference = static_cast<fmi2ValueReference>(which);
    double value = 0.0;
    using GetReal = fmi2Status(fmi2Component, const fmi2ValueReference*, size_t, fmi2Real*);
    EXPECT_EQ(function<GetReal>("fmi2GetReal")(component_, &reference, 1, &value), fmi2OK);
    return value;
  }

 private:
  template <class Function>
  Function* function(const char* name) {
    return reinterpret_cast<Function*>(dlsym(library_, name));
  }

  void* library_ = nullptr;
  fmi2Component component_ = nullptr;
};

TEST(Fmu, HasTheBitsOfTheEngine) {
  for (const char* name : {"viscous", "exponential", "dynamic"}) {
    SCOPED_TRACE(name);
    FmuPlant plant{test::config_plant(name)};
    plant.plant.set("input_delay", {0.0037});
    plant.plant.set("motor_lag", {0.004});
    plant.plant.set("pivot_coulomb_friction", {0.002});
    plant.theta_rad = 2.0;
    const test::TemporaryFolder folder;
    LoadedFmu fmu(plant, folder.path());
    Simulator<double> simulator(make_model<double>(plant.plant));
    PlantState<double> state;
    state.theta_rad = 2.0;
    simulator.start(state);
    for (int k = 0; k < 3000; ++k) {
      const double voltage_v = 4.0 * std::sin(0.01 * k) + (k % 300 < 150 ? 1.0 : -1.0);
      simulator.command(k / 1000.0, voltage_v);
      simulator.advance_to((k + 1) / 1000.0);
      fmu.step(voltage_v, k * 1e-3, 1e-3);
      const PlantState<double>& now = simulator.engine().state();
      ASSERT_EQ(fmu.output(FmuOutput::cart_m), simulator.engine().outputs().cart_m) << k;
      ASSERT_EQ(fmu.output(FmuOutput::theta_rad), simulator.engine().outputs().theta_rad) << k;
      ASSERT_EQ(fmu.output(FmuOutput::cart_velocity_mps), now.cart_mps) << k;
      ASSERT_EQ(fmu.output(FmuOutput::pendulum_rate_radps), now.theta_radps) << k;
    }
  }
}

TEST(Fmu, ForcesAreThoseOnTheCart) {
  // A cart alone: what the motor gives and friction takes accelerates it.
  FmuPlant plant{test::free_cart()};
  plant.plant.motor.back_emf_n_per_mps = 2.0;
  plant.plant.set("viscous_friction", {3.0});
  plant.cart_velocity_mps = 0.5;
  const test::TemporaryFolder folder;
  LoadedFmu fmu(plant, folder.path());
  fmu.step(4.0, 0.0, 0.0);
  EXPECT_NEAR(fmu.output(FmuOutput::other_force_n), -3.0 * 0.5, 1e-12);
  fmu.step(4.0, 0.0, 1e-3);
  const double v = fmu.output(FmuOutput::cart_velocity_mps);
  EXPECT_NEAR(fmu.output(FmuOutput::motor_force_n), 4.0 * plant.plant.motor.force_per_volt_n - 2.0 * v,
              1e-12);
  // Friction that holds is as large as what it holds.
  plant.plant.set("coulomb_friction", {50.0});
  plant.cart_velocity_mps = 0.0;
  LoadedFmu held(plant, folder.path());
  held.step(4.0, 0.0, 1e-3);
  EXPECT_NEAR(held.output(FmuOutput::other_force_n), -held.output(FmuOutput::motor_force_n), 1e-12);
}

TEST(Fmu, PlantReadsBackFromItsText) {
  for (const char* name : {"viscous", "exponential", "dynamic"}) {
    FmuPlant plant{test::config_plant(name)};
    plant.cart_m = 0.1;
    plant.theta_rad = std::numbers::pi;
    const auto back = fmu_plant_of(fmu_plant_text(plant));
    ASSERT_TRUE(back.has_value());
    EXPECT_EQ(fmu_plant_text(*back), fmu_plant_text(plant));
    EXPECT_EQ(fault_of_parameters(*back), "");
  }
  for (const char* text : {"cart_mass_kg", "cart_mass_kg x\n", "cart_mass_kg 1", "no_such 1\n",
                           "viscous_friction.none 1\n", "\n", "viscous_friction 1\n"})
    EXPECT_FALSE(fmu_plant_of(text).has_value()) << text;
}

}  // namespace
}  // namespace upright
