#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>

#include "calib/core/file_io.h"
#include "calib/core/units.h"
#include "calib/effects/parameters.h"
#include "calib/effects/room_search.h"
#include "calib/effects/rows.h"
#include "calib/effects/sheet_field.h"
#include "calib/field/metal_response.h"
#include "calib/field/sheet_mesh.h"

namespace fieldtrue::effects {

namespace finite_plate {
namespace {

/// A plate looked for is a square this big at first, in metres.
constexpr double kFirstSize_m = 0.6;
constexpr double kSmallest_m = 0.1;
constexpr double kLargest_m = 4.0;
/// Along the side of a square.
constexpr int kFewestCells = 6;
constexpr int kMostCells = 12;

/// Where a plate stands: columns along its length, along its width, normal to it; tracker frame.
struct PlateFrame {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d tracker_from_plate = Eigen::Matrix3d::Identity();
  Eigen::Vector2d half_m = Eigen::Vector2d::Zero();

  Eigen::Vector3d inPlate(const Eigen::Vector3d& p_m) const {
    return tracker_from_plate.transpose() * (p_m - center_m);
  }
  double distance_m(const Eigen::Vector3d& p_m) const {
    const Eigen::Vector3d p = inPlate(p_m);
    const Eigen::Vector2d beyond = (p.head<2>().cwiseAbs() - half_m).cwiseMax(0.0);
    return std::sqrt(beyond.squaredNorm() + p.z() * p.z());
  }
};

/// @param side any direction that is not along the normal
PlateFrame frameOf(const Eigen::Vector3d& center_m, const Eigen::Vector3d& normal, const Eigen::Vector3d& side,
                   double length_m, double width_m) {
  PlateFrame frame;
  frame.center_m = center_m;
  frame.half_m = {0.5 * length_m, 0.5 * width_m};
  const Eigen::Vector3d n = normal.normalized();
  const Eigen::Vector3d x = (side - side.dot(n) * n).normalized();
  frame.tracker_from_plate << x, n.cross(x), n;
  return frame;
}

/// Moments per field and charges per potential of a meshed plate; empty where it carries none.
struct PlateAnswer {
  Eigen::MatrixXd moments;
  Eigen::MatrixXd charges;
};

/// A plate in the transmitter's field.
class FinitePlate final : public field::CouplingDistortion {
 public:
  FinitePlate(const PlateFrame& frame, std::span<const Eigen::Vector2d> ring_centers_m,
              std::span<const Eigen::Vector2d> charge_centers_m, double scale, const PlateAnswer& answer,
              double strength)
      : frame_(frame) {
    const Eigen::Matrix3d& R = frame.tracker_from_plate;
    if (answer.moments.size() > 0) {
      const Eigen::MatrixXd field = sources(ring_centers_m, scale, [&](const Eigen::Vector3d& c_m) {
        return Eigen::RowVector3d(R.col(2).transpose() * field::dipoleField(c_m, 1.0));
      });
      moments_ = -strength / (4.0 * kPi) * (answer.moments * field);
      ring_centers_m_ = scaled(ring_centers_m, scale);
    }
    if (answer.charges.size() > 0) {
      const Eigen::MatrixXd potential = sources(charge_centers_m, scale, [](const Eigen::Vector3d& c_m) {
        return Eigen::RowVector3d(c_m.transpose() / std::pow(c_m.norm(), 3));
      });
      charges_ = -strength / (4.0 * kPi) * (answer.charges * potential);
      charge_centers_m_ = scaled(charge_centers_m, scale);
    }
  }

  Eigen::Matrix3d fieldChange(const Eigen::Vector3d& p_sensor_m, double dipole_constant_m3,
                              double /*time_s*/) const override {
    const Eigen::Vector3d p_m = frame_.inPlate(p_sensor_m);
    Eigen::Matrix3d field = Eigen::Matrix3d::Zero();
    for (std::size_t j = 0; j < ring_centers_m_.size(); ++j) {
      const Eigen::Vector3d d_m(p_m.x() - ring_centers_m_[j].x(), p_m.y() - ring_centers_m_[j].y(), p_m.z());
      const double r2_m2 = d_m.squaredNorm();
      const double per_r5 = 1.0 / (r2_m2 * r2_m2 * std::sqrt(r2_m2));
      const Eigen::Vector3d of_unit = per_r5 * (3.0 * d_m.z() * d_m - Eigen::Vector3d(0.0, 0.0, r2_m2));
      field.noalias() += of_unit * moments_.row(static_cast<Eigen::Index>(j));
    }
    for (std::size_t j = 0; j < charge_centers_m_.size(); ++j) {
      const Eigen::Vector3d d_m(p_m.x() - charge_centers_m_[j].x(), p_m.y() - charge_centers_m_[j].y(), p_m.z());
      const double r2_m2 = d_m.squaredNorm();
      field.noalias() += (d_m / (r2_m2 * std::sqrt(r2_m2))) * charges_.row(static_cast<Eigen::Index>(j));
    }
    return dipole_constant_m3 * (frame_.tracker_from_plate * field);
  }

