// A piece of an experiment, and what its kind says of itself: its keys in the file, what is planned, the runs
// it takes, and its signal in the script. One file per kind in pieces/, one line in pieces/all.hpp; files,
// plans, scripts, trials and error messages follow from there.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "piece_keys.hpp"
#include "script_context.hpp"
#include "trial.hpp"
#include "upright/base/yaml_reader.hpp"
#include "upright/hal/simulated_rig.hpp"

namespace upright {

/// How long a run of a piece takes, and the key that makes it long.
struct PieceTime {
  double duration_s = 0.0;
  const char* key = "duration_s";
};

/// What is wrong with a piece, at which key.
struct Refusal {
  const char* key = "kind";
  std::string problem;  ///< goes on from "the piece LABEL"
  std::string remedy;
};

/// One stretch of a piece: where it starts, then its excitation.
struct Stretch {
  double start_m = 0.0;
  double voltage_v = 0.0;  ///< signed
  double duration_s = 0.0;
};

/// What a piece sees while one of its stretches is excited.
struct Excitation {
  const Stretch& stretch;
  const ScriptContext& context;
  const ControlState& now;
  double acted_s;    ///< since it began
  double elapsed_s;  ///< since the last period
  double moved_m;    ///< from where it began
  CartServo& servo;
};

enum class StretchStatus { goes_on, done, lost };

/// How a stretch begins.
enum class Opening {
  settling,  ///< the cart is driven to the start, and both come to rest
  waiting,   ///< for somebody's hands, or for rest
  at_once,
};

/// A kind of piece, with the values that one piece has. The script has a copy of its own, in which a kind may
/// remember what happens while it runs.
class PieceKind {
 public:
  virtual ~PieceKind() = default;
  virtual std::unique_ptr<PieceKind> clone() const = 0;
  virtual const char* name() const noexcept = 0;

  // The file.
  virtual void keys(PieceKeys& keys) = 0;
  /// Whether `fit_to_travel` may lower its voltages.
  virtual bool may_fit() const { return false; }
  /// The key that needs somebody's hands beside the rig; null: none.
  virtual const char* key_for_hands() const { return nullptr; }
  /// Throws ConfigError at the key of `map` that goes beyond the travel.
  virtual void refuse_beyond(double /*travel_m*/, const YamlMap& /*map*/) const {}
  /// What a run takes at least, or where the plant decides, at most; the ways between its stretches not
  /// counted.
  virtual PieceTime time() const { return {}; }
  /// How many runs it takes at most, bisected ones not counted.
  virtual double runs() const { return 1.0; }

  // The plan.
  virtual bool needs_pendulum() const { return false; }
  /// Why the plant cannot do it, where no rehearsal is needed to see it.
  virtual std::optional<Refusal> unreachable(const ScriptContext& /*context*/) const { return std::nullopt; }
  /// What the operator does before it, on a simulated rig.
  virtual void place(Hand& /*hand*/) const {}
  /// What whoever stands beside the rig is told to do; empty: nothing.
  virtual const char* request() const { return ""; }

  // Its trials. `done`: of the whole experiment, in which this is piece `index`.
  virtual std::optional<ExperimentTrial> next_trial(std::size_t index,
                                                    const std::vector<TrialResult>& done) const;
  /// The trials whose rehearsals stand for all of them.
  virtual std::vector<ExperimentTrial> rehearsals() const;
  /// Becomes what one trial runs.
  virtual void set_trial(const ExperimentTrial& /*trial*/) {}
  /// What tells the runs of its trials from each other, after the label: in names of folders, and in words.
  virtual std::string suffix(const ExperimentTrial& /*trial*/) const { return ""; }
  virtual std::string words(const ExperimentTrial& /*trial*/) const { return ""; }
  /// Whether a run with this outcome need not be made again.
  virtual bool is_result(const std::string& /*outcome*/) const { return true; }

