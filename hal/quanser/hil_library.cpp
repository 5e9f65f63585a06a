#include "hil_library.hpp"

#include <dlfcn.h>

#include <array>
#include <cstring>
#include <filesystem>

#include "upright/base/error.hpp"

namespace upright {

namespace {

/// Distributions install the name without a version only with the development package.
constexpr std::array endings = {"", ".1"};

std::string place_of(const std::string& folder, const std::string& name) {
  if (folder.empty() || name.find('/') != std::string::npos) return name;
  return (std::filesystem::path(folder) / name).string();
}

/// A library stays loaded until the program ends, because it may run its own threads.
void* load_library(const std::string& folder, const std::string& name) {
  for (const char* ending : endings)
    if (void* handle = dlopen((place_of(folder, name) + ending).c_str(), RTLD_NOW | RTLD_GLOBAL);
        handle != nullptr)
      return handle;
  return nullptr;
}

std::string loader_words() {
  const char* words = dlerror();
  return words == nullptr ? "no reason given" : words;
}

/// The loader's error for `name` itself, and not for the endings that were tried after it.
std::string problem_of(const std::string& folder, const std::string& name) {
  dlopen(place_of(folder, name).c_str(), RTLD_NOW | RTLD_GLOBAL);
  return loader_words();
}

template <class Function>
void find(void* library, const char* name, Function& function) {
  void* const found = dlsym(library, name);
  static_assert(sizeof found == sizeof function);
  std::memcpy(&function, &found, sizeof found);
}

hil::Functions functions_of(void* library) {
  hil::Functions f;
  find(library, "hil_open", f.open);
  find(library, "hil_close", f.close);
  find(library, "hil_get_version", f.get_version);
  find(library, "hil_get_string_property", f.get_string_property);
  find(library, "hil_set_card_specific_options", f.set_card_specific_options);
  find(library, "hil_set_encoder_quadrature_mode", f.set_encoder_quadrature_mode);
  find(library, "hil_set_encoder_counts", f.set_encoder_counts);
  find(library, "hil_set_analog_output_ranges", f.set_analog_output_ranges);
  find(library, "hil_set_digital_directions", f.set_digital_directions);
  find(library, "hil_read_encoder", f.read_encoder);
  find(library, "hil_read_other", f.read_other);
  find(library, "hil_write_analog", f.write_analog);
  find(library, "hil_write_digital", f.write_digital);
  find(library, "hil_watchdog_set_analog_expiration_state", f.watchdog_set_analog_expiration_state);
  find(library, "hil_watchdog_set_digital_expiration_state", f.watchdog_set_digital_expiration_state);
  find(library, "hil_watchdog_start", f.watchdog_start);
  find(library, "hil_watchdog_reload", f.watchdog_reload);
  find(library, "hil_watchdog_is_expired", f.watchdog_is_expired);
  find(library, "hil_watchdog_clear", f.watchdog_clear);
  find(library, "hil_watchdog_stop", f.watchdog_stop);
  find(library, "hil_set_analog_termination_state", f.set_analog_termination_state);
  find(library, "hil_set_digital_termination_state", f.set_digital_termination_state);
  find(library, "hil_write_termination_states", f.write_termination_states);
  find(library, "hil_task_create_encoder_reader", f.task_create_encoder_reader);
  find(library, "hil_task_set_buffer_overflow_mode", f.task_set_buffer_overflow_mode);
  find(library, "hil_task_start", f.task_start);
  find(library, "hil_task_read_encoder", f.task_read_encoder);
  find(library, "hil_task_stop", f.task_stop);
  find(library, "hil_task_delete", f.task_delete);
  // It is in one of the libraries that libhil needs, under its plain name or that of its 8-bit text.
  find(RTLD_DEFAULT, "msg_get_error_messageA", f.get_error_message);
  if (f.get_error_message == nullptr) find(RTLD_DEFAULT, "msg_get_error_message", f.get_error_message);
  return f;
}

std::string path_of(const hil::Functions& functions) {
  Dl_info info{};
  void* address = nullptr;
  std::memcpy(&address, &functions.open, sizeof address);
  return dladdr(address, &info) != 0 && info.dli_fname != nullptr ? info.dli_fname : "";
}

const char* error_name(int number) {
  switch (number) {
    case hil::not_supported:
    case hil::function_not_supported:
      return "not supported";
    case hil::no_permission:
      return "no permission";
    case hil::timed_out:
      return "timed out";
    case hil::unable_to_open_driver:
      return "the driver of the board could not be opened";
    case hil::board_not_found:
      return "board not found";
    case hil::board_in_use:
      return "the board is in use";
    case hil::unrecognized_board_type:
      return "unknown board type";
    default:
      return "see Quanser's list of error codes";
  }
}

}  // namespace

HilLibrary::HilLibrary(const QuanserRig& rig, const std::string& rig_file) {
  load_library(rig.folder, rig.common_library);
  load_library(rig.folder, rig.runtime_library);
  void* const library = load_library(rig.folder, rig.library);
  if (library == nullptr)
    throw DeviceError(
        "Quanser's HIL library " + rig.library + " of " + rig_file + " cannot be loaded (" +
        problem_of(rig.folder, rig.library) +
        "): install Quanser's SDK for Linux (package quanser-sdk), or set quanser_hil.library and "
        "quanser_hil.folder to the library and its folder");
  functions_ = functions_of(library);
  if (functions_.open == nullptr || functions_.close == nullptr || functions_.read_encoder == nullptr ||
      functions_.write_analog == nullptr)
    throw DeviceError(rig.library + " of " + rig_file +
                      " is not a HIL library, because it lacks hil_open, hil_close, hil_read_encoder or "
                      "hil_write_analog: set quanser_hil.library to Quanser's libhil.so");
  path_ = path_of(functions_);
}

std::string HilLibrary::version() const {
  hil::Version version;
  if (functions_.get_version == nullptr || functions_.get_version(&version) < 0) return "unknown";
  return std::to_string(version.major) + "." + std::to_string(version.minor) + "." +
         std::to_string(version.release);
}

std::string HilLibrary::words_for(hil::Error error) const {
  std::array<char, 512> text{};
  if (functions_.get_error_message != nullptr)
    functions_.get_error_message(nullptr, error, text.data(), text.size());
  text.back() = '\0';
  return "error " + std::to_string(-error) + ": " + (text[0] != '\0' ? text.data() : error_name(-error));
}

}  // namespace upright