  bool admits(const Eigen::Vector3d& p_sensor_m) const override { return frame_.distance_m(p_sensor_m) > 0.005; }

  /// As `at` of each setting, many at once.
  void respond(std::span<const field::SensorSetting> settings, std::span<field::EffectResponse> responses) const {
    for (std::size_t begin = 0; begin < settings.size(); begin += kAtOnce) {
      const std::size_t count = std::min(std::size_t{kAtOnce}, settings.size() - begin);
      respondSome(settings.subspan(begin, count), responses.subspan(begin, count));
    }
  }

 private:
  static constexpr int kAtOnce = 64;  ///< Places whose sums stay in the nearest cache.

  void respondSome(std::span<const field::SensorSetting> settings, std::span<field::EffectResponse> responses) const {
    const auto count = static_cast<Eigen::Index>(settings.size());
    Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kAtOnce, 3> p_m(count, 3);
    Eigen::Matrix<double, Eigen::Dynamic, 9, 0, kAtOnce, 9> sum(count, 9);
    sum.setZero();
    for (Eigen::Index i = 0; i < count; ++i)
      p_m.row(i) = frame_.inPlate(settings[static_cast<std::size_t>(i)].tracker_from_sensor.position_m);
    const SheetField field{p_m.col(0).data(), p_m.col(1).data(), p_m.col(2).data(), settings.size(), sum.data()};
    for (std::size_t j = 0; j < ring_centers_m_.size(); ++j)
      addDipole({ring_centers_m_[j].x(), ring_centers_m_[j].y(), moments_.row(static_cast<Eigen::Index>(j)).data()},
                field);
    for (std::size_t j = 0; j < charge_centers_m_.size(); ++j)
      addCharge({charge_centers_m_[j].x(), charge_centers_m_[j].y(), charges_.row(static_cast<Eigen::Index>(j)).data()},
                field);
    for (Eigen::Index i = 0; i < count; ++i) {
      Eigen::Matrix3d in_plate;
      in_plate << sum(i, 0), sum(i, 1), sum(i, 2), sum(i, 3), sum(i, 4), sum(i, 5), sum(i, 6), sum(i, 7), sum(i, 8);
      responses[static_cast<std::size_t>(i)] = {};
      responses[static_cast<std::size_t>(i)].field_per_m3 = frame_.tracker_from_plate * in_plate;
    }
  }

  template <typename OfPlace>
  Eigen::MatrixXd sources(std::span<const Eigen::Vector2d> centers_m, double scale, const OfPlace& of_place) const {
    Eigen::MatrixXd rows(static_cast<Eigen::Index>(centers_m.size()), 3);
    for (std::size_t j = 0; j < centers_m.size(); ++j) {
      const Eigen::Vector3d in_plate_m(scale * centers_m[j].x(), scale * centers_m[j].y(), 0.0);
      rows.row(static_cast<Eigen::Index>(j)) = of_place(frame_.center_m + frame_.tracker_from_plate * in_plate_m);
    }
    return rows;
  }

  static std::vector<Eigen::Vector2d> scaled(std::span<const Eigen::Vector2d> centers_m, double scale) {
    std::vector<Eigen::Vector2d> result(centers_m.begin(), centers_m.end());
    for (Eigen::Vector2d& center_m : result) center_m *= scale;
    return result;
  }

