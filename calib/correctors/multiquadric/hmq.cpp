#include "calib/correctors/multiquadric/hmq.h"

#include <cstdio>

#include "calib/correctors/base/fit_memory.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/multiquadric/hmq_position.h"

namespace fieldtrue::correctors {
namespace {

std::string textInMm(double rms_m) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g mm", 1000.0 * rms_m);
  return text;
}

Result<std::unique_ptr<PositionModel>> fitHmq(const FitData& data, const Settings& settings,
                                              const RunControl& control) {
  FT_TRY(const auto problem, makeHmqProblem(data, settings, control));
  FT_TRY(auto field,
         MultiquadricField::fit(problem.name, problem.places, truthMatrix(problem.places), problem.r2.r2_m2, control));
  const std::string plane = planeNote(data, "nothing is claimed off it");
  const std::string between = plane.empty() || problem.r2.note.empty() ? "" : " ";
  return std::make_unique<HmqPosition>(std::move(field), plane + between + problem.r2.note);
}

}  // namespace

std::unique_ptr<PositionModel> readHmqPosition(const JsonReader& parameters) {
  return std::make_unique<HmqPosition>(MultiquadricField::fromJson(parameters, 3), parameters["note"].text());
}

Result<HmqProblem> makeHmqProblem(const FitData& data, const Settings& settings, const RunControl& control) {
  HmqProblem problem;
  problem.name = "Hardy's multiquadric";
  FT_TRY_VOID(checkPositions(data, problem.name));
  problem.places = mergePlaces(data);
  FT_TRY_VOID(checkSpread(problem.name, problem.places.size(), data.dimension));
  FT_TRY(auto memory,
         bookSquareMatrices(problem.name, multiquadricMatrices(problem.places.size()), problem.places.size(), control));
  problem.memory = std::make_shared<const MemoryBooking>(std::move(memory));
  FT_TRY(problem.r2, chooseR2(problem.name, problem.places, truthMatrix(problem.places), settings, textInMm, control));
  return problem;
}

PositionMethod hmqPosition() {
  return {.id = "hmq",
          .label = "Hardy's multiquadric",
          .source = "Zachmann 1997; survey by Kindratenko, section 3.5, eq. 16-18; automatic R squared by Rippa 1999",
          .settings = {r2Setting()},
          .fit = fitHmq,
          .read = readHmqPosition,
          .hold_out = holdOutHmq,
          .origin = MethodOrigin::kSurvey,
          .tries = {{"r2_cm2=10", simplicity::kInterpolating},
                    {"r2_cm2=100", simplicity::kInterpolating},
                    {"r2_cm2=1000", simplicity::kInterpolating}},
          .reading =
              "The sum of multiquadrics is the true position itself, not its difference to the tracked one, and "
              "has no constant term, so it depends on where the origin is: here the transmitter, as tracked.",
          .former_settings = {"precision"}};
}

}  // namespace fieldtrue::correctors
