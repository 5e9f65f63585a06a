// The functions that an importer of the FMU calls. The library is the same for every plant: the plant is in
// the FMU's resources/plant.txt. It uses nothing but the C library.
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <new>
#include <string>
#include <string_view>

#include "fmi2.hpp"
#include "fmu_instance.hpp"

namespace {

using namespace upright;

/// What fmi2Component points at.
struct Component {
  std::string name;
  fmi2CallbackFunctions callbacks{};
  FmuInstance instance;
  FmuPlant given;  ///< by the FMU, for a reset
};

Component& of(fmi2Component component) {
  return *static_cast<Component*>(component);
}

fmi2Status fail(const Component& c, const std::string& sentence) {
  if (c.callbacks.logger != nullptr)
    c.callbacks.logger(c.callbacks.componentEnvironment, c.name.c_str(), fmi2Error, "logStatusError", "%s",
                       sentence.c_str());
  return fmi2Error;
}

/// The path in a URI file:///... with %XX decoded.
std::string path_of_uri(std::string_view uri) {
  for (const std::string_view scheme : {"file://localhost", "file://", "file:"})
    if (uri.starts_with(scheme)) {
      uri.remove_prefix(scheme.size());
      break;
    }
  std::string path;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size()) {
      path += static_cast<char>(std::stoi(std::string(uri.substr(i + 1, 2)), nullptr, 16));
      i += 2;
    } else {
      path += uri[i];
    }
  }
  return path;
}

/// The plant file of the FMU begins with the FMU's identity.
std::optional<FmuPlant> plant_in(const std::string& folder, std::string_view guid) {
  std::ifstream in(folder + "/plant.txt", std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const std::size_t end = text.find('\n');
  if (end == std::string::npos || std::string_view(text).substr(0, end) != guid) return std::nullopt;
  return fmu_plant_of(text.substr(end + 1));
}

fmi2Status set_real(Component& c, fmi2ValueReference reference, double value) {
  if (!std::isfinite(value)) return fail(c, "a value is not finite: give a number");
  if (reference == fmu_voltage_reference) {
    c.instance.set_voltage(value);
    return fmi2OK;
  }
  double* parameter = fmu_parameter(c.instance.plant(), reference);
  if (parameter == nullptr) return fail(c, "there is no input and no parameter " + std::to_string(reference));
  if (c.instance.has_started())
    return fail(c, "parameters can be set before the simulation only: reset first");
  *parameter = value;
  return fmi2OK;
}

fmi2Status get_real(Component& c, fmi2ValueReference reference, double& value) {
  if (reference == fmu_voltage_reference) {
    value = c.instance.voltage_v();
    return fmi2OK;
  }
  if (const double* parameter = fmu_parameter(c.instance.plant(), reference)) {
    value = *parameter;
    return fmi2OK;
  }
  if (reference > static_cast<unsigned>(FmuOutput::other_force_n))
    return fail(c, "there is no variable " + std::to_string(reference));
  const auto output = static_cast<FmuOutput>(reference);
  if (c.instance.has_started()) {
    value = c.instance.output(output);
    return fmi2OK;
  }
  // While parameters are set, outputs are those of the initial state.
  FmuInstance begun = c.instance;
  begun.start();
  value = begun.output(output);
  return fmi2OK;
}

}  // namespace

// NOLINTBEGIN(readability-identifier-naming): the names are the standard's
extern "C" {
#define FMI2_EXPORT __attribute__((visibility("default")))

FMI2_EXPORT const char* fmi2GetTypesPlatform() {
  return "default";
}
FMI2_EXPORT const char* fmi2GetVersion() {
  return "2.0";
}
FMI2_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component, fmi2Boolean, size_t, const fmi2String*) {
  return fmi2OK;
}

// The parameters are those of FMI 2.0, as for all functions here.
FMI2_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid,
                                          fmi2String resources, const fmi2CallbackFunctions* callbacks,
                                          fmi2Boolean, fmi2Boolean) {
  try {
    if (type != fmi2CoSimulation || guid == nullptr || resources == nullptr) return nullptr;
    const std::optional<FmuPlant> plant = plant_in(path_of_uri(resources), guid);
    auto component = std::make_unique<Component>(
        Component{name != nullptr ? name : "", callbacks != nullptr ? *callbacks : fmi2CallbackFunctions{},
                  FmuInstance(plant.value_or(FmuPlant{})), plant.value_or(FmuPlant{})});
    if (!plant) {
      fail(*component,
           "resources/plant.txt is missing or belongs to another FMU: unpack the whole FMU again");
      return nullptr;
    }
    return component.release();
  } catch (const std::exception&) {
    return nullptr;
  }
}
FMI2_EXPORT void fmi2FreeInstance(fmi2Component c) {
  delete static_cast<Component*>(c);
}

