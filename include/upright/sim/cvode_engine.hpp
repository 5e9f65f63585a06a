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
  using Volts = std::function<double(double t_s, const PlantState<double>&)>;
  using Sink = std::function<void(const DenseStep&)>;

  explicit CvodeEngine(const PlantModel<double>& model, const EngineOptions& options = {});
  CvodeEngine(CvodeEngine&&) noexcept;
  CvodeEngine& operator=(CvodeEngine&&) noexcept;
  ~CvodeEngine();

  const Dynamics<double>& dynamics() const;

  /// As in EventEngine.
  void start(const PlantState<double>& state, double time_s = 0.0, double voltage_v = 0.0);
  void advance(double duration_s, double voltage_v);
  void advance(double duration_s, const Volts& volts, double most_step_s, const Sink& sink);

  const PlantState<double>& state() const;
  Outputs<double> outputs() const { return dynamics().measure(state()); }
  Contacts contacts() const;
  double time_s() const;
  bool cart_at_rest() const { return dynamics().cart_can_stick() && contacts().cart == Contact::stick; }
  std::optional<EventKind> halted() const;

  std::uint64_t event_count() const;
  const Event& event(std::uint64_t index) const;
  static constexpr std::uint64_t kept_events = 256;
  std::uint64_t step_count() const;

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

}  // namespace upright
