#include "cvode_engine.hpp"

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <cmath>
#include <string>

#include "upright/base/error.hpp"
#include "upright/sim/event_root.hpp"

namespace upright {

namespace {

constexpr sunindextype state_size = 8;
constexpr double min_lag_s = 1e-6;
constexpr double smallest_step_s = 1e-13;
/// Faster rates than this make the plant stiff against control periods of a millisecond.
constexpr double stiff_rate_radps = 5000.0;

PlantState<double> unpack(const double* y) {
  return {y[0], y[1], y[2], y[3], y[4], y[5], y[6], y[7]};
}

void pack(const PlantState<double>& s, double* y) {
  y[0] = s.cart_m;
  y[1] = s.theta_rad;
  y[2] = s.cart_mps;
  y[3] = s.theta_radps;
  y[4] = s.motor_v;
  y[5] = s.bristle_m;
  y[6] = s.attached_m;
  y[7] = s.attached_mps;
}

void require(int flag, const char* what) {
  if (flag < 0)
    throw Error(ExitCode::usage, std::string("the reference engine (CVODE) failed in ") + what +
                                     " with code " + std::to_string(flag) +
                                     ": use the fast engine for this plant");
}

void ignore_message(int, const char*, const char*, char*, void*) {}

template <class T, void (*Free)(T)>
struct ScopedHandle {
  T at = nullptr;
  ~ScopedHandle() {
    if (at != nullptr) Free(at);
  }
};

void free_vector(N_Vector v) {
  N_VDestroy(v);
}
void free_matrix(SUNMatrix a) {
  SUNMatDestroy(a);
}
void free_linear(SUNLinearSolver s) {
  SUNLinSolFree(s);
}
void free_nonlinear(SUNNonlinearSolver s) {
  SUNNonlinSolFree(s);
}
void free_cvode(void* memory) {
  CVodeFree(&memory);
}
void free_context(SUNContext context) {
  SUNContext_Free(&context);
}

}  // namespace

class CvodeEngine::Work {
 public:
  Work(const PlantModel<double>& model, const EngineOptions& options)
      : dynamics_(model), corners_(model), options_(options) {
    require(SUNContext_Create(nullptr, &context_.at), "set-up");
    y_.at = N_VNew_Serial(state_size, context_.at);
    derivative_.at = N_VNew_Serial(state_size, context_.at);
    tolerance_.at = N_VNew_Serial(state_size, context_.at);
    if (y_.at == nullptr || derivative_.at == nullptr || tolerance_.at == nullptr) require(-1, "set-up");
    lag_ = dynamics_.has_motor_lag();
    const bool stiff = is_stiff();
    cvode_.at = CVodeCreate(stiff ? CV_BDF : CV_ADAMS, context_.at);
    if (cvode_.at == nullptr) require(-1, "set-up");
    N_VConst(0.0, y_.at);
    require(CVodeInit(cvode_.at, &Work::rate, 0.0, y_.at), "set-up");
    N_VConst(1e-2 * options_.relative_tolerance, tolerance_.at);
    require(CVodeSVtolerances(cvode_.at, options_.relative_tolerance, tolerance_.at), "set-up");
    require(CVodeSetUserData(cvode_.at, this), "set-up");
    require(CVodeSetErrHandlerFn(cvode_.at, &ignore_message, nullptr), "set-up");
    if (stiff) {
      matrix_.at = SUNDenseMatrix(state_size, state_size, context_.at);
      linear_.at = SUNLinSol_Dense(y_.at, matrix_.at, context_.at);
      require(CVodeSetLinearSolver(cvode_.at, linear_.at, matrix_.at), "set-up");
    } else {
      nonlinear_.at = SUNNonlinSol_FixedPoint(y_.at, 0, context_.at);
      require(CVodeSetNonlinearSolver(cvode_.at, nonlinear_.at), "set-up");
    }
  }

