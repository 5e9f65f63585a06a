// The reference engine: SUNDIALS CVODE on the same equations, with root functions for breakaway,
// sticking, reversal, fall and track end, restarted at each voltage step and event. Slow; independent of
// the Runge-Kutta steps of EventEngine, with the same interface.
#pragma once

#include <functional>
#include <memory>

#include "upright/sim/contacts.hpp"

namespace upright {

/// Integrates a plant with error control (`EngineOptions::relative_tolerance`); `step_fraction` and
/// `max_step_s` are not used. Adams method for plants without stiff parts, otherwise BDF. Throws Error
/// where CVODE fails.
class CvodeEngine {
 public:
  /// The voltage as a function of time and state [V].
  using Volts = std::function<double(double t_s, const PlantState<double>&)>;
  using Sink = std::function<void(const DenseStep&)>;  ///< receives each step

  /// Starts at rest: call `start`.
  explicit CvodeEngine(const PlantModel<double>& model, const EngineOptions& options = {});
  CvodeEngine(CvodeEngine&&) noexcept;             ///< moves the engine with its state
  CvodeEngine& operator=(CvodeEngine&&) noexcept;  ///< moves the engine with its state
  ~CvodeEngine();

  const Dynamics<double>& dynamics() const;  ///< the equations of motion

  /// As in EventEngine.
  void start(const PlantState<double>& state, double time_s = 0.0, double voltage_v = 0.0);
  void advance(double duration_s, double voltage_v);  ///< under a constant voltage
  /// Under a voltage that varies, in steps of at most `max_step_s`.
  void advance(double duration_s, const Volts& volts, double max_step_s, const Sink& sink);

  const PlantState<double>& state() const;                                 ///< the state now
  Outputs<double> outputs() const { return dynamics().measure(state()); }  ///< what the sensors show now
  Contacts contacts() const;                                               ///< the modes of the contacts now
  double time_s() const;                                                   ///< the time now [s]
  /// Whether dry friction holds the cart.
  bool cart_at_rest() const { return dynamics().cart_can_stick() && contacts().cart == Contact::stick; }
  std::optional<EventKind> halted() const;  ///< the event that ended the motion; absent: it goes on

  std::uint64_t event_count() const;                 ///< how many events there were
  const Event& event(std::uint64_t index) const;     ///< one of the last `kept_events` events
  static constexpr std::uint64_t kept_events = 256;  ///< how many events are kept
  std::uint64_t step_count() const;                  ///< how many steps were taken

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

}  // namespace upright
