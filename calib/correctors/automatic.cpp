#include <algorithm>
#include <array>
#include <cstdio>

#include "calib/core/declare.h"
#include "calib/core/json_reader.h"
#include "calib/correctors/automatic_blend.h"
#include "calib/correctors/automatic_choice.h"
#include "calib/correctors/automatic_evidence.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/method_label.h"
#include "calib/correctors/radial/rbf_system.h"
#include "calib/correctors/readers.h"

namespace fieldtrue::correctors {
namespace {

const std::string kName = "Automatic choice";
const std::string kBlend = "blend";  ///< In place of a method's id.

class AutomaticModel : public PositionModel {
 public:
  /// @param table what was chosen and from what; `model` is filled in from the model itself
  AutomaticModel(std::unique_ptr<PositionModel> model, nlohmann::json table)
      : model_(std::move(model)), table_(std::move(table)), note_(table_.at("note").get<std::string>()) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return model_->displacement_m(p_tracked_m);
  }
  void correct(std::span<const Eigen::Vector3d> p_tracked_m, std::span<Eigen::Vector3d> p_corrected_m) const override {
    model_->correct(p_tracked_m, p_corrected_m);
  }
  bool takesOrientation() const override { return model_->takesOrientation(); }
  Eigen::Vector3d displacementAt_m(const Pose& tracked) const override { return model_->displacementAt_m(tracked); }
  void correctPoses(std::span<const Pose> tracked, std::span<Eigen::Vector3d> p_corrected_m) const override {
    model_->correctPoses(tracked, p_corrected_m);
  }
  Result<std::unique_ptr<PositionModel>> onLattices(const LatticeMaker& maker, double max_deviation_m) const override {
    return model_->onLattices(maker, max_deviation_m);
  }
  std::optional<double> uncertaintyAt_m(const Pose& tracked) const override { return model_->uncertaintyAt_m(tracked); }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override { return model_->jacobian(p_tracked_m); }
  std::optional<double> uncertainty_m(const Eigen::Vector3d& p_tracked_m) const override {
    return model_->uncertainty_m(p_tracked_m);
  }
  bool covers(const Eigen::Vector3d& p_tracked_m) const override { return model_->covers(p_tracked_m); }
  int coefficients() const override { return model_->coefficients(); }
  std::string note() const override {
    const std::string own = model_->note();
    return note_ + (own.empty() ? "" : " " + own);
  }
  nlohmann::json parameters() const override {
    nlohmann::json json = table_;
    json["model"] = model_->parameters();
    return json;
  }

 private:
  std::unique_ptr<PositionModel> model_;
  nlohmann::json table_;
  std::string note_;
};

std::string inMm(double value_m) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g mm", 1000.0 * value_m);
  return text.data();
}

