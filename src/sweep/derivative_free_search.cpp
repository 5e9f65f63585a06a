#include "derivative_free_search.hpp"

#include <algorithm>
#include <limits>
#include <nlopt.hpp>

namespace upright {

namespace {

using Place = std::vector<double>;

constexpr double first_step_share = 0.2;  ///< of the global bound, for the local search
constexpr double tolerance_share = 1e-3;  ///< of the same: nearer places are the same

class Search {
 public:
  Search(std::size_t numbers, const std::function<double(const Place&)>& cost)
      : cost_(cost), best_(numbers, 0.0) {}

  void run(nlopt::algorithm algorithm, double bound, double first_step, double tolerance, int evaluations) {
    if (evaluations < 1) return;
    nlopt::opt search(algorithm, static_cast<unsigned>(best_.size()));
    search.set_lower_bounds(-bound);
    search.set_upper_bounds(bound);
    search.set_initial_step(first_step);
    search.set_xtol_abs(tolerance);
    search.set_maxeval(evaluations);
    search.set_min_objective(
        [](const Place& place, Place&, void* self) { return static_cast<Search*>(self)->evaluate(place); },
        this);
    Place place = best_;
    double found = 0.0;
    try {
      search.optimize(place, found);
    } catch (const nlopt::roundoff_limited&) {  // the best so far is kept in any case
    }
  }

  const Place& best() const { return best_; }

 private:
  double evaluate(const Place& place) {
    const double cost = cost_(place);
    if (cost < smallest_) {
      smallest_ = cost;
      best_ = place;
    }
    return cost;
  }

  const std::function<double(const Place&)>& cost_;
  Place best_;
  double smallest_ = std::numeric_limits<double>::infinity();
};

}  // namespace

std::vector<double> minimise(std::size_t numbers, const SearchBounds& bounds, int evaluations, unsigned seed,
                             const std::function<double(const std::vector<double>&)>& cost) {
  nlopt::srand(seed);
  Search search(numbers, cost);
  const double step = first_step_share * bounds.global, tolerance = tolerance_share * bounds.global;
  const int global = evaluations * 2 / 3;
  search.run(nlopt::GN_CRS2_LM, bounds.global, step, tolerance, global);
  search.run(nlopt::LN_SBPLX, bounds.local, step, tolerance, evaluations - global);
  return search.best();
}

}  // namespace upright
