#include "calib/gap/source_shape.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "calib/gap/verdict.h"

namespace fieldtrue::gap {
namespace {

constexpr double kNinety = 1.645;
constexpr Eigen::Index kComponents = 6;

/// The way to fit a body of any shape.
const identify::EffectWay* bodyOfAnyShape(const identify::GapSearch& search) {
  const auto ways = search.ways();
  const auto found = std::find_if(ways.begin(), ways.end(), [](const identify::EffectWay& way) {
    return way.fit->searchesPlace() && !way.needs_time &&
           static_cast<Eigen::Index>(way.fit->linear().size()) == kComponents;
  });
  return found == ways.end() ? nullptr : &*found;
}

/// Where things in the room stand that would fit alone, the likeliest first [m].
std::vector<Eigen::Vector3d> centersOf(const identify::GapSearch& search, const identify::EffectSelection& selection) {
  std::vector<Eigen::Vector3d> centers_m;
  for (const identify::TriedEffect& one : selection.first) {
    const bool is_sure = one.bic_gain > search.thresholds().sure_thing && one.is_refined;
    if (!is_sure || !search.ways()[one.way].fit->searchesPlace()) continue;
    centers_m.emplace_back(one.model.terms.back().searched.head<3>());
  }
  return centers_m;
}

std::optional<identify::RefinedModel> fittedBody(const identify::GapSearch& search, const identify::EffectWay& way,
                                                 const std::vector<Eigen::Vector3d>& centers_m) {
  constexpr std::size_t kMostStarts = 3;
  std::optional<identify::RefinedModel> best;
  for (std::size_t k = 0; k < std::min(kMostStarts, centers_m.size()); ++k) {
    if (!way.fit->allows(centers_m[k])) continue;
    identify::GapModel model = search.seenFrom(search.none().model);
    model.terms.push_back({way.effect, way.fit, centers_m[k], Eigen::VectorXd::Zero(kComponents)});
    identify::RefinedModel refined = search.refined(model);
    if (!best || refined.cost < best->cost) best = std::move(refined);
  }
  return best;
}

/// Whether it acts from the room and stands at no place in it, as an endless plane does.
bool isEndless(const identify::GapTerm& term) {
  return !term.fit->searchesPlace() && term.fit->describe(term.searched, term.linear).location_m.has_value();
}

/// The image of the transmitter in a plane is a dipole too, which answers along the plane's normal half as much as
/// across it: where a plane is named, or explains as much, the dipole tells nothing of a shape.
bool isImageInPlane(const identify::GapSearch& search, const identify::EffectSelection& selection,
                    const identify::RefinedModel& body) {
  const std::vector<identify::GapTerm>& named = selection.model.model.terms;
  if (std::any_of(named.begin(), named.end(), isEndless)) return true;
  const double worst_bic = search.bicOf(body.model) + search.thresholds().same_evidence;
  return std::any_of(selection.first.begin(), selection.first.end(), [&](const identify::TriedEffect& one) {
    return one.is_refined && isEndless(one.model.terms.back()) && search.bicOf(one.model) < worst_bic;
  });
}

double squaresOf(std::span<const identify::Vector6d> whitened) {
  double sum = 0.0;
  for (const identify::Vector6d& r : whitened) sum += r.squaredNorm();
  return sum;
}

/// Share of what the named causes take of the squares that the dipole takes; 1 where none is named.
double shareOfNamed(const identify::GapSearch& search, const identify::EffectSelection& selection,
                    const identify::RefinedModel& body) {
  if (selection.ways.empty()) return 1.0;
  const auto left = [&](const identify::GapModel& model) {
    return squaresOf(identify::whitenedResiduals(search.physics(), model, search.whitening()));
  };
  const double none = left(search.none().model);
  return (none - left(body.model)) / (none - left(selection.model.model));
}

/// @param components xx yy zz xy xz yz
Eigen::Matrix3d symmetric(const Eigen::VectorXd& components) {
  Eigen::Matrix3d matrix;
  matrix << components[0], components[3], components[4], components[3], components[1], components[5], components[4],
      components[5], components[2];
  return matrix;
}

/// Derivative of the eigenvalue of a unit eigenvector by the components.
Eigen::Matrix<double, kComponents, 1> slopeOf(const Eigen::Vector3d& v) {
  Eigen::Matrix<double, kComponents, 1> slope;
  slope << v.x() * v.x(), v.y() * v.y(), v.z() * v.z(), 2.0 * v.x() * v.y(), 2.0 * v.x() * v.z(), 2.0 * v.y() * v.z();
  return slope;
}

std::string directionText(const Eigen::Vector3d& v) {
  return "(" + shown(v.x()) + ", " + shown(v.y()) + ", " + shown(v.z()) + ")";
}

}  // namespace

Shape shapeOf(const Eigen::Vector3d& values_m3, const Eigen::Vector3d& sds_m3, double silent_axis) {
  const double bound_m3 = silent_axis * std::abs(values_m3[0]);
  if (std::abs(values_m3[0]) < 3.0 * kNinety * sds_m3[0]) return Shape::kUnclear;
  const auto is_silent = [&](int k) { return std::abs(values_m3[k]) + kNinety * sds_m3[k] < bound_m3; };
  const auto answers = [&](int k) { return std::abs(values_m3[k]) - kNinety * sds_m3[k] > bound_m3; };
  const bool is_iron = values_m3[0] > 0.0;
  if (is_silent(1) && is_silent(2)) return is_iron ? Shape::kIronBar : Shape::kFlatOrLoop;
  if (answers(1) && values_m3[0] * values_m3[1] > 0.0) {
    if (is_silent(2)) return is_iron ? Shape::kIronSheet : Shape::kLongConductor;
    if (answers(2) && values_m3[0] * values_m3[2] > 0.0) return Shape::kBody;
  }
  return Shape::kUnclear;
}

std::optional<SourceShape> sourceShapeOf(const identify::GapSearch& search,
                                         const identify::EffectSelection& selection) {
  const identify::EffectWay* way = bodyOfAnyShape(search);
  const std::vector<Eigen::Vector3d> centers_m = centersOf(search, selection);
  if (way == nullptr || centers_m.empty()) return std::nullopt;
  const std::optional<identify::RefinedModel> body = fittedBody(search, *way, centers_m);
  if (!body || body->covariance.size() == 0 || isImageInPlane(search, selection, *body)) return std::nullopt;
  if (shareOfNamed(search, selection, *body) < search.thresholds().least_share) return std::nullopt;
  const identify::GapTerm& term = body->model.terms.back();
  const Eigen::Index begin = identify::firstParameterOf(*body, 0);
  const Eigen::MatrixXd covariance = body->covariance.block(begin, begin, kComponents, kComponents);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(symmetric(term.linear));
  std::array<int, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::abs(axes.eigenvalues()[a]) > std::abs(axes.eigenvalues()[b]); });
  SourceShape shape;
  shape.center_m = term.searched.head<3>();
  for (int k = 0; k < 3; ++k) {
    const int of = order[static_cast<std::size_t>(k)];
    const Eigen::Vector3d axis = axes.eigenvectors().col(of);
    const auto slope = slopeOf(axis);
    shape.axes.col(k) = axis;
    shape.values_m3[k] = axes.eigenvalues()[of];
    shape.sds_m3[k] = std::sqrt(std::max(0.0, slope.dot(covariance * slope)));
  }
  shape.shape = shapeOf(shape.values_m3, shape.sds_m3, search.thresholds().silent_axis);
  return shape;
}

std::string sourceShapeText(const SourceShape& shape) {
  const std::string where = "What stands near " + directionText(shape.center_m) + " m answers ";
  const std::string first = directionText(shape.axes.col(0));
  const std::string last = directionText(shape.axes.col(2));
  switch (shape.shape) {
    case Shape::kBody:
      return where + "along all its axes, as a block or a ball does, and no sheet, bar or loop.";
    case Shape::kFlatOrLoop:
      return where + "along " + first + " alone, as a conducting sheet at right angles to it does, or a closed loop.";
    case Shape::kLongConductor:
      return where + "across " + last + " only, as a pipe or a bar that conducts does, lying along it.";
    case Shape::kIronBar:
      return where + "along " + first + " alone, as a bar of iron lying along it does.";
    case Shape::kIronSheet:
      return where + "across " + last + " only, as a sheet of iron at right angles to it does.";
    case Shape::kUnclear:
      break;
  }
  return where + "in a way that does not tell its shape.";
}

}  // namespace fieldtrue::gap