nlohmann::json tableOf(const std::vector<AutomaticCandidate>& candidates, const std::vector<InnerScore>& scores) {
  nlohmann::json rows = nlohmann::json::array();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    nlohmann::json row = {
        {"method", candidates[i].text}, {"inner_rms_mm", nullptr}, {"none_rms_mm", nullptr}, {"skipped", nullptr}};
    if (scores[i].skipped) {
      row["skipped"] = *scores[i].skipped;
    } else {
      row["inner_rms_mm"] = 1000.0 * scores[i].rms_m();
      row["none_rms_mm"] = 1000.0 * scores.front().rms_m();
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string labelOf(const AutomaticCandidate& candidate) {
  return positionLabel(candidate.method->id, candidate.settings);
}

/// "Gaussian process 0.62 and RBF 0.38"
std::string partsOf(const std::vector<AutomaticCandidate>& candidates, const Blend& blend) {
  std::string text;
  for (std::size_t i = 0; i < blend.members.size(); ++i) {
    if (i > 0) text += i + 1 < blend.members.size() ? ", " : " and ";
    std::array<char, 16> weight{};
    std::snprintf(weight.data(), weight.size(), " %.2f", blend.weights[i]);
    text += labelOf(candidates[blend.members[i]]);
    text += weight.data();
  }
  return text;
}

std::string noteOf(const FitData& data, const std::vector<AutomaticCandidate>& candidates,
                   const std::vector<InnerScore>& scores, const AutomaticAnswer& answer, std::size_t n_folds) {
  const AutomaticDecision& decision = answer.decision;
  const std::optional<Blend>& blend = answer.blend;
  const std::size_t chosen = decision.candidate;
  const auto n_scored =
      std::count_if(scores.begin(), scores.end(), [](const InnerScore& score) { return !score.skipped; });
  // Every other model says so itself.
  const std::string plane = chosen == 0 ? planeNote(data, "nothing is claimed off it") : "";
  std::string note = plane + (plane.empty() ? "" : " ") + "Chosen: ";
  note += blend ? "a blend of " + partsOf(candidates, *blend) + ", held-out RMS over the region " +
                      inMm(blend->score.rms_m()) + " against " + inMm(scores[chosen].rms_m()) + " of " +
                      labelOf(candidates[chosen]) + " alone"
                : labelOf(candidates[chosen]) + ", held-out RMS over the region " + inMm(scores[chosen].rms_m());
  if (blend)
    note += " and " + inMm(scores.front().rms_m()) + " without correction";
  else if (chosen == 0)
    note += ", since nothing else lowers it clearly";
  else
    note += " against " + inMm(scores.front().rms_m()) + " without correction";
  if (decision.is_despite_squares)
    note += ", figures that a few places carry: at most places it errs less, and it moves them the right way";
  if (decision.is_by_evidence && !blend) note += ", by the evidence of all places";
  if (answer.stuck)
    note += ", without " + labelOf(candidates[*answer.stuck]) +
            ", whose fit to all places leaves more at them than fits without them";
  return note + "; " + std::to_string(n_scored) + " candidates scored over the same " + std::to_string(n_folds) +
         " folds.";
}

/// A candidate's fit to all places. @param made before, if it was
Result<std::unique_ptr<PositionModel>> fitOnce(std::unique_ptr<PositionModel> made, const AutomaticCandidate& candidate,
                                               const FitData& data, const RunControl& control) {
  if (made != nullptr) return made;
  return candidate.method->fit(data, candidate.settings, control);
}

Result<std::unique_ptr<PositionModel>> fitAnswer(const std::vector<AutomaticCandidate>& candidates,
                                                 const AutomaticAnswer& answer, WholeFits whole, const FitData& data,
                                                 const RunControl& control) {
  const std::size_t chosen = answer.decision.candidate;
  if (!answer.blend) return fitOnce(std::move(whole.models[chosen]), candidates[chosen], data, control);
  const Blend& blend = *answer.blend;
  std::vector<BlendMember> members;
  for (std::size_t i = 0; i < blend.members.size(); ++i) {
    const std::size_t member = blend.members[i];
    const AutomaticCandidate& candidate = candidates[member];
    FT_TRY(auto model, fitOnce(std::move(whole.models[member]), candidate, data, control));
    members.push_back({candidate.method->id, toJson(candidate.settings), blend.weights[i], std::move(model)});
  }
  return makeBlend(std::move(members));
}

CandidateSet candidateSetOf(const Settings& settings) {
  const std::string& text = choiceSetting(settings, "candidates");
  return text == "survey" ? CandidateSet::kSurvey : text == "ours" ? CandidateSet::kOurs : CandidateSet::kAll;
}

/// The data must span a plane at least, in tracked positions too.
Result<void> checkSpread(const FitData& data) {
  FT_TRY(const auto places, smoothFitPlaces(data, kName));
  const FieldFrame frame = FieldFrame::around(places.p_tracked_m, data.dimension, rmsSpread_m(places.p_tracked_m));
  if (!TailProjection::of(frame.tail(places.p_tracked_m))) return tl::unexpected(degenerateTail(kName, places.size()));
  return {};
}

Result<std::unique_ptr<PositionModel>> fitAutomatic(const FitData& data, const Settings& settings,
                                                    const RunControl& control) {
  FT_TRY_VOID(checkSpread(data));
  const std::vector<AutomaticCandidate> candidates = automaticCandidates(candidateSetOf(settings));
  const auto folds = innerFolds(data);
  FT_TRY(auto scores, scoreCandidates(candidates, data, folds, control));
  RunControl inner = control;
  inner.progress = [](double) {};
  FT_TRY(auto whole, fitWhole(candidates, scores, data, folds, inner));
  const double n_steps = static_cast<double>(candidates.size() + kFitsAfterScores);
  control.progress((n_steps - 1.0) / n_steps);
  const AutomaticAnswer answer = answerOf(candidates, scores, data, folds, whole.evidence ? &*whole.evidence : nullptr);
  if (answer.stuck) scores[*answer.stuck].skipped = "its fit to all places leaves more at them than fits without them";
  FT_TRY(auto model, fitAnswer(candidates, answer, std::move(whole), data, inner));
  control.progress(1.0);
  const AutomaticCandidate& winner = candidates[answer.decision.candidate];
  nlohmann::json table = {{"method", answer.blend ? kBlend : winner.method->id},
                          {"settings", answer.blend ? nlohmann::json::object() : toJson(winner.settings)},
                          {"candidates", tableOf(candidates, scores)},
                          {"note", noteOf(data, candidates, scores, answer, folds.rows.size())}};
  return std::make_unique<AutomaticModel>(std::move(model), std::move(table));
}

}  // namespace

std::unique_ptr<PositionModel> readAutomaticPosition(const JsonReader& parameters) {
  const JsonReader candidates = parameters["candidates"];
  candidates.entries();
  nlohmann::json table = {{"method", parameters["method"].text()},
                          {"settings", nlohmann::json::object()},
                          {"candidates", candidates.raw()},
                          {"note", parameters["note"].text()}};
  if (parameters["method"].text() == kBlend)
    return std::make_unique<AutomaticModel>(readBlend(parameters["model"]), std::move(table));
  const auto read = parameters["method"].valueOf(findPositionReader(parameters["method"].text()));
  if (read == &readAutomaticPosition)
    parameters["method"].refuse("another one: an automatic choice cannot have chosen itself");
  table["settings"] = parameters["settings"].object();
  return std::make_unique<AutomaticModel>(read(parameters["model"]), std::move(table));
}

/// Chooses method and settings by cross-validation on the data it is fitted to.
PositionMethod automaticPosition() {
  PositionMethod method;
  method.id = "auto";
  method.label = "Automatic choice";
  method.source =
      "Nested cross-validation: Stone 1974; one-standard-error rule: Breiman, Friedman, Olshen, Stone 1984; "
      "evidence: Schwarz 1978; errors with heavy tails: Lange, Little, Taylor 1989";
  method.settings = {declare::choice("candidates", "Candidates", {"survey", "ours", "all"}, "all",
                                     "Methods to choose from: the survey's, those that came after it, or all; no "
                                     "correction, a rigid motion and an affine map are always among them.")};
  method.fit = fitAutomatic;
  method.read = readAutomaticPosition;
  method.cost = FitCost::kVeryCostly;
  method.tuning = Tuning::kAlways;
  method.origin = MethodOrigin::kLater;
  return method;
}

}  // namespace fieldtrue::correctors
