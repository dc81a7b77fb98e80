#include "calib/calibration/outlying_places.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "calib/core/chi_square.h"
#include "calib/core/number_text.h"
#include "calib/core/place_name.h"
#include "calib/core/statistics.h"
#include "calib/core/units.h"

namespace fieldtrue::calibration {
namespace {

constexpr double kFreedom = 4.0;
constexpr double kFarOff = 30.0;          // Of chi-square of three degrees of freedom one in a million is farther.
constexpr double kFarOffOfFew = 60.0;     // Places of real boards of 41 reach 45 by the unevenness of the field there,
constexpr std::size_t kFew = 100;         // which so few rows do not show to be a field.
constexpr double kAsStated = 2.0;         // Of the stated variance: readings are noisy too.
constexpr double kFarOffInField = 300.0;  // A field that changes within the pitch takes a place so far from the others.
constexpr double kLeast_m = 1e-5;         // Nobody sets down a jig more exactly.
constexpr std::size_t kAbout = 8;
constexpr double kOfMiddle = 0.2;      // Variance of the middle of so many, of one's.
constexpr double kUneven = 3.0;        // So many scatter by so much more than all do in one case of five hundred.
constexpr std::size_t kMostPart = 10;  // One row in so many may stand apart.

/// The middle of vectors, and the variance an axis that half of them show about it.
struct Middle {
  Eigen::Vector3d at_m = Eigen::Vector3d::Zero();
  double variance_m2 = 0.0;
};

double varianceAbout(const Eigen::Vector3d& at_m, const std::vector<Eigen::Vector3d>& off_m) {
  std::vector<double> squares_m2;
  for (const Eigen::Vector3d& one_m : off_m) squares_m2.push_back((one_m - at_m).squaredNorm());
  return median(std::move(squares_m2)) / kMedianOfChiSquare3;
}

Middle middleOf(const std::vector<Eigen::Vector3d>& off_m) {
  Middle middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along_m;
    for (const Eigen::Vector3d& one_m : off_m) along_m.push_back(one_m[axis]);
    middle.at_m[axis] = median(std::move(along_m));
  }
  middle.variance_m2 = varianceAbout(middle.at_m, off_m);
  return middle;
}

/// Variance an axis that half of the rows show.
double coreOf_m2(const std::vector<Eigen::Vector3d>& off_m) {
  return std::max(kLeast_m * kLeast_m, varianceAbout(Eigen::Vector3d::Zero(), off_m));
}

/// What rows are off by, and which stand about a row.
class OffByPlace {
 public:
  OffByPlace(std::span<const Node> nodes, std::vector<Eigen::Vector3d> off_m)
      : nodes_(nodes), off_m_(std::move(off_m)) {
    for (std::size_t row = 0; row < nodes.size(); ++row) along_x_.emplace_back(place_m(row).x(), row);
    std::sort(along_x_.begin(), along_x_.end());
  }

  const std::vector<Eigen::Vector3d>& all_m() const { return off_m_; }

  /// Of the nearest rows of other places, found outwards along one axis.
  std::vector<Eigen::Vector3d> about(std::size_t row) const {
    using Neighbour = std::pair<double, std::size_t>;
    std::vector<Neighbour> nearest;  // A heap, the farthest first.
    const auto isWorthATry = [&](double away_x_m) {
      return nearest.size() < kAbout || away_x_m * away_x_m <= nearest.front().first;
    };
    const auto take = [&](std::size_t other) {
      if (nodes_[other].node == nodes_[row].node) return;
      const Neighbour one{(place_m(other) - place_m(row)).squaredNorm(), other};
      if (nearest.size() == kAbout) {
        if (!(one < nearest.front())) return;
        std::pop_heap(nearest.begin(), nearest.end());
        nearest.pop_back();
      }
      nearest.push_back(one);
      std::push_heap(nearest.begin(), nearest.end());
    };
    const double x_m = place_m(row).x();
    const auto here = std::lower_bound(along_x_.begin(), along_x_.end(), std::pair{x_m, row});
    auto below = std::make_reverse_iterator(here);
    auto above = here;
    while (below != along_x_.rend() || above != along_x_.end()) {
      const bool goes_up =
          below == along_x_.rend() || (above != along_x_.end() && above->first - x_m < x_m - below->first);
      if (!isWorthATry(goes_up ? above->first - x_m : x_m - below->first)) break;
      take(goes_up ? (above++)->second : (below++)->second);
    }
    std::vector<Eigen::Vector3d> about_m;
    for (const Neighbour& one : nearest) about_m.push_back(off_m_[one.second]);
    return about_m;
  }

 private:
  const Eigen::Vector3d& place_m(std::size_t row) const { return nodes_[row].reference_from_sensor.position_m; }

