// The exceptions that set-up code throws. The control loop throws none.
#pragma once

#include <stdexcept>
#include <string>

namespace upright {

/// Exit codes of every command.
enum class ExitCode : int {
  done = 0,
  usage = 2,    ///< usage or configuration error: nothing moved
  stopped = 3,  ///< the run ended by a safety stop, or the pendulum fell; the data are kept
  device = 4,   ///< link or device error
};

/// One sentence (cause first, then the remedy), and the exit code with which the command ends.
class Error : public std::runtime_error {
 public:
  /// `sentence`: the cause, then the remedy.
  Error(ExitCode code, const std::string& sentence) : std::runtime_error(sentence), code_(code) {}
  ExitCode code() const { return code_; }  ///< the exit code that a command ends with

 private:
  ExitCode code_;
};

/// A file, an option or a value given by the user is wrong (exit code 2).
class ConfigError : public Error {
 public:
  /// `sentence`: file, line and key, the cause, then the remedy.
  explicit ConfigError(const std::string& sentence) : Error(ExitCode::usage, sentence) {}
};

/// A link or a device failed at set-up (exit code 4).
class DeviceError : public Error {
 public:
  /// `sentence`: the cause, then the remedy.
  explicit DeviceError(const std::string& sentence) : Error(ExitCode::device, sentence) {}
};

}  // namespace upright
