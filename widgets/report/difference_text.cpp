#include "widgets/report/difference_text.h"

#include "calib/core/number_text.h"
#include "calib/core/setup.h"
#include "widgets/report/numbers.h"

namespace fieldtrue::widgets {

namespace {

std::string mm(double value_mm) { return errorFigure(value_mm) + " mm"; }
std::string deg(double value_deg) { return errorFigure(value_deg) + " degrees"; }

std::string heldOut(const evaluation::PlaceErrors& errors) {
  if (errors.mm.empty()) return "not known";
  return mm(errors.rms_mm) + " RMS (" + errorFigure(errors.rms_90_mm.low) + " to " +
         errorFigure(errors.rms_90_mm.high) + ") at " + std::to_string(errors.mm.size()) + " places";
}

std::string atMost(const evaluation::CalibrationDifference& difference) {
  const std::string most = mm(difference.max_mm) + " at most";
  if (difference.n_orientations == 0) return most;
  return most + ", in " + std::to_string(difference.n_orientations) +
         (difference.n_orientations == 1 ? " orientation" : " orientations");
}

std::string statedSetup(const Setup& setup) { return setup.empty() ? "not stated" : setupText(setup); }

}  // namespace

std::vector<DifferenceFact> differenceFacts(const evaluation::CalibrationDifference& difference) {
  std::vector<DifferenceFact> facts = {
      {"Set-up of the first", statedSetup(difference.first_setup)},
      {"Set-up of the second", statedSetup(difference.second_setup)},
      {"The same set-up", std::string(nameOf(difference.setup_matches))},
      {"Corrections differ by",
       mm(difference.rms_mm) + " RMS, 95 % below " + mm(difference.p95_mm) + ", " + atMost(difference)},
      {"Rigid motion taken out", mm(difference.moved_mm) + " and " + deg(difference.turned_deg)},
      {"With that motion", mm(difference.whole_rms_mm) + " RMS, " + mm(difference.whole_max_mm) + " at most"},
      {"What both are unsure of",
       difference.expected_mm ? mm(*difference.expected_mm) + " RMS" : "not stated by both methods"},
      {"First, held out", heldOut(difference.first_own)},
      {"Second, held out", heldOut(difference.second_own)},
      {"First at the second's places", heldOut(difference.first_at_second)}};
  if (difference.angle_rms_deg)
    facts.push_back({"Orientations differ by", deg(*difference.angle_rms_deg) + " RMS, " +
                                                   deg(*difference.angle_max_deg) + " at most, beside " +
                                                   deg(difference.angle_shared_deg.value_or(0.0)) + " that all share"});
  return facts;
}

}  // namespace fieldtrue::widgets