  std::span<const Node> nodes_;
  std::vector<Eigen::Vector3d> off_m_;
  std::vector<std::pair<double, std::size_t>> along_x_;
};

/// Of a square in units of the variance; no row counts more than by least squares.
double tWeight(double square) { return std::min(1.0, (kFreedom + 3.0) / (kFreedom + square)); }

/// Square from which on a row of so many lies far off, in units of the variance.
double farOff(std::size_t n_rows, double core_m2, std::optional<double> jig_tolerance_m) {
  const bool is_as_stated = jig_tolerance_m && core_m2 <= kAsStated * *jig_tolerance_m * *jig_tolerance_m;
  return n_rows < kFew && !is_as_stated ? kFarOffOfFew : kFarOff;
}

/// Whether the other rows are off as those about them are, by more than three SDs of the sum of these products where
/// each is off by itself. Of many rows an even choice is asked.
bool areOffTogether(const OffByPlace& off, const std::vector<OutlyingRow>& outlying) {
  const std::vector<Eigen::Vector3d>& off_m = off.all_m();
  constexpr std::size_t kAsked = 100;
  constexpr double kClearly = 3.0;
  std::vector<std::size_t> others;
  for (std::size_t row = 0; row < off_m.size(); ++row)
    if (std::ranges::none_of(outlying, [&](const OutlyingRow& one) { return one.row == row; })) others.push_back(row);
  const std::size_t step = std::max<std::size_t>(1, others.size() / kAsked);
  double sum_m2 = 0.0, squares_m4 = 0.0;
  for (std::size_t i = 0; i < others.size(); i += step) {
    const Eigen::Vector3d about_m = middleOf(off.about(others[i])).at_m;
    sum_m2 += off_m[others[i]].dot(about_m);
    squares_m4 += off_m[others[i]].squaredNorm() * about_m.squaredNorm() / 3.0;
  }
  return sum_m2 > kClearly * std::sqrt(squares_m4);
}

OffByPlace offByPlace(std::span<const Node> nodes, const Pose& reference_from_tracker) {
  std::vector<Eigen::Vector3d> off_m;
  for (const Node& node : nodes)
    off_m.push_back(node.reference_from_sensor.position_m -
                    reference_from_tracker * node.tracker_from_sensor.position_m);
  return {nodes, std::move(off_m)};
}

/// Rows that stand apart, the variance an axis that half of all show, and whether the others show a field.
struct Found {
  std::vector<OutlyingRow> rows;
  double core_m2 = 0.0;
  bool is_in_field = false;
};

Found findOutlying(const OffByPlace& off, std::optional<double> jig_tolerance_m) {
  const std::vector<Eigen::Vector3d>& off_m = off.all_m();
  if (off_m.empty()) return {};
  Found found;
  const double core_m2 = found.core_m2 = coreOf_m2(off_m);
  const double far_off = farOff(off_m.size(), core_m2, jig_tolerance_m);
  std::vector<std::size_t> far;
  for (std::size_t row = 0; row < off_m.size(); ++row)
    if (off_m[row].squaredNorm() > far_off * core_m2) far.push_back(row);
  if (far.size() * kMostPart > off_m.size()) return {};
  for (const std::size_t row : far) {
    const std::vector<Eigen::Vector3d> about_m = off.about(row);
    if (about_m.size() < kAbout) continue;
    const Middle middle = middleOf(about_m);
    if (middle.at_m.squaredNorm() > kFarOff * kOfMiddle * core_m2) found.is_in_field = true;
    const double variance_m2 = middle.variance_m2 > kUneven * core_m2 ? middle.variance_m2 : core_m2;
    const double square_m2 = (off_m[row] - middle.at_m).squaredNorm();
    if (square_m2 > far_off * variance_m2) found.rows.push_back({row, std::sqrt(square_m2), square_m2 / variance_m2});
  }
  if (found.rows.empty()) return {};
  found.is_in_field = found.is_in_field || areOffTogether(off, found.rows);
  if (found.is_in_field) std::erase_if(found.rows, [](const OutlyingRow& one) { return one.square < kFarOffInField; });
  return found;
}

}  // namespace

std::vector<OutlyingRow> outlyingRows(std::span<const Node> nodes, const Pose& reference_from_tracker,
                                      std::optional<double> jig_tolerance_m) {
  return findOutlying(offByPlace(nodes, reference_from_tracker), jig_tolerance_m).rows;
}

std::vector<double> alignmentWeights(std::span<const Node> nodes, const Pose& reference_from_tracker,
                                     std::optional<double> jig_tolerance_m) {
  const OffByPlace off = offByPlace(nodes, reference_from_tracker);
  const Found found = findOutlying(off, jig_tolerance_m);
  if (found.rows.empty()) return {};
  std::vector<double> weights(nodes.size(), 1.0);
  if (found.is_in_field) {
    for (const OutlyingRow& one : found.rows) weights[one.row] = tWeight(one.square);
    return weights;
  }
  std::ranges::transform(off.all_m(), weights.begin(),
                         [&](const Eigen::Vector3d& one_m) { return tWeight(one_m.squaredNorm() / found.core_m2); });
  return weights;
}

std::string outlyingNote(std::span<const Node> nodes, const Pose& reference_from_tracker,
                         std::optional<double> jig_tolerance_m, bool is_fitted) {
  std::vector<OutlyingRow> outlying = outlyingRows(nodes, reference_from_tracker, jig_tolerance_m);
  if (outlying.empty()) return {};
  std::stable_sort(outlying.begin(), outlying.end(),
                   [](const OutlyingRow& a, const OutlyingRow& b) { return a.off_m > b.off_m; });
  std::vector<int> places;
  for (const OutlyingRow& one : outlying)
    if (std::find(places.begin(), places.end(), nodes[one.row].node) == places.end())
      places.push_back(nodes[one.row].node);
  const std::string farthest = shortNumber(outlying.front().off_m / kMPerMm) + " mm";
  const bool is_one = places.size() == 1;
  const std::string counts = is_one ? "and counts little in the alignment" : "and count little in the alignment";
  return PlaceNames(nodes).listInOrder(places) + (is_one ? " lies " : " lie up to ") + farthest +
         " off what the places about " + (is_one ? "it" : "them") + " show" + (is_fitted ? ", " + counts : "") +
         ". Take " + (is_one ? "it" : "them") + " again: what reads so once more has metal close by.";
}

}  // namespace fieldtrue::calibration
