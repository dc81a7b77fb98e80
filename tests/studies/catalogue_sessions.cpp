// Sessions made by Fieldtrue's own simulator and catalogue, in the layout of the blind sessions: the easy rung of the
// ladder, to be read beside sessions that other physics made.
#include <fstream>
#include <iostream>
#include <numeric>
#include <random>

#include "calib/core/file_io.h"
#include "calib/identify/joint_fit.h"
#include "calib/simulation/simulator.h"
#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "tests/studies/rooms.h"
#include "tests/studies/workers.h"

using namespace fieldtrue;
using fieldtrue::testing::inParallel;
using fieldtrue::testing::orThrow;

namespace {

constexpr std::array<double, 4> kLevels{0.35, 0.7, 1.4, 2.8};

struct Made {
  std::string effect = "none";
  double rho = 0.0;
  std::optional<double> level;
  std::optional<Eigen::Vector3d> location_m;
  nlohmann::json parameters;
  int rows = 0;
};

class SessionMaker {
 public:
  explicit SessionMaker(std::uint64_t seed) : generator_(seed) {}

  Made make(const std::filesystem::path& path) {
    simulation::Scene scene = randomScene();
    const std::vector<PlannedPlace> plan = randomPlan();
    Made made;
    if (uniform(0.0, 1.0) > 0.25) {
      for (int attempt = 0; attempt < 50 && made.effect == "none"; ++attempt) tryEffect(scene, plan, made);
    }
    simulation::SimulationOptions options;
    options.seed = generator_();
    const simulation::Simulation simulation = orThrow(simulation::simulate(scene, plan, options));
    made.rows = static_cast<int>(simulation.table.nodes.size());
    orThrow(writeNodeTable(path, simulation.table).map([] { return 0; }));
    return made;
  }

 private:
  double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(generator_); }
  int integer(int low, int high) { return std::uniform_int_distribution(low, high)(generator_); }

  simulation::Scene randomScene() {
    simulation::Scene scene;
    scene.name = "catalogue";
    scene.tracker.coupling_noise = std::pow(10.0, uniform(-4.3, -3.3));
    scene.tracker.correlation = uniform(0.0, 0.8);
    scene.rig.tolerance_m = uniform(1e-3, 4e-3);
    scene.rig.tolerance_rad = uniform(0.002, 0.007);
    scene.reference_from_tracker.orientation =
        rotationFromVector(Eigen::Vector3d(uniform(-0.2, 0.2), uniform(-0.2, 0.2), uniform(-3.0, 3.0)));
    return scene;
  }

  std::vector<PlannedPlace> randomPlan() {
    const double pitch_m = uniform(0.18, 0.35);
    const Eigen::Vector3i counts(integer(4, 6), integer(4, 6), integer(4, 5));
    const Eigen::Vector3d first_m(uniform(0.5, 0.8), -0.5 * pitch_m * (counts.y() - 1), uniform(-0.6, -0.2));
    std::vector<PlannedPlace> plan;
    for (int k = 0; k < counts.z(); ++k) {
      for (int j = 0; j < counts.y(); ++j) {
        for (int i = 0; i < counts.x(); ++i) {
          PlannedPlace place;
          place.node = static_cast<int>(plan.size());
          place.index = {i, j, k};
          place.reference_from_sensor.position_m = first_m + pitch_m * Eigen::Vector3d(i, j, k);
          plan.push_back(place);
        }
      }
    }
    std::shuffle(plan.begin(), plan.end(), generator_);
    return plan;
  }

  /// Noise-free rows of a scene, and their RMS gap per channel over its true noise, the alignment refitted.
  double rhoOf(const simulation::Scene& scene, std::span<const PlannedPlace> plan, double noise_m,
               double noise_rad) const {
    simulation::TrackerSimulator simulator = orThrow(simulation::TrackerSimulator::make(scene, 1));
    std::vector<Node> nodes;
    double time_s = 0.0;
    for (const PlannedPlace& place : plan) {
      const Sample sample = simulator.measureExactly(place.reference_from_sensor, time_s);
      if (!sample.status.empty()) return std::numeric_limits<double>::infinity();
      Node node;
      node.node = place.node;
      node.reference_from_sensor = place.reference_from_sensor;
      node.tracker_from_sensor = sample.tracker_from_sensor;
      node.t_start_s = time_s;
      nodes.push_back(node);
      time_s += 5.5;
    }
    TableMetadata metadata;
    metadata.jig_tolerance_m = noise_m;
    metadata.jig_tolerance_rad = noise_rad;
    const identify::GapRows rows = orThrow(identify::makeGapRows(nodes, metadata));
    const identify::GapPhysics physics(rows, {});
    const identify::Whitening whitening = identify::makeWhitening(rows, noise_m, noise_rad);
    const identify::GapModel start{identify::initialAlignment(rows), {}};
    const identify::RefinedModel none = identify::refineJointly(physics, start, whitening, {});
    double sum = 0.0;
    for (const identify::Vector6d& r : identify::whitenedResiduals(physics, none.model, whitening))
      sum += r.squaredNorm();
    return std::sqrt(sum / (6.0 * static_cast<double>(nodes.size())));
  }