  void start(const PlantState<double>& state, double time_s, double voltage_v) {
    state_ = state;
    time_s_ = time_s;
    halted_.reset();
    event_count_ = 0;
    step_count_ = 0;
    budget_.restart(time_s);
    if (dynamics_.cart_locked()) state_.cart_mps = 0.0;
    dynamics_.set_time(time_s);
    if (!dynamics_.has_motor_lag()) state_.motor_v = dynamics_.actuate(voltage_v);
    contacts_ = contacts_of(state_);
    settle();
  }

  void advance(double duration_s, const Volts* volts, double voltage_v, double max_step_s, const Sink* sink) {
    volts_ = volts;
    held_v_ = dynamics_.actuate(voltage_v);
    lag_ = dynamics_.has_motor_lag() && (volts == nullptr || dynamics_.motor_time_constant_s() > min_lag_s);
    set_motor_state();
    settle();
    halt_where_ended();
    const double end_s = time_s_ + duration_s;
    while (!halted_ && end_s - time_s_ > smallest_step_s * (1.0 + std::abs(end_s)))
      until_event(end_s, max_step_s, sink);
    if (!halted_) time_s_ = end_s;
  }

  const Dynamics<double>& dynamics() const { return dynamics_; }
  const PlantState<double>& state() const { return state_; }
  Contacts contacts() const { return contacts_; }
  double time_s() const { return time_s_; }
  std::optional<EventKind> halted() const { return halted_; }
  std::uint64_t event_count() const { return event_count_; }
  std::uint64_t step_count() const { return step_count_; }
  const Event& event(std::uint64_t index) const { return events_[index % kept_events]; }

 private:
  bool is_stiff() const {
    PlantState<double> moving{};
    moving.cart_mps = 0.5;
    double fastest = dynamics_.fastest_rate_radps(moving);
    if (lag_) fastest += 1.0 / dynamics_.motor_time_constant_s();
    return fastest > stiff_rate_radps;
  }

  double drive(double t, const PlantState<double>& s) const {
    return volts_ == nullptr ? held_v_ : dynamics_.actuate((*volts_)(t, s));
  }

  /// Without a lag the voltage at the motor is the drive.
  PlantState<double> with_motor(double t, PlantState<double> s) const {
    if (!lag_) s.motor_v = drive(t, s);
    return s;
  }

  void set_motor_state() { state_ = with_motor(time_s_, state_); }
  void settle() { contacts_ = settled_contacts(dynamics_, state_, contacts_); }

  void note(EventKind kind) {
    events_[event_count_++ % kept_events] = {time_s_, kind};
    budget_.count();
  }

  void halt_where_ended() {
    const auto end = ended_at(state_.theta_rad, state_.cart_m, dynamics_.has_pendulum(), options_);
    if (!end || halted_) return;
    halted_ = end;
    note(*end);
  }

  double indicator(const Watch& watch, double t, const PlantState<double>& s) {
    dynamics_.set_time(t);
    if (watch.kind == EventKind::actuator_corner) return watch.sign * ((*volts_)(t, s) - watch.corner_v);
    return event_indicator(dynamics_, with_motor(t, s), contacts_, watch, options_);
  }

  static int rate(double t, N_Vector y, N_Vector ydot, void* self) {
    Work& work = *static_cast<Work*>(self);
    work.dynamics_.set_time(t);
    const PlantState<double> s = unpack(N_VGetArrayPointer(y));
    const double drive = work.drive(t, s);
    PlantState<double> result = work.dynamics_.derivative(s, work.lag_ ? s.motor_v : drive, work.contacts_);
    result.motor_v = work.lag_ ? (drive - s.motor_v) / work.dynamics_.motor_time_constant_s() : 0.0;
    pack(result, N_VGetArrayPointer(ydot));
    for (sunindextype i = 0; i < state_size; ++i)
      if (!std::isfinite(N_VGetArrayPointer(ydot)[i])) return 1;
    return 0;
  }

  static int roots(double t, N_Vector y, double* g, void* self) {
    Work& work = *static_cast<Work*>(self);
    const PlantState<double> s = unpack(N_VGetArrayPointer(y));
    for (std::size_t i = 0; i < work.watches_.count; ++i) g[i] = work.indicator(work.watches_.items[i], t, s);
    return 0;
  }

