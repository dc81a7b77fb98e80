#include "tests/blind/generate_session.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tests/blind/generate_effects.h"
#include "tests/blind/session_draw.h"
#include "tests/blind/signatures.h"

namespace blind {
namespace {

using nlohmann::json;

double rhoOf(const Alignment& alignment, const Drawn& drawn, double size) {
  World world;
  drawn.apply(world, size, {});
  const double value = alignment.rho(alignment.whitened(world));
  return std::isfinite(value) ? value : 1e9;
}

/// Finds the size at which one effect has the wished gap to noise, by false position on the logarithms.
bool reach(const Alignment& alignment, Placed& placed, double wished) {
  double low = std::log(placed.drawn.smallest), high = std::log(placed.drawn.largest);
  double low_value = std::log(rhoOf(alignment, placed.drawn, placed.drawn.smallest) / wished);
  double high_value = std::log(rhoOf(alignment, placed.drawn, placed.drawn.largest) / wished);
  if (!(low_value < 0 && high_value > 0)) return false;
  for (int step = 0; step < 40; ++step) {
    double share = -low_value / (high_value - low_value);
    if (step % 3 == 2) share = 0.5;
    const double middle = low + std::clamp(share, 0.01, 0.99) * (high - low);
    placed.size = std::exp(middle);
    placed.rho = rhoOf(alignment, placed.drawn, placed.size);
    const double value = std::log(placed.rho / wished);
    if (std::abs(value) < 0.002) return true;
    (value < 0 ? low : high) = middle;
    (value < 0 ? low_value : high_value) = value;
  }
  return false;
}

const Kind& pick(const std::vector<Kind>& kinds, const Setup& setup, Random& random) {
  double total = 0;
  for (const Kind& kind : kinds) total += kind.fits(setup) ? kind.weight : 0;
  double at = uniform(random, 0, total);
  const Kind* last = &kinds.front();
  for (const Kind& kind : kinds) {
    if (!kind.fits(setup)) continue;
    last = &kind;
    if ((at -= kind.weight) < 0) break;
  }
  return *last;
}

/// Draws geometry until the wished strength is believable.
bool place(const Kind& kind, const Setup& setup, const Alignment& alignment, double wished, Random& random,
           Placed& placed) {
  for (int attempt = 0; attempt < 60; ++attempt) {
    placed.drawn = kind.draw(setup, random);
    if (reach(alignment, placed, wished)) return true;
  }
  return false;
}

json describe(const Placed& placed) {
  json effect = {{"id", placed.drawn.id},       {"kind", placed.drawn.kind}, {"rho", placed.rho},
                 {"location_m", nullptr},       {"material", nullptr},       {"amplitude", nullptr},
                 {"parameters", json::object()}};
  placed.drawn.describe(placed.size, effect);
  return effect;
}

bool clash(const std::string& a, const std::string& b) {
  const auto scale = [](const std::string& id) { return id == "global_gain" || id == "grid_scale"; };
  return a == b || (scale(a) && scale(b)) || (a == "compact_metal" && b == "metal_moved") ||
         (b == "compact_metal" && a == "metal_moved");
}

/// A second or third effect; a third of the pairs take, of several draws, the one that cancels most.
void drawPair(const Setup& setup, const Alignment& alignment, Random& random, std::vector<Placed>& effects) {
  const int count = uniform(random, 0, 1) < 0.8 ? 2 : 3;
  const bool cancelling = uniform(random, 0, 1) < 1.0 / 3;
  for (int attempt = 0; attempt < 200 && static_cast<int>(effects.size()) < count; ++attempt) {
    const Kind& kind = pick(catalogueKinds(), setup, random);
    bool clashes = false;
    for (const Placed& other : effects) clashes = clashes || clash(kind.id, other.drawn.id);
    if (clashes) continue;
    Placed best;
    double best_total = 1e300;
    for (int draw = 0; draw < (cancelling && !effects.empty() ? 5 : 1); ++draw) {
      Placed placed;
      if (!place(kind, setup, alignment, logUniform(random, 0.85, 1.2), random, placed)) continue;
      effects.push_back(placed);
      const double total = alignment.rho(alignment.whitened(worldOf(effects)));
      effects.pop_back();
      if (total < best_total) best = placed, best_total = total;
    }
    if (best_total < 1e299) effects.push_back(best);
  }
}

Vector3d bodyPlace(const Setup& setup, const json& effects) {
  for (const json& effect : effects)
    if (effect["location_m"].is_array() && effect["id"] != "metal_plane")
      return Vector3d(effect["location_m"][0].get<double>(), effect["location_m"][1].get<double>(),
                      effect["location_m"][2].get<double>());
  const Vector3d half_m = 0.5 * setup.pitch_m * (setup.counts - Eigen::Vector3i::Ones()).cast<double>();
  return setup.jig_in_tracker_m +
         setup.tracker_from_jig * (setup.middle_m + half_m + Vector3d(0.1, 0.4, -0.5 * half_m.z()));
}

/// As the true plate or loop is turned, else level.
Vector3d bodyNormal(const Setup& setup, const json& effects) {
  for (const json& effect : effects)
    if (effect["parameters"].contains("normal")) {
      const json& normal = effect["parameters"]["normal"];
      return {normal[0].get<double>(), normal[1].get<double>(), normal[2].get<double>()};
    }
  return setup.tracker_from_jig * Vector3d::UnitZ();
}

json classesOf(const Setup& setup, const Alignment& alignment, const std::vector<Placed>& effects,
               const json& described) {
  Signatures signatures =
      catalogueSignatures(setup, alignment, bodyPlace(setup, described), bodyNormal(setup, described));
  if (effects.size() == 1 && signatures.count(effects[0].drawn.id) != 0)
    signatures[effects[0].drawn.id] = alignment.whitened(worldOf(effects));
  auto classes = equivalenceClasses(signatures, alignment);
  const bool one = effects.size() == 1;
  const bool isotropic =
      one && (effects[0].drawn.id == "global_gain" ||
              (effects[0].drawn.id == "grid_scale" && described[0]["parameters"]["isotropic"] == true));
  const auto holding = [&](const char* id) {
    return std::find_if(classes.begin(), classes.end(), [&](const std::vector<std::string>& members) {
      return std::find(members.begin(), members.end(), id) != members.end();
    });
  };
  if (isotropic && holding("global_gain") != holding("grid_scale")) {
    const auto from = holding("grid_scale");
    const std::vector<std::string> moved = *from;
    classes.erase(from);
    const auto to = holding("global_gain");
    to->insert(to->end(), moved.begin(), moved.end());
  }
  return classes;
}

StreamFault drawFault(const std::string& id, Setup& setup, Random& random, json& effect) {
  StreamFault fault;
  effect = {{"id", id},
            {"kind", "sample stream"},
            {"rho", 0.0},
            {"location_m", nullptr},
            {"material", nullptr},
            {"amplitude", nullptr},
            {"parameters", json::object()}};
  json& parameters = effect["parameters"];
  if (id == "mains_interference") {
    fault.line_hz = uniform(random, 0, 1) < 0.5 ? 50 : 100;
    fault.line_amplitude = setup.coupling_noise * logUniform(random, 0.5, 2);
    effect["rho"] = fault.line_amplitude / setup.coupling_noise;
    parameters = {{"line_hz", fault.line_hz}, {"amplitude_per_m3", fault.line_amplitude}};
  } else if (id == "range_noise") {
    fault.range_power = uniform(random, 1, 2.5);
    parameters = {{"power", fault.range_power}};
  } else if (id == "correlated_samples") {
    setup.filter = 0;
    fault.hidden_filter = uniform(random, 0.7, 0.95);
    parameters = {{"correlation", fault.hidden_filter}};
  } else if (id == "quantization") {
    fault.quantum_m = logUniform(random, 0.002, 0.008);
    parameters = {{"quantum_m", fault.quantum_m}};
  } else {
    fault.flip_share = uniform(random, 0.02, 0.08);
    parameters = {{"probability", fault.flip_share}};
  }
  return fault;
}

/// Rewrites places and attitudes so that the frame of the drawing is that of the transmitter.
void stateInTrackerFrame(Setup& setup) {
  for (Row& row : setup.rows) {
    row.place_m = setup.jig_in_tracker_m + setup.tracker_from_jig * row.place_m;
    row.attitude = (setup.tracker_from_jig * row.attitude).normalized();
  }
  setup.middle_m = setup.jig_in_tracker_m + setup.tracker_from_jig * setup.middle_m;
  setup.jig_in_tracker_m.setZero();
  setup.tracker_from_jig.setIdentity();
}

/// States the table in the transmitter's frame, known to a tolerance, and the sensor in its own.
void knowAlignment(Setup& setup, Random& random) {
  setup.alignment_known = true;
  setup.lever_m.setZero();
  setup.mounting = Quaterniond::Identity();
  stateInTrackerFrame(setup);
  setup.alignment_m = uniform(random, 0.0005, 0.002);
  setup.alignment_rad = uniform(random, 0.0005, 0.002);
}

std::vector<Kind> kindsOn(const SessionWish& wish, bool aligned) {
  if (wish.shelf == "off") return foreignKinds();
  if (wish.shelf != "unforeseen") return aligned ? alignedKinds() : catalogueKinds();
  std::vector<Kind> kinds;
  for (const std::vector<Kind>& batch : unforeseenBatches())
    for (const Kind& kind : batch)
      if (kind.id == wish.kind) kinds.push_back(kind);
  return kinds;
}

/// @return the effects of a session; none when no believable geometry has the wished strength on this design
std::vector<Placed> drawEffects(const SessionWish& wish, const Setup& setup, const Alignment& alignment,
                                Random& random) {
  for (int attempt = 0; attempt < 20; ++attempt) {
    std::vector<Placed> effects;
    if (wish.shelf == "pairs") {
      drawPair(setup, alignment, random, effects);
      if (effects.size() >= 2) return effects;
      continue;
    }
    const double wished = wish.level ? *wish.level : logUniform(random, 0.2, 3.0);
    const bool aligned = setup.alignment_known && uniform(random, 0, 1) < 0.5;
    const std::vector<Kind> kinds = kindsOn(wish, aligned);
    if (std::none_of(kinds.begin(), kinds.end(), [&](const Kind& kind) { return kind.fits(setup); })) return {};
    Placed placed;
    if (place(pick(kinds, setup, random), setup, alignment, wished, random, placed)) return {placed};
  }
  return {};
}

const std::string& pickSignal(bool samples, Random& random) {
  // Interference and a filter show in samples alone: without them only what node means and their SDs show is drawn.
  const int first = samples ? 0 : 2;
  return signalIds()[static_cast<std::size_t>(uniformInt(random, first, 4))];
}

/// One session on one design, or nothing when the design does not carry the wished effect.
std::optional<MadeSession> drawSession(const SessionWish& wish, Random& random) {
  // Nothing of the design and of what is written may depend on the shelf: it would be a label.
  const bool samples = uniform(random, 0, 1) < 0.25 || wish.samples;
  const bool knows = uniform(random, 0, 1) < 0.1;
  Setup setup = drawSetup(random, wish.most_rows);
  if (knows) knowAlignment(setup, random);
  json effects = json::array();
  StreamFault fault;
  if (wish.shelf == "signals") {
    json effect;
    fault = drawFault(pickSignal(samples, random), setup, random, effect);
    effects.push_back(effect);
  }
  const Alignment alignment(setup);
  std::vector<Placed> placed;
  if (wish.shelf != "none" && wish.shelf != "signals") {
    placed = drawEffects(wish, setup, alignment, random);
    if (placed.empty()) return std::nullopt;
  }
  for (const Placed& one : placed) effects.push_back(describe(one));
  const World world = worldOf(placed);
  const Eigen::VectorXd gap = alignment.whitened(world);
  GeneratedSession session = recordSession(setup, world, alignment, fault, samples, random);
  session.unseen_csv = recordUnseen(setup, world, random);
  session.truth = {{"shelf", wish.shelf},
                   {"effects", effects},
                   {"rho", placed.empty() ? 0.0 : alignment.rho(gap)},
                   {"rho_level", wish.level && !placed.empty() ? json(*wish.level) : json(nullptr)},
                   {"position_only", setup.position_only},
                   {"order", setup.random_order ? "random" : "serpentine"},
                   {"orientations", setup.orientations},
                   {"alignment_known", setup.alignment_known},
                   {"scattered", setup.scattered},
                   {"rows", setup.rows.size()},
                   {"classes", classesOf(setup, alignment, placed, effects)},
                   {"oracle", {{"fraction", placed.empty() ? json(nullptr) : json(alignment.oracleFraction(gap))}}}};
  return MadeSession{setup, std::move(placed), std::move(session)};
}

}  // namespace

World worldOf(const std::vector<Placed>& effects) {
  World world;
  for (const Placed& placed : effects) placed.drawn.apply(world, placed.size, {});
  return world;
}

MadeSession makeSession(const SessionWish& wish, std::uint64_t seed) {
  Random random(seed);
  for (int design = 0; design < 50; ++design)
    if (std::optional<MadeSession> session = drawSession(wish, random)) return *std::move(session);
  throw std::runtime_error("no believable geometry reaches the wished strength; another seed is needed");
}

std::vector<std::string> unforeseenIds(std::size_t batch) {
  std::vector<std::string> ids;
  for (const Kind& kind : unforeseenBatches()[batch - 1]) ids.push_back(kind.id);
  return ids;
}

std::vector<std::uint64_t> sessionSeeds(std::uint64_t seed, std::size_t count) {
  Random random(seed);
  random.discard(count - 1);  // Drawn for the order of the shelves.
  std::vector<std::uint64_t> seeds(count);
  for (std::uint64_t& one : seeds) one = random();
  return seeds;
}

std::vector<std::string> catalogueIds() {
  std::vector<std::string> ids = signalIds();
  for (const std::vector<Kind>* kinds : {&catalogueKinds(), &alignedKinds()})
    for (const Kind& kind : *kinds) ids.push_back(kind.id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

}  // namespace blind