  PlateFrame frame_;
  std::vector<Eigen::Vector2d> ring_centers_m_;
  std::vector<Eigen::Vector2d> charge_centers_m_;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> moments_;  ///< Over 4 pi, for C = 1.
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> charges_;  ///< Over 4 pi, for C = 1.
};

/// Whether a mode of magnetisation is one at all: the even potential magnetises nothing.
double idealChargeShare(double rate, double chi_t_m) {
  if (std::isinf(chi_t_m)) return rate > 1e-6 ? 1.0 : 0.0;
  return chi_t_m * rate / (1.0 + chi_t_m * rate);
}

/// Cells along the side of a square of this plate's area: about two thirds of the transmitter's distance each, but six
/// at least and twelve at most.
int cellsAlongSide(const PlateFrame& frame) {
  const double side_m = 2.0 * std::sqrt(frame.half_m.prod());
  const double wanted = 1.5 * side_m / frame.distance_m(Eigen::Vector3d::Zero());
  return static_cast<int>(std::ceil(std::clamp(wanted, double{kFewestCells}, double{kMostCells})));
}

PlateAnswer answerOf(const field::SheetMesh& mesh, const nlohmann::json& parameters,
                     const field::Excitation& excitation) {
  const bool is_ferromagnetic = isFerromagnetic(parameters);
  const double mu_r = is_ferromagnetic ? scalarOf(parameters, "relative_permeability") : 1.0;
  const nlohmann::json& thickness = parameters.at("thickness_m");
  PlateAnswer answer;
  if (parameters.at("conductivity_s_per_m").is_null()) {
    if (!is_ferromagnetic) {
      answer.moments = mesh.currentModes().answer([](double) { return 1.0; });
      return answer;
    }
    const double chi_t_m =
        thickness.is_null() ? std::numeric_limits<double>::infinity() : (mu_r - 1.0) * thickness.get<double>();
    answer.charges = mesh.chargeModes().answer([&](double rate) { return idealChargeShare(rate, chi_t_m); });
    return answer;
  }
  const field::MetalSheet sheet{{scalarOf(parameters, "conductivity_s_per_m"), mu_r}, thickness.get<double>()};
  answer.moments =
      mesh.currentModes().answer([&](double rate) { return field::sheetCurrentShare(sheet, rate, excitation); });
  if (is_ferromagnetic) {
    answer.charges =
        mesh.chargeModes().answer([&](double rate) { return field::sheetChargeShare(sheet, rate, excitation); });
  }
  return answer;
}

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& excitation) {
  const Eigen::Vector3d normal = vectorOf(parameters, "normal");
  const Eigen::Vector3d side = vectorOf(parameters, "side");
  if (normal.cross(side).norm() < 1e-6 * std::max(1.0, normal.norm() * side.norm())) {
    return fail(ErrorCode::kBadInput, "finite_plate: normal is " + textOf(normal) + " and side is " + textOf(side) +
                                          "; neither may be zero and they must not be parallel.");
  }
  if (!parameters.at("conductivity_s_per_m").is_null() && parameters.at("thickness_m").is_null()) {
    return fail(ErrorCode::kBadInput,
                "finite_plate: conductivity_s_per_m is given and thickness_m is not; a real plate needs both.");
  }
  const PlateFrame frame = frameOf(vectorOf(parameters, "center_m"), normal, side, scalarOf(parameters, "length_m"),
                                   scalarOf(parameters, "width_m"));
  if (frame.distance_m(Eigen::Vector3d::Zero()) < 0.01) {
    return fail(ErrorCode::kBadInput, "finite_plate: center_m " + textOf(frame.center_m) +
                                          " puts the transmitter in the plate; move the plate.");
  }
  const int along = cellsAlongSide(frame);
  const field::SheetMesh mesh(2.0 * frame.half_m.x(), 2.0 * frame.half_m.y(), along * along);
  return std::make_unique<FinitePlate>(frame, mesh.ringCenters_m(), mesh.chargeCenters_m(), 1.0,
                                       answerOf(mesh, parameters, excitation), scalarOf(parameters, "strength"));
}

/// Answers of a square plate of side 1 m, from which those of any square follow by size.
struct UnitSquare {
  explicit UnitSquare(int along) : mesh(1.0, 1.0, along * along) {}
  field::SheetMesh mesh;
  Eigen::MatrixXd moments = mesh.currentModes().answer([](double) { return 1.0; });
  Eigen::MatrixXd charges = mesh.chargeModes().answer(
      [](double rate) { return idealChargeShare(rate, std::numeric_limits<double>::infinity()); });
};

/// Meshed once in a program's life.
const UnitSquare& unitSquare(int along) {
  static std::array<std::once_flag, kMostCells + 1> flags;
  static std::array<std::unique_ptr<const UnitSquare>, kMostCells + 1> squares;
  const auto i = static_cast<std::size_t>(along);
  std::call_once(flags[i], [&] { squares[i] = std::make_unique<const UnitSquare>(along); });
  return *squares[i];
}

/// How a square that is fitted is turned in its plane: with its sides, or its diagonals, along an axis of the tracker.
/// Every square is within 22.5 degrees of one of them.
enum class Sides { kAlong, kAcross };

class FinitePlateFit final : public EffectFit {
 public:
  FinitePlateFit(const FitDesign& design, bool is_ferromagnetic, Sides sides)
      : search_(design), is_ferromagnetic_(is_ferromagnetic), sides_(sides) {}