  void restart(double end_s, double max_step_s) {
    pack(state_, N_VGetArrayPointer(y_.at));
    require(CVodeReInit(cvode_.at, time_s_, y_.at), "restart");
    require(CVodeSetStopTime(cvode_.at, end_s), "restart");
    require(CVodeSetMaxStep(cvode_.at, std::isfinite(max_step_s) ? max_step_s : 0.0), "restart");
    const int count = static_cast<int>(watches_.count);
    require(CVodeRootInit(cvode_.at, count, count > 0 ? &Work::roots : nullptr), "restart");
    if (count == 0) return;
    std::array<int, 6> rising;
    rising.fill(1);
    require(CVodeSetRootDirection(cvode_.at, rising.data()), "restart");
    require(CVodeSetNoInactiveRootWarn(cvode_.at), "restart");
  }

  /// One smooth stretch: from a restart to the next event or the end.
  void until_event(double end_s, double max_step_s, const Sink* sink) {
    const bool held = budget_.spent(time_s_);
    const double stretch_end_s = held ? std::min(end_s, time_s_ + held_stretch_s) : end_s;
    watches_ = next_events(dynamics_, state_.cart_mps, state_.theta_radps, contacts_, options_, held);
    if (volts_ != nullptr) corners_.watch((*volts_)(time_s_, state_), watches_);
    restart(stretch_end_s, max_step_s);
    while (true) {
      ++step_count_;
      const double from_s = time_s_;
      double to_s = from_s;
      const double toward_s = std::min(stretch_end_s, from_s + max_step_s);
      const int flag = CVode(cvode_.at, toward_s, y_.at, &to_s, CV_ONE_STEP);
      if (flag == CV_TOO_CLOSE) {
        time_s_ = stretch_end_s;
        return;
      }
      require(flag, "a step");
      const std::optional<Watch> event = flag == CV_ROOT_RETURN ? reported_root() : missed_root(from_s, to_s);
      if (sink != nullptr && to_s > from_s) {
        DenseStep dense = dense_step(from_s, to_s);
        mark_end(dense, event ? &*event : nullptr);
        (*sink)(dense);
      }
      state_ = unpack(N_VGetArrayPointer(y_.at));
      time_s_ = to_s;
      dynamics_.set_time(time_s_);
      set_motor_state();
      if (event) {
        enter(*event, held);
        return;
      }
      if (flag == CV_TSTOP_RETURN || to_s >= stretch_end_s) return;
    }
  }

  std::optional<Watch> reported_root() const {
    std::array<int, 6> info{};
    require(CVodeGetRootInfo(cvode_.at, info.data()), "root finding");
    for (std::size_t i = 0; i < watches_.count; ++i)
      if (info[i] != 0) return watches_.items[i];
    return std::nullopt;
  }

  PlantState<double> inside(double t) {
    require(CVodeGetDky(cvode_.at, t, 0, derivative_.at), "interpolation");
    return unpack(N_VGetArrayPointer(derivative_.at));
  }

  /// CVODE does not see a root that begins at a zero and is left and reached again within its first step: a
  /// micro-slip. Looks for one with the step's own polynomial and moves its end there.
  std::optional<Watch> missed_root(double from_s, double& to_s) {
    std::optional<Watch> first;
    const double end_s = to_s;
    for (std::size_t i = 0; i < watches_.count; ++i) {
      const Watch& watch = watches_.items[i];
      const double at_end = indicator(watch, end_s, unpack(N_VGetArrayPointer(y_.at)));
      if (!(at_end > 0.0)) continue;
      const double after =
          turning_positive([&](double t) { return indicator(watch, from_s + t, inside(from_s + t)); },
                           indicator(watch, from_s, inside(from_s)), at_end, end_s - from_s);
      if (watch.kind == EventKind::actuator_corner && after < smallest_step_s) continue;
      if (!first || from_s + after < to_s) {
        first = watch;
        to_s = from_s + after;
      }
    }
    if (first) pack(inside(to_s), N_VGetArrayPointer(y_.at));
    return first;
  }