  void tryEffect(simulation::Scene& scene, std::span<const PlannedPlace> plan, Made& made) {
    std::vector<field::SensorSetting> settings;
    effects::FitDesign design;
    double time_s = 0.0;
    for (const PlannedPlace& place : plan) {
      const Pose tracker_from_reference = inverse(scene.reference_from_tracker);
      settings.push_back(
          {tracker_from_reference * place.reference_from_sensor, tracker_from_reference, place.index, time_s});
      design.places_m.extend(settings.back().tracker_from_sensor.position_m);
      time_s += 5.5;
    }
    design.settings = settings;
    design.pitch_m = (plan[0].reference_from_sensor.position_m - plan[1].reference_from_sensor.position_m).norm();
    for (const PlannedPlace& place : plan) {
      const double d = (place.reference_from_sensor.position_m - plan[0].reference_from_sensor.position_m).norm();
      if (d > 0.01) design.pitch_m = std::min(design.pitch_m, d);
    }
    design.has_times = true;
    design.end_s = time_s;
    std::vector<const effects::Effect*> fitted;
    for (const effects::Effect& effect : effects::effects())
      if (effect.fits != nullptr && !effect.fits(design).empty()) fitted.push_back(&effect);
    const effects::Effect& effect = *fitted[static_cast<std::size_t>(integer(0, static_cast<int>(fitted.size()) - 1))];
    auto fits = effect.fits(design);
    const effects::EffectFit& fit = *fits[static_cast<std::size_t>(integer(0, static_cast<int>(fits.size()) - 1))];
    std::vector<Eigen::VectorXd> starts = fit.starts();
    Eigen::VectorXd searched = starts[static_cast<std::size_t>(integer(0, static_cast<int>(starts.size()) - 1))];
    for (Eigen::Index d = 0; d < searched.size(); ++d) searched[d] += uniform(-0.05, 0.05);
    if (searched.size() > 0 && !fit.allows(searched)) return;
    const std::vector<effects::FitParameter> bounds = fit.linear();
    Eigen::VectorXd linear(static_cast<Eigen::Index>(bounds.size()));
    for (Eigen::Index j = 0; j < linear.size(); ++j) {
      const effects::FitParameter& b = bounds[static_cast<std::size_t>(j)];
      linear[j] = uniform(b.low, b.high);
    }
    const std::optional<double> level =
        uniform(0.0, 1.0) < 0.7 ? std::optional(kLevels[static_cast<std::size_t>(integer(0, 3))]) : std::nullopt;
    const double wanted = level.value_or(std::exp(uniform(std::log(0.2), std::log(3.0))));
    scaleTo(wanted, scene, plan, effect, fit, searched, linear, made);
    if (made.effect != "none") made.level = level;
  }

  void scaleTo(double wanted, simulation::Scene& scene, std::span<const PlannedPlace> plan,
               const effects::Effect& effect, const effects::EffectFit& fit, const Eigen::VectorXd& searched,
               const Eigen::VectorXd& linear, Made& made) {
    double scale = 0.2;
    double rho = 0.0;
    effects::FittedEffect described;
    simulation::Scene with = scene;
    for (int step = 0; step < 12; ++step) {
      described = fit.describe(searched, scale * linear);
      with = scene;
      with.effects.push_back({effect.id, described.parameters});
      if (!effects::makeEffect(effect.id, described.parameters)) return;
      rho = rhoOf(with, plan, scene.rig.tolerance_m, scene.rig.tolerance_rad);
      if (!std::isfinite(rho)) {
        scale *= 0.3;
        continue;
      }
      if (!(rho > 1e-6)) return;
      if (std::abs(rho / wanted - 1.0) < 0.02) break;
      scale *= wanted / rho;
    }
    if (std::abs(rho / wanted - 1.0) > 0.1 || !described.is_plausible) return;
    scene = with;
    made.effect = effect.id;
    made.rho = rho;
    made.location_m = described.location_m;
    made.parameters = described.parameters;
  }

  std::mt19937_64 generator_;
};

nlohmann::json truthOf(const Made& made, const std::string& file) {
  nlohmann::json effects = nlohmann::json::array();
  if (made.effect != "none") {
    nlohmann::json location = nullptr;
    if (made.location_m) location = {made.location_m->x(), made.location_m->y(), made.location_m->z()};
    effects.push_back({{"id", made.effect},
                       {"kind", "catalogue"},
                       {"rho", made.rho},
                       {"location_m", location},
                       {"material", nullptr},
                       {"amplitude", nullptr},
                       {"parameters", made.parameters}});
  }
  nlohmann::json classes = nlohmann::json::array();
  for (const effects::Effect& effect : fieldtrue::effects::effects())
    if (effect.id != "grid_scale") {
      classes.push_back(effect.id == "global_gain" ? nlohmann::json{"global_gain", "grid_scale"}
                                                   : nlohmann::json::array({effect.id}));
    }
  return {{"file", file},
          {"shelf", made.effect == "none" ? "none" : "single"},
          {"effects", effects},
          {"rho", made.rho},
          {"rho_level", made.level ? nlohmann::json(*made.level) : nlohmann::json(nullptr)},
          {"position_only", false},
          {"order", "random"},
          {"orientations", 1},
          {"alignment_known", false},
          {"rows", made.rows},
          {"classes", classes},
          {"oracle", {{"fraction", 1.0}}}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::cerr << "usage: catalogue_sessions DIR SEED COUNT THREADS\n";
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  const std::uint64_t seed = std::stoull(argv[2]);
  const std::size_t count = std::stoul(argv[3]);
  std::filesystem::create_directories(folder);
  std::vector<nlohmann::json> sessions(count);
  inParallel(std::stoi(argv[4]), count, "sessions", [&](std::size_t i) {
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "session_%04zu", i + 1);
    const Made made = SessionMaker(seed * 1000003 + i).make(folder / (std::string(name.data()) + ".nodes.csv"));
    sessions[i] = truthOf(made, name.data());
  });
  std::ofstream(folder / "truth.json") << nlohmann::json{
      {"schema", "fieldtrue.blind/1"},
      {"seed", seed},
      {"role", "dev"},
      {"sessions", sessions}}.dump(1);
  return 0;
}
