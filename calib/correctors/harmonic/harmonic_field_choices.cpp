#include "calib/correctors/harmonic/harmonic_field_choices.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace fieldtrue::correctors {

void HarmonicChoices::add(std::vector<Eigen::Vector3d> places_m, double misfit_m2) {
  std::sort(places_m.begin(), places_m.end(), [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  });
  choices_.push_back({std::move(places_m), misfit_m2});
}

/// Whether the choice has come round to one made before and is, of those in between, the one that leaves least: each
/// change of the field would go on making the next one the likelier.
bool HarmonicChoices::goesRound() const {
  constexpr double kAsGood = 1.0 + 1e-4;  // Of one choice at two rounds.
  if (choices_.empty()) return false;
  const Choice& now = choices_.back();
  const auto earlier_end = choices_.end() - 1;
  const auto same = [&](const Choice& other) { return other.places_m == now.places_m; };
  const auto before = std::find_if(choices_.begin(), earlier_end, same);
  const bool was_left = !std::all_of(before, earlier_end, same);
  return was_left && std::all_of(before, earlier_end,
                                 [&](const Choice& other) { return now.misfit_m2 <= kAsGood * other.misfit_m2; });
}

/// Whether the last choices leave as much as those before, and the present one of them about the least: it goes on
/// changing, and to no good.
bool HarmonicChoices::wanders() const {
  constexpr std::ptrdiff_t kLast = 6;
  constexpr double kAlike = 0.03;  // Of the squares.
  if (std::ssize(choices_) <= kLast) return false;
  const auto leaves_less = [](const Choice& a, const Choice& b) { return a.misfit_m2 < b.misfit_m2; };
  const auto last = choices_.end() - kLast;
  const double now_m2 = choices_.back().misfit_m2;
  return now_m2 <= (1.0 + kAlike) * std::min_element(last, choices_.end(), leaves_less)->misfit_m2 &&
         now_m2 >= (1.0 - kAlike) * std::min_element(choices_.begin(), last, leaves_less)->misfit_m2;
}

}  // namespace fieldtrue::correctors
