#include "calib/correctors/polynomial/polynomial_choice.h"

#include <cmath>
#include <map>
#include <optional>

#include "calib/core/declare.h"
#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/polynomial/polynomial_position.h"

namespace fieldtrue::correctors {
namespace {

/// Errors below a nanometre (a nanoradian) are rounding, and no reason for a higher degree.
constexpr double kRoundingSquared = 1e-18;

/// Squared held-out errors by place, in the same order for every degree.
using DegreeScores = std::map<int, std::vector<double>>;

double meanOf(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

/// Whether a degree's mean lies above the best one's by no more than one standard error of the difference.
bool isWithinOneStandardError(const std::vector<double>& scores, const std::vector<double>& best) {
  const auto n = static_cast<double>(scores.size());
  const double mean = meanOf(scores) - meanOf(best);
  double squares = 0.0;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const double deviation = scores[i] - best[i] - mean;
    squares += deviation * deviation;
  }
  return mean <= std::sqrt(squares / (n * std::max(1.0, n - 1.0))) + kRoundingSquared;
}

int chosenDegree(const DegreeScores& scores) {
  auto best = scores.begin();
  for (auto degree = scores.begin(); degree != scores.end(); ++degree)
    if (meanOf(degree->second) < meanOf(best->second)) best = degree;
  for (const auto& [degree, squares] : scores)
    if (isWithinOneStandardError(squares, best->second)) return degree;
  return best->first;
}

std::string joined(const std::string& first, const std::string& second) {
  return first.empty() || second.empty() ? first + second : first + " " + second;
}

}  // namespace

std::string degreeName(const std::string& label, int degree) { return label + " of degree " + std::to_string(degree); }

Result<PolynomialDegree> degreeFor(const PolynomialTask& task, const Settings& settings, const RunControl& control) {
  const SettingValue& wanted = settings.at("degree");
  if (const double* number = std::get_if<double>(&wanted)) return PolynomialDegree{static_cast<int>(*number), {}};
  const Places places = mergePlaces(task.data);
  DegreeScores scores;
  std::optional<Error> why_not;
  for (int degree = 1; degree <= PolynomialField::kMaxDegree; ++degree) {
    if (control.stop.stop_requested())
      return fail(ErrorCode::kCancelled, "The choice of the degree was stopped on request");
    const PolynomialProblem problem{
        degreeName(task.label, degree), task.data.p_tracked_m, task.values, degree, task.data.dimension, places.size(),
        fewestLevels(task.data)};
    const auto fits = PolynomialHoldOut::make(problem, places);
    if (!fits && degree == 1) why_not = fits.error();
    if (!fits) continue;
    if (auto squares = fits->leaveOneOutSquares()) scores.emplace(degree, *std::move(squares));
  }
  if (scores.empty())
    return tl::unexpected(why_not.value_or(Error{
        ErrorCode::kTooFewNodes, task.label + " of automatic degree needs more than the " +
                                     std::to_string(places.size()) + " places there are, to leave each out once"}));
  const int degree = chosenDegree(scores);
  const std::string among = scores.size() == 1 ? "the only one these places determine"
                                               : std::to_string(scores.begin()->first) + " to " +
                                                     std::to_string(scores.rbegin()->first) + " were tried";
  return PolynomialDegree{
      degree, "Degree " + std::to_string(degree) + " was chosen by leaving each place out (" + among + ")."};
}

Result<ChosenPolynomial> fitChosenPolynomial(const PolynomialTask& task, const Settings& settings,
                                             const RunControl& control) {
  FT_TRY(const auto degree, degreeFor(task, settings, control));
  const PolynomialProblem problem{
      degreeName(task.label, degree.degree), task.data.p_tracked_m,  task.values, degree.degree, task.data.dimension,
      mergePlaces(task.data).size(),         fewestLevels(task.data)};
  return PolynomialField::fit(problem).map([&](PolynomialField field) {
    return ChosenPolynomial{std::move(field), degree.note};
  });
}

std::string ChosenPolynomial::note() const { return joined(degree_note, polynomialNote(field)); }

nlohmann::json ChosenPolynomial::toJson() const {
  nlohmann::json json = field.toJson();
  if (!degree_note.empty()) json["degree_note"] = degree_note;
  return json;
}

ChosenPolynomial ChosenPolynomial::fromJson(const JsonReader& json) {
  ChosenPolynomial chosen{PolynomialField::fromJson(json), {}};
  json.text("degree_note", chosen.degree_note);
  return chosen;
}

Setting degreeSetting() {
  return declare::autoInteger("degree", "Degree", {1, PolynomialField::kMaxDegree}, 3.0,
                              "Highest total power of x, y and z; each axis needs one level of places more than the "
                              "degree. auto: the lowest degree that predicts left-out places as well as the best one.");
}

}  // namespace fieldtrue::correctors
