#include "calib/core/declare.h"
#include "calib/correctors/base/error_rotation.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/place_rotations.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/cells/cell_json.h"
#include "calib/correctors/cells/local_interpolation.h"

namespace fieldtrue::correctors {
namespace {

class LocalErrorRotation : public ErrorRotationModel {
 public:
  LocalErrorRotation(ErrorFrame frame, HexahedralCells cells, std::vector<Eigen::Quaterniond> q_error,
                     const WeightRule& rule, std::string note)
      : ErrorRotationModel(frame),
        cells_(std::move(cells)),
        q_error_(std::move(q_error)),
        rule_(rule),
        note_(std::move(note)) {
    for (std::size_t cell = 0; cell < cells_.size(); ++cell) lengths_.push_back(cellLengths(cells_, cell));
  }

  bool covers(const Eigen::Vector3d& p_tracked_m) const override { return cells_.locate(p_tracked_m).has_value(); }
  std::string note() const override { return note_; }

 protected:
  Eigen::Quaterniond errorRotation(const Eigen::Vector3d& p_tracked_m) const override {
    const auto at = cells_.locate(p_tracked_m);
    if (!at) return Eigen::Quaterniond::Identity();
    std::array<Eigen::Quaterniond, 8> q;
    for (std::size_t c = 0; c < 8; ++c) q[c] = q_error_[static_cast<std::size_t>(cells_.corners(at->cell)[c])];
    return weightedRotation(q,
                            cornerWeights(rule_, lengths_[at->cell], cornerDistances_m(cells_, at->cell, p_tracked_m)));
  }

  nlohmann::json errorParameters() const override {
    nlohmann::json json = cells_.toJson();
    json.update(toJson(rule_));
    json["q_error_wxyz"] = jsonOfRotations(q_error_);
    json["note"] = note_;
    return json;
  }

 private:
  HexahedralCells cells_;
  std::vector<Eigen::Quaterniond> q_error_;
  WeightRule rule_;
  std::string note_;
  std::vector<CellLengths> lengths_;
};

Result<std::unique_ptr<OrientationModel>> fitLocalQuaternion(const FitData& data, const Settings& settings,
                                                             const RunControl&) {
  const std::string name = "Local mixture of rotations";
  FT_TRY_VOID(checkOrientations(data, name));
  FT_TRY(const auto grid, placeGrid(data, name, "tetrahedral_quaternion"));
  const ErrorFrame frame = errorFrame(settings);
  const WeightRule rule = weightRule(weightKind(choiceSetting(settings, "weight")), settings);
  HexahedralCells cells = HexahedralCells::of(grid);
  std::string note = joinedNotes({gridNote(grid), foldNote(cells, grid.places), bumpNote(rule, cells)});
  return std::make_unique<LocalErrorRotation>(frame, std::move(cells), placeErrorRotations(data, grid.places, frame),
                                              rule, std::move(note));
}

Setting rotationWeightSetting() {
  return declare::choice("weight", "Weights", {"linear", "quadratic", "log", "bryson_linear", "bryson_bump", "briggs"},
                         "linear", "How the corners of the cell share: linear, quadratic and log are Kindratenko's.");
}

}  // namespace

std::unique_ptr<OrientationModel> readLocalQuaternionOrientation(const JsonReader& parameters) {
  HexahedralCells cells = HexahedralCells::fromJson(parameters);
  std::vector<Eigen::Quaterniond> q_error = rotationsFrom(parameters["q_error_wxyz"], cells.corners_m().size());
  return std::make_unique<LocalErrorRotation>(errorFrameFrom(parameters), std::move(cells), std::move(q_error),
                                              weightRuleFrom(parameters), parameters["note"].text());
}

OrientationMethod localQuaternionOrientation() {
  return {.id = "local_quaternion",
          .label = "Local rotations (Kindratenko)",
          .source = "Kindratenko, Bennett 2000; survey by Kindratenko, section 4.1, weights of eq. 9-11 and 13",
          .settings = {rotationWeightSetting(), lengthUnitSetting(), bumpEndSetting(), errorFrameSetting()},
          .fit = fitLocalQuaternion,
          .read = readLocalQuaternionOrientation,
          .tuning = Tuning::kNever};  // The end of the bump is the cell's own length.
}

}  // namespace fieldtrue::correctors
