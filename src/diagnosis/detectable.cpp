#include "detectable.hpp"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <limits>
#include <sstream>

namespace upright {

namespace {

/// Of the usual size of friction: so little that the simulated motion stays the same.
constexpr double small_share = 1e-3;

/// The standard error of the size of an effect once it is left open: infinite where the data say nothing of
/// it, 0 where it is held at the end of its range.
double standard_error(const Hypothesis& fit, std::size_t effect) {
  for (std::size_t j = 0; j < fit.free.size(); ++j) {
    if (fit.free[j].effect != effect || fit.free[j].index != 0) continue;
    const auto at = static_cast<Eigen::Index>(j);
    if (!(fit.train.information(at, at) > 0.0)) return std::numeric_limits<double>::infinity();
    return std::sqrt(std::max(fit.train.covariance(at, at), 0.0));
  }
  return 0.0;
}

/// The size that an effect has on such a rig.
double usual_size(std::size_t effect, const Search& search) {
  return free_parameters(effect, search.range(), search.policy().prior).front().scale;
}

}  // namespace

double standard_errors_to_be_shown(std::size_t effect, bool is_correction, const SelectionPolicy& policy) {
  // One that is so much larger is shown with a probability of one minus the level.
  const double margin = quantile(boost::math::normal(), 1.0 - policy.significance.level);
  if (is_correction) return policy.significance.certain_z + margin;
  const AcceptancePolicy& p = policy.acceptance;
  const auto more = static_cast<double>(effect_registry()[effect].parameters.size() - 1);
  // The evidence of an effect is the square of its size in standard errors.
  return std::max(policy.significance.certain_z, std::sqrt(p.min_evidence + p.parameter_penalty * more)) +
         margin;
}

std::vector<Detectable> detectable_sizes(const Search& search, const Hypothesis& h,
                                         const std::vector<FreedEffect>& freed) {
  std::vector<Detectable> sizes;
  for (const auto& [effect, fit] : freed) {
    double sigma = standard_error(fit, effect);
    // A contact without a level is no contact, so nothing depends on the level there: open a small one.
    if (std::isinf(sigma) && effect_registry()[effect].dry)
      sigma = standard_error(search.with_effect_free(h, effect, small_share), effect);
    if (!(sigma > 0.0)) continue;
    const EffectInfo& info = effect_registry()[effect];
    Detectable d;
    d.effect = effect;
    d.size = sigma * standard_errors_to_be_shown(effect, search.is_nuisance(effect), search.policy());
    d.usual = usual_size(effect, search);
    const PlantEffect* at = fit.train.point.plant.find(effect);
    for (std::size_t i = 1; i < info.parameters.size(); ++i) d.at.push_back(at->values[i]);
    sizes.push_back(d);
  }
  return sizes;
}

std::vector<Detectable> may_hide(const std::vector<Detectable>& detectable, const Plant& given,
                                 const PowerPolicy& policy) {
  std::vector<Detectable> hidden;
  for (const Detectable& d : detectable) {
    const bool everywhere = std::find(policy.everywhere.begin(), policy.everywhere.end(),
                                      effect_registry()[d.effect].kind) != policy.everywhere.end();
    if (everywhere && given.find(d.effect) == nullptr && d.size > d.usual) hidden.push_back(d);
  }
  return hidden;
}

std::string sentence_on_hidden(const std::vector<Detectable>& hidden) {
  std::ostringstream text;
  text.precision(2);
  for (const Detectable& d : hidden)
    text << (text.str().empty() ? "" : "; ") << kind_of(d.effect)
         << " could hide: these data would show it above " << d.size << " "
         << effect_registry()[d.effect].parameters[0].unit << ", and " << d.usual << " is usual";
  return text.str();
}

}  // namespace upright