  void enter(const Watch& watch, bool held) {
    const EventKind kind = watch.kind;
    if (kind == EventKind::actuator_corner) return;
    if (kind == EventKind::cart_reversal || kind == EventKind::cart_stick) state_.cart_mps = 0.0;
    if (kind == EventKind::pivot_reversal || kind == EventKind::pivot_stick) state_.theta_radps = 0.0;
    set_motor_state();
    contacts_ = contacts_after(dynamics_, state_, contacts_, kind, held);
    if (kind == EventKind::fall || kind == EventKind::track_end) halted_ = kind;
    note(resolved_kind(kind, contacts_));
  }

  /// CVODE's own polynomial of its last step.
  DenseStep dense_step(double from_s, double to_s) {
    DenseStep dense;
    dense.begin_s = from_s;
    dense.end_s = to_s;
    require(CVodeGetCurrentTime(cvode_.at, &dense.at_s), "interpolation");
    int order = 0;
    require(CVodeGetLastOrder(cvode_.at, &order), "interpolation");
    dense.factors = std::min(order + 1, DenseStep::max_factors);
    double factorial = 1.0;
    for (int k = 0; k < dense.factors; ++k) {
      if (k > 0) factorial *= k;
      require(CVodeGetDky(cvode_.at, dense.at_s, k, derivative_.at), "interpolation");
      N_VScale(1.0 / factorial, derivative_.at, derivative_.at);
      dense.factor[static_cast<std::size_t>(k)] = unpack(N_VGetArrayPointer(derivative_.at));
    }
    return dense;
  }

  static constexpr double held_stretch_s = 1e-4;

  Dynamics<double> dynamics_;
  ActuatorCorners<double> corners_;
  EngineOptions options_;
  ScopedHandle<SUNContext, &free_context> context_;
  ScopedHandle<N_Vector, &free_vector> y_, derivative_, tolerance_;
  ScopedHandle<SUNMatrix, &free_matrix> matrix_;
  ScopedHandle<SUNLinearSolver, &free_linear> linear_;
  ScopedHandle<SUNNonlinearSolver, &free_nonlinear> nonlinear_;
  ScopedHandle<void*, &free_cvode> cvode_;
  WatchList watches_;
  const Volts* volts_ = nullptr;
  double held_v_ = 0.0;
  bool lag_ = false;
  PlantState<double> state_{};
  Contacts contacts_;
  double time_s_ = 0.0;
  std::optional<EventKind> halted_;
  EventBudget budget_;
  std::uint64_t event_count_ = 0;
  std::uint64_t step_count_ = 0;
  std::array<Event, kept_events> events_{};
};

CvodeEngine::CvodeEngine(const PlantModel<double>& model, const EngineOptions& options)
    : work_(std::make_unique<Work>(model, options)) {}
CvodeEngine::CvodeEngine(CvodeEngine&&) noexcept = default;
CvodeEngine& CvodeEngine::operator=(CvodeEngine&&) noexcept = default;
CvodeEngine::~CvodeEngine() = default;

const Dynamics<double>& CvodeEngine::dynamics() const {
  return work_->dynamics();
}

void CvodeEngine::start(const PlantState<double>& state, double time_s, double voltage_v) {
  work_->start(state, time_s, voltage_v);
}

void CvodeEngine::advance(double duration_s, double voltage_v) {
  work_->advance(duration_s, nullptr, voltage_v, std::numeric_limits<double>::infinity(), nullptr);
}

void CvodeEngine::advance(double duration_s, const Volts& volts, double max_step_s, const Sink& sink) {
  work_->advance(duration_s, &volts, 0.0, max_step_s, &sink);
}

const PlantState<double>& CvodeEngine::state() const {
  return work_->state();
}
Contacts CvodeEngine::contacts() const {
  return work_->contacts();
}
double CvodeEngine::time_s() const {
  return work_->time_s();
}
std::optional<EventKind> CvodeEngine::halted() const {
  return work_->halted();
}
std::uint64_t CvodeEngine::event_count() const {
  return work_->event_count();
}
std::uint64_t CvodeEngine::step_count() const {
  return work_->step_count();
}
const Event& CvodeEngine::event(std::uint64_t index) const {
  return work_->event(index);
}

}  // namespace upright