  std::string name() const override { return material() + (sides_ == Sides::kAlong ? "" : ", turned"); }

  bool searchesPlace() const override { return true; }
  std::vector<FitParameter> searched() const override {
    std::vector<FitParameter> parameters = search_.centerParameters();
    for (FitParameter& angle : DirectionChart::parameters()) parameters.push_back(std::move(angle));
    parameters.push_back({"size_m", "m", kSmallest_m, kLargest_m});
    return parameters;
  }

  std::vector<FitParameter> linear() const override { return {{"strength", "", 0.0, 1.1}}; }

  std::vector<Eigen::VectorXd> starts() const override {
    std::vector<Eigen::VectorXd> starts;
    // Turned squares begin where the others end, and from the axes.
    const auto normals = sides_ == Sides::kAlong ? firstNormals() : firstNormals().first(3);
    for (const Eigen::Vector3d& p_m : search_.around_m(0.95, {0.3, 0.75})) {
      for (const Eigen::Vector3d& normal : normals) {
        Eigen::VectorXd start(6);
        start << p_m, chart_.angles_rad(normal), kFirstSize_m;
        if (allows(start)) starts.push_back(start);
      }
    }
    return starts;
  }

  bool allows(const Eigen::VectorXd& searched) const override {
    if (!(searched[5] >= kSmallest_m && searched[5] <= kLargest_m)) return false;
    if (!search_.allowsCenter(searched.head<3>())) return false;
    const PlateFrame frame = frameAt(searched);
    const double least_m = 0.8 * search_.keepAway_m();
    return frame.distance_m(Eigen::Vector3d::Zero()) >= least_m &&
           std::all_of(search_.places_m().begin(), search_.places_m().end(),
                       [&](const Eigen::Vector3d& p_m) { return frame.distance_m(p_m) >= least_m; });
  }

  void respond(std::span<const field::SensorSetting> at, const Eigen::VectorXd& searched,
               std::span<field::EffectResponse> responses) const override {
    const double size_m = searched[5];
    const PlateFrame frame = frameAt(searched);
    const UnitSquare& square = unitSquare(cellsAlongSide(frame));
    PlateAnswer answer;
    // A ring's moment per field grows as size^3 with its area and inductance, a charge per potential as size.
    if (is_ferromagnetic_) {
      answer.charges = size_m * square.charges;
    } else {
      answer.moments = size_m * size_m * size_m * square.moments;
    }
    const field::SheetMesh& mesh = square.mesh;
    const FinitePlate plate(frame, mesh.ringCenters_m(), mesh.chargeCenters_m(), size_m, answer, 1.0);
    plate.respond(at, responses);
  }

  FittedEffect describe(const Eigen::VectorXd& searched, const Eigen::VectorXd& linear) const override {
    const PlateFrame frame = frameAt(searched);
    const Eigen::Vector3d normal = frame.tracker_from_plate.col(2);
    const Eigen::Vector3d side = frame.tracker_from_plate.col(0);
    const Eigen::Vector3d& center_m = frame.center_m;
    FittedEffect fitted;
    fitted.material = material();
    fitted.location_m = center_m;
    fitted.parameters = {{"center_m", {center_m.x(), center_m.y(), center_m.z()}},
                         {"normal", {normal.x(), normal.y(), normal.z()}},
                         {"side", {side.x(), side.y(), side.z()}},
                         {"length_m", searched[5]},
                         {"width_m", searched[5]},
                         {"material", material()},
                         {"strength", linear[0]}};
    fitted.values = {{"center_x_m", "m", center_m.x()}, {"center_y_m", "m", center_m.y()},
                     {"center_z_m", "m", center_m.z()}, {"normal_x", "", normal.x()},
                     {"normal_y", "", normal.y()},      {"normal_z", "", normal.z()},
                     {"size_m", "m", searched[5]},      {"strength", "", linear[0]}};
    fitted.is_plausible = linear[0] >= 0.0 && linear[0] <= 1.1;
    if (linear[0] < 0.0) {
      fitted.doubt = "a " + material() + " plate that answers with the wrong sign";
    } else if (!fitted.is_plausible) {
      fitted.doubt =
          "a plate " + formatNumber(std::round(10.0 * linear[0]) / 10.0) + " times as strong as an ideal one";
    }
    return fitted;
  }