  // Balancing.
  virtual bool balances() const { return false; }
  virtual bool swings_up() const { return false; }
  virtual double delay_s() const { return 0.0; }
  /// Set-point of the cart at a time since the feedback took over.
  virtual double reference_m(double /*acted_s*/) const noexcept { return 0.0; }
  /// The outcome of a run that balanced. `whole`: it came to its end. Empty: it is no result.
  virtual const char* outcome_of(bool /*fell*/, bool whole, double /*theta_amplitude_rad*/) const {
    return whole ? "done" : "";
  }
  /// Controllers that take turns; empty: the experiment's one.
  virtual std::span<const NamedGains> controllers() const { return {}; }

  // The script. What follows runs in the loop: it allocates and throws nothing.
  virtual std::vector<Stretch> stretches(const ScriptContext& context) const = 0;
  /// Whether voltages drive the cart: then it is kept on its travel, braked, and brought back to the middle.
  virtual bool is_driven() const noexcept { return true; }
  /// Whether a stretch that the guard ended goes on, for its length is given.
  virtual bool resumes() const noexcept { return false; }
  virtual Opening opening() const noexcept { return Opening::settling; }
  /// The longest wait for the operator.
  virtual double patience_s() const noexcept { return 0.0; }
  /// What a waiting piece waits for; the cart is at rest.
  virtual bool is_ready(const ControlState& now, const ScriptContext& context) const noexcept {
    return hangs_still(context, now);
  }
  virtual StretchStatus status(const Excitation& at) noexcept {
    return at.acted_s >= at.stretch.duration_s ? StretchStatus::done : StretchStatus::goes_on;
  }
  virtual double voltage_v(const Excitation& /*at*/) noexcept { return 0.0; }
  /// A stretch is over, the one of number `done` - 1. True: no other is needed.
  virtual bool has_enough(std::size_t /*done*/) noexcept { return false; }
};

/// Copying and the name, for a class that has the name as `kind`.
template <class Kind, class Base = PieceKind>
class PieceOf : public Base {
 public:
  std::unique_ptr<PieceKind> clone() const override {
    return std::make_unique<Kind>(static_cast<const Kind&>(*this));
  }
  const char* name() const noexcept override { return Kind::kind; }
};

/// A kind that is copied with what holds it.
class PieceKindValue {
 public:
  PieceKindValue() = default;
  explicit PieceKindValue(std::unique_ptr<PieceKind> kind) : kind_(std::move(kind)) {}
  PieceKindValue(const PieceKind& kind) : kind_(kind.clone()) {}  // NOLINT(google-explicit-constructor)
  PieceKindValue(const PieceKindValue& other) : kind_(other.kind_ ? other.kind_->clone() : nullptr) {}
  PieceKindValue(PieceKindValue&&) noexcept = default;
  PieceKindValue& operator=(PieceKindValue other) noexcept {
    kind_ = std::move(other.kind_);
    return *this;
  }
  ~PieceKindValue() = default;
  const PieceKind& operator*() const noexcept { return *kind_; }
  PieceKind& operator*() noexcept { return *kind_; }
  const PieceKind* operator->() const noexcept { return kind_.get(); }
  PieceKind* operator->() noexcept { return kind_.get(); }

 private:
  std::unique_ptr<PieceKind> kind_;
};

/// One piece; docs/reference/experiment-files.md has the table of what each kind takes.
struct Piece {
  PieceKindValue kind{};
  std::string label{};
  std::string operator_does{};      ///< what somebody must do that no sensor sees; empty: nothing
  bool fit_to_travel = false;       ///< lower the voltage until the prediction stays within the travel
  bool turned = false;              ///< the rig stands the other way round
  std::optional<YamlMap> source{};  ///< where it was read: for what only the plan can refuse

  /// The values of a piece of this kind; null: it is of another.
  template <class Kind>
  const Kind* as() const {
    return dynamic_cast<const Kind*>(&*kind);
  }
};

/// True for the pieces that balance.
bool balances(const Piece& piece) noexcept;

/// True where controllers take turns.
bool compares(const Piece& piece) noexcept;

/// Visits the keys of a piece, for the reader and the schema.
void piece_keys(PieceKeys& keys, Piece& piece);
Piece read_piece(const YamlMap& map);
/// The piece as a YAML flow map that `read_piece` reads back exactly.
std::string piece_text(const Piece& piece);

/// Every kind's name, in the order of registration.
const std::vector<std::string>& piece_kinds();

}  // namespace upright
