#include "calib/correctors/multiquadric/hmq.h"

#include <algorithm>
#include <cstdio>

#include "calib/core/declare.h"
#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_memory.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/multiquadric/hmq_hold_out.h"
#include "calib/correctors/multiquadric/hmq_r2.h"
#include "calib/correctors/multiquadric/hmq_single.h"

namespace fieldtrue::correctors {
namespace {

/// Points at which single precision is compared with double, and how much more than seen there is stated.
constexpr std::size_t kPrecisionProbes = 20000;
constexpr double kPrecisionMargin = 1.25;

Setting precisionSetting() {
  return declare::choice(
      "precision", "Precision", {"double", "single"}, "double",
      "Numbers of the evaluation: single is about twice as fast, and its deviation is measured and stated.");
}

std::string textInMm(double rms_m) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g mm", 1000.0 * rms_m);
  return text;
}

std::string precisionNote(const MultiquadricField& field) {
  const double largest_m = SingleMultiquadricField(field).largestDeviation(field, kPrecisionProbes);
  char text[128];
  std::snprintf(text, sizeof text, "Single precision: within %.2g um of double, measured at %zu points.",
                1e6 * kPrecisionMargin * largest_m, std::max(kPrecisionProbes, field.size()));
  return text;
}

void addSentence(std::string& note, const std::string& sentence) {
  if (!sentence.empty()) note += (note.empty() ? "" : " ") + sentence;
}

Result<std::unique_ptr<PositionModel>> fitHmq(const FitData& data, const Settings& settings,
                                              const RunControl& control) {
  FT_TRY(const auto problem, makeHmqProblem(data, settings, control));
  const Places& places = problem.places;
  FT_TRY(auto field, MultiquadricField::fit(problem.name, places.p_tracked_m, places.node, places.index,
                                            truthOf(places), problem.r2.r2_m2, control));
  std::string note = planeNote(data, "nothing is claimed off it");
  addSentence(note, problem.r2.note);
  if (problem.precision == HmqPrecision::kSingle) addSentence(note, precisionNote(field));
  return std::make_unique<HmqPosition>(std::move(field), problem.precision, note);
}

}  // namespace

std::unique_ptr<PositionModel> readHmqPosition(const JsonReader& parameters) {
  return HmqPosition::fromJson(parameters);
}

Result<void> checkHmqSpread(const std::string& name, std::size_t n_places, int dimension) {
  if (dimension >= 2) return {};
  return fail(ErrorCode::kDegenerate, name + " needs places that span a plane or a volume, and these " +
                                          std::to_string(n_places) + " lie " +
                                          (dimension == 1 ? "on one line" : "at one point"));
}

Eigen::MatrixXd truthOf(const Places& places) {
  Eigen::MatrixXd p_true_m(static_cast<Eigen::Index>(places.size()), 3);
  for (std::size_t i = 0; i < places.size(); ++i)
    p_true_m.row(static_cast<Eigen::Index>(i)) = places.p_true_m[i].transpose();
  return p_true_m;
}

Result<HmqProblem> makeHmqProblem(const FitData& data, const Settings& settings, const RunControl& control) {
  HmqProblem problem;
  problem.name = "Hardy's multiquadric";
  FT_TRY_VOID(checkPositions(data, problem.name));
  problem.places = mergePlaces(data);
  FT_TRY_VOID(checkHmqSpread(problem.name, problem.places.size(), data.dimension));
  auto memory =
      bookSquareMatrices(problem.name, multiquadricMatrices(problem.places.size()), problem.places.size(), control);
  if (!memory) return tl::unexpected(memory.error());
  problem.memory = std::make_shared<const MemoryBooking>(*std::move(memory));
  auto r2 = chooseR2(problem.name, problem.places, truthOf(problem.places), settings, textInMm, control);
  if (!r2) return tl::unexpected(r2.error());
  problem.r2 = *std::move(r2);
  if (choiceSetting(settings, "precision") == "single") problem.precision = HmqPrecision::kSingle;
  return problem;
}

PositionMethod hmqPosition() {
  return {.id = "hmq",
          .label = "Hardy's multiquadric",
          .source = "Zachmann 1997; survey by Kindratenko, section 3.5, eq. 16-18; automatic R squared by Rippa 1999",
          .settings = {r2Setting(), precisionSetting()},
          .fit = fitHmq,
          .read = readHmqPosition,
          .hold_out = holdOutHmq,
          .origin = MethodOrigin::kSurvey,
          .tries = {{"r2_cm2=10", simplicity::kInterpolating},
                    {"r2_cm2=100", simplicity::kInterpolating},
                    {"r2_cm2=1000", simplicity::kInterpolating}},
          .reading =
              "The sum of multiquadrics is the true position itself, not its difference to the tracked one, and "
              "has no constant term, so it depends on where the origin is: here the transmitter, as tracked."};
}

}  // namespace fieldtrue::correctors