 private:
  PlateFrame frameAt(const Eigen::VectorXd& searched) const {
    const Eigen::Vector3d normal = chart_.direction(searched[3], searched[4]);
    const Eigen::Vector3d side = std::abs(normal.x()) < 0.75 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
    const PlateFrame frame = frameOf(searched.head<3>(), normal, side, searched[5], searched[5]);
    if (sides_ == Sides::kAlong) return frame;
    const Eigen::Vector3d diagonal = frame.tracker_from_plate.col(0) + frame.tracker_from_plate.col(1);
    return frameOf(frame.center_m, normal, diagonal, searched[5], searched[5]);
  }

  std::string material() const { return is_ferromagnetic_ ? "ferromagnetic" : "conductive"; }

  RoomSearch search_;
  DirectionChart chart_;
  bool is_ferromagnetic_;
  Sides sides_;
};

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& design) {
  std::vector<std::unique_ptr<EffectFit>> ways;
  for (const Sides sides : {Sides::kAlong, Sides::kAcross})
    for (const bool is_ferromagnetic : {false, true})
      ways.push_back(std::make_unique<FinitePlateFit>(design, is_ferromagnetic, sides));
  return ways;
}

}  // namespace
}  // namespace finite_plate

/// A flat rectangular metal plate with edges: a table top, a cabinet's side, a floor plate, a sheet of foil.
///
/// As a conductor it carries currents in its plane, which keep out the field normal to it; as a ferromagnet it is
/// magnetised in its plane. Ideal, either is complete. With conductivity and thickness given, the currents' modes
/// answer as far as the tracker's carrier or sampling delay lets them, through the sheet impedance (gamma / 2 sigma)
/// coth(gamma d / 2), gamma^2 = s mu sigma, which is 1/(sigma d) for a thin sheet; and a permeable plate is besides
/// magnetised with chi_t = (mu_r tanh(x)/x - 1) d, x = gamma d / 2.
/// @source meshed sheet: calib/field/sheet_mesh.h; sheet impedance: Wait 1962, Electromagnetic Waves in Stratified
/// Media, chapter 2; thin conducting sheet: Saslow 1992, Am. J. Phys. 60 693
Effect finitePlateEffect() {
  using namespace finite_plate;
  Effect effect;
  effect.id = "finite_plate";
  effect.label = "Metal plate";
  effect.source =
      "Meshed sheet: Weidelt 1975, J. Geophys. 41 85; edges: Hough 1973, J. Aircraft 10 314; sheet impedance: "
      "Wait 1962, Electromagnetic Waves in Stratified Media";
  effect.parameters = {
      centerParameter("Middle of the plate, tracker frame."),
      declare::vector3("normal", {}, {0.0, 0.0, 1.0}, "At right angles to the plate, tracker frame; any length."),
      declare::vector3("side", {}, {1.0, 0.0, 0.0}, "Along the plate's length, tracker frame; any length."),
      declare::number("length_m", {0.01, 20.0, "m"}, 0.6, "Along `side`.").plausibly(0.1, 4.0),
      declare::number("width_m", {0.01, 20.0, "m"}, 0.6, "Across it.").plausibly(0.1, 4.0),
      materialParameter(),
      permeabilityParameter(),
      conductivityParameter(
          "Aluminium 3.5e7, copper 5.8e7, steel 6e6, stainless 1.4e6; needs thickness_m. When given, the tracker's "
          "carrier or sampling delay decides how much is left of the ideal answer; null is an ideal metal."),
      declare::number("thickness_m", {1e-6, 0.1, "m"}, nullptr, "Of the plate; null is thick enough not to matter.")
          .plausibly(2e-5, 0.02),
      declare::number(
          "strength", {-100.0, 100.0}, 1.0,
          "Share of such a plate's answer; below 1 for holes and gaps. No real plate has more than 1 or less than 0.")
          .plausibly(0.0, 1.0)};
  effect.make = make;
  effect.fits = fits;
  effect.body = plateOf;
  return effect;
}

}  // namespace fieldtrue::effects