FMI2_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean, fmi2Real, fmi2Real start_s,
                                           fmi2Boolean, fmi2Real) {
  of(c).instance.set_start_time(start_s);
  return fmi2OK;
}
FMI2_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component) {
  return fmi2OK;
}
FMI2_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  const std::string fault = fault_of_parameters(of(c).instance.plant());
  if (!fault.empty()) return fail(of(c), fault);
  of(c).instance.start();
  return fmi2OK;
}
FMI2_EXPORT fmi2Status fmi2Terminate(fmi2Component) {
  return fmi2OK;
}
FMI2_EXPORT fmi2Status fmi2Reset(fmi2Component c) {
  of(c).instance = FmuInstance(of(c).given);
  return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference* references, size_t count,
                                   fmi2Real* values) {
  for (size_t i = 0; i < count; ++i)
    if (const fmi2Status status = get_real(of(c), references[i], values[i]); status != fmi2OK) return status;
  return fmi2OK;
}
FMI2_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference* references, size_t count,
                                   const fmi2Real* values) {
  for (size_t i = 0; i < count; ++i)
    if (const fmi2Status status = set_real(of(c), references[i], values[i]); status != fmi2OK) return status;
  return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real at_s, fmi2Real step_s, fmi2Boolean) {
  Component& component = of(c);
  if (!component.instance.has_started()) return fail(component, "the initialization is not finished");
  if (!(step_s >= 0.0) || !std::isfinite(at_s + step_s)) return fail(component, "the step is negative");
  component.instance.step(at_s, at_s + step_s);
  return fmi2OK;
}
FMI2_EXPORT fmi2Status fmi2CancelStep(fmi2Component c) {
  return fail(of(c), "steps are never pending");
}

FMI2_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* state) {
  if (*state != nullptr) {
    *static_cast<FmuInstance*>(*state) = of(c).instance;
    return fmi2OK;
  }
  *state = new (std::nothrow) FmuInstance(of(c).instance);
  return *state != nullptr ? fmi2OK : fail(of(c), "there is no memory for the state");
}
FMI2_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
  of(c).instance = *static_cast<const FmuInstance*>(state);
  return fmi2OK;
}
FMI2_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component, fmi2FMUstate* state) {
  delete static_cast<FmuInstance*>(*state);
  *state = nullptr;
  return fmi2OK;
}

// What the standard asks every library to have, and this model has none of.
FMI2_EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference*, size_t count,
                                      fmi2Integer*) {
  return count == 0 ? fmi2OK : fail(of(c), "there are no integer variables");
}
FMI2_EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference*, size_t count,
                                      const fmi2Integer*) {
  return count == 0 ? fmi2OK : fail(of(c), "there are no integer variables");
}
FMI2_EXPORT fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference*, size_t count,
                                      fmi2Boolean*) {
  return count == 0 ? fmi2OK : fail(of(c), "there are no boolean variables");
}
FMI2_EXPORT fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference*, size_t count,
                                      const fmi2Boolean*) {
  return count == 0 ? fmi2OK : fail(of(c), "there are no boolean variables");
}
FMI2_EXPORT fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference*, size_t count, fmi2String*) {
  return count == 0 ? fmi2OK : fail(of(c), "there are no string variables");
}
FMI2_EXPORT fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference*, size_t count,
                                     const fmi2String*) {
  return count == 0 ? fmi2OK : fail(of(c), "there are no string variables");
}
FMI2_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate, size_t*) {
  return fail(of(c), "the state cannot be serialized");
}
FMI2_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate, fmi2Byte*, size_t) {
  return fail(of(c), "the state cannot be serialized");
}
FMI2_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte*, size_t, fmi2FMUstate*) {
  return fail(of(c), "the state cannot be serialized");
}
// The parameters are those of FMI 2.0.
FMI2_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference*, size_t,
                                                    const fmi2ValueReference*, size_t, const fmi2Real*,
                                                    fmi2Real*) {
  return fail(of(c), "there are no directional derivatives");
}
FMI2_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference*, size_t,
                                                   const fmi2Integer*, const fmi2Real*) {
  return fail(of(c), "the voltage is held over a step");
}
FMI2_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference*, size_t,
                                                    const fmi2Integer*, fmi2Real*) {
  return fail(of(c), "there are no derivatives of outputs");
}
FMI2_EXPORT fmi2Status fmi2GetStatus(fmi2Component, fmi2StatusKind, fmi2Status*) {
  return fmi2Discard;
}
FMI2_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component, fmi2StatusKind, fmi2Real*) {
  return fmi2Discard;
}
FMI2_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component, fmi2StatusKind, fmi2Integer*) {
  return fmi2Discard;
}
FMI2_EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component, fmi2StatusKind, fmi2Boolean*) {
  return fmi2Discard;
}
FMI2_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component, fmi2StatusKind, fmi2String*) {
  return fmi2Discard;
}

}  // extern "C"
// NOLINTEND(readability-identifier-naming)
