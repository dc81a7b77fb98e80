#include "calib/correctors/baked/baked_lattice_maker.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <random>
#include <set>

#include "calib/correctors/baked/baked_lattice_samples.h"

namespace fieldtrue::correctors {
namespace {

constexpr std::size_t kRandomProbes = 20000;
/// Drawn in the box until so many lie in the region; a region that fills less of its box gets fewer.
constexpr std::size_t kMostDraws = 40 * kRandomProbes;
/// Points that were not tried lie a little above the largest that were.
constexpr double kKeptBelow = 0.8;
constexpr int kFirstCells = 4;
constexpr int kMostTrials = 16;
constexpr std::size_t kBlock = 512;
/// Of the region, what may be left out where the correction bends too sharply for any lattice: beside metal, mostly
/// beyond the places.
constexpr double kMostLeftOut = 0.02;
constexpr int kMostLookedAgain = 12;

/// Cells of a lattice that it does not follow the correction in.
struct Holes {
  std::set<std::array<int, 3>> cells;
  double share = 0.0;        ///< Of the region.
  double deviation_m = 0.0;  ///< Largest at the points that were looked at beside them.
  std::size_t n_points = 0;
};

std::array<int, 3> cellAt(const LatticeParts& parts, const Eigen::Vector3d& p_m) {
  const Eigen::Vector3d t = (p_m - parts.origin_m) / parts.spacing_m;
  std::array<int, 3> cell;
  for (std::size_t axis = 0; axis < 3; ++axis)
    cell[axis] = std::clamp(static_cast<int>(t[static_cast<Eigen::Index>(axis)]) - 1, 0, latticeCells(parts, axis) - 1);
  return cell;
}

/// Points of the region, and where the correction takes them.
struct Probes {
  std::vector<Eigen::Vector3d> p_m;
  std::vector<Eigen::Vector3d> displacement_m;
};

LatticeBox boxAround(std::span<const Eigen::Vector3d> places_m, double margin_m) {
  LatticeBox box{places_m.front(), places_m.front()};
  for (const Eigen::Vector3d& p_m : places_m) {
    box.low_m = box.low_m.cwiseMin(p_m);
    box.high_m = box.high_m.cwiseMax(p_m);
  }
  box.low_m.array() -= 2.0 * margin_m;
  box.high_m.array() += 2.0 * margin_m;
  return box;
}

class LatticeBaker {
 public:
  LatticeBaker(const PositionModel& model, const Region& region, std::span<const Eigen::Vector3d> places_m,
               double max_deviation_m, const RunControl& control)
      : model_(model),
        region_(region),
        box_(boxAround(places_m, region.margin_m())),
        wanted_m_(kKeptBelow * max_deviation_m),
        max_deviation_m_(max_deviation_m),
        control_(control) {
    probes_ = drawnProbes(1, {places_m.begin(), places_m.end()});
  }

  Result<std::unique_ptr<BakedLattice>> bake() {
    const double finest_m = finestSpacing_m();
    double spacing_m = std::max((box_.high_m - box_.low_m).maxCoeff() / kFirstCells, finest_m);
    double order = 4.0;
    double last_spacing_m = 0.0;
    double last_deviation_m = 0.0;
    for (int trial = 0; trial < kMostTrials; ++trial) {
      FT_TRY(auto parts, sampleLattice(model_, box_, spacing_m, false, control_));
      BakedLattice lattice(std::move(parts));
      double deviation_m = deviationOf(lattice, probes_);
      std::size_t n_points = probes_.p_m.size();
      if (deviation_m <= wanted_m_) {
        const Probes centers = cellCenters(lattice);
        deviation_m = std::max(deviation_m, deviationOf(lattice, centers));
        n_points += centers.p_m.size();
      }
      if (control_.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
      if (deviation_m <= wanted_m_) return finished(lattice, deviation_m, n_points, {});
      if (spacing_m <= finest_m) {
        const std::optional<Holes> holes = holesOf(lattice);
        if (control_.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
        if (!holes) return unreachable(lattice, deviation_m);
        return finished(lattice, holes->deviation_m, holes->n_points, *holes);
      }
      if (last_spacing_m > 0.0)
        order = std::clamp(std::log(last_deviation_m / deviation_m) / std::log(last_spacing_m / spacing_m), 0.5, 4.0);
      last_spacing_m = spacing_m;
      last_deviation_m = deviation_m;
      const double needed = std::pow(wanted_m_ / deviation_m, 1.0 / order);
      spacing_m = std::max(finest_m, spacing_m * std::clamp(0.97 * needed, 0.3, 0.9));
      control_.progress(0.9 * (trial + 1) / kMostTrials);
    }
    return fail(ErrorCode::kUnsupported, "The lattice did not settle on a spacing; ask for a larger deviation");
  }

 private:
  /// @param seed of the points drawn in the region; @param more points beside them
  Probes drawnProbes(std::uint64_t seed, const std::vector<Eigen::Vector3d>& more_m) const {
    std::vector<Eigen::Vector3d> points_m = more_m;
    std::mt19937_64 generator(seed);
    // The generator's own bits, since the standard leaves its distributions to each library.
    const auto uniform = [&] { return static_cast<double>(generator() >> 11) * 0x1p-53; };
    for (std::size_t draw = 0; draw < kMostDraws && points_m.size() < kRandomProbes + more_m.size(); ++draw) {
      const double a = uniform(), b = uniform(), c = uniform();
      const Eigen::Vector3d p_m = box_.low_m + Eigen::Vector3d(a, b, c).cwiseProduct(box_.high_m - box_.low_m);
      if (region_.contains(p_m)) points_m.push_back(p_m);
    }
    return evaluated(points_m);
  }

  /// The cells in which a lattice is off by more than is wanted, at points drawn anew until none is found. A cell
  /// beside one of them is off too where nobody looked, so that the six around it go with it.
  /// @return nothing where they are more of the region than may be left out
  std::optional<Holes> holesOf(const BakedLattice& lattice) const {
    Holes holes;
    for (int look = 0; look < kMostLookedAgain; ++look) {
      if (control_.stop.stop_requested()) return std::nullopt;
      const Probes probes = look == 0   ? probes_
                            : look == 1 ? cellCenters(lattice)
                                        : drawnProbes(1U + static_cast<std::uint64_t>(look), {});
      const std::size_t before = holes.cells.size();
      double largest_m = 0.0;
      std::size_t n_out = 0;
      holes.n_points += probes.p_m.size();
      for (std::size_t i = 0; i < probes.p_m.size(); ++i) {
        const std::array<int, 3> cell = cellAt(lattice.parts(), probes.p_m[i]);
        const double off_m = (lattice.displacement_m(probes.p_m[i]) - probes.displacement_m[i]).norm();
        if (holes.cells.contains(cell)) {
          ++n_out;
        } else if (off_m > wanted_m_) {
          ++n_out;
          largest_m = std::max(largest_m, off_m);
          addHole(holes, cell, lattice.parts());
        } else {
          holes.deviation_m = std::max(holes.deviation_m, off_m);
        }
      }
      holes.share = std::max(holes.share, static_cast<double>(n_out) / static_cast<double>(probes.p_m.size()));
      if (holes.share > kMostLeftOut) return std::nullopt;
      if (look >= 2 && holes.cells.size() == before) break;
      if (look + 1 == kMostLookedAgain && largest_m > max_deviation_m_) return std::nullopt;
    }
    return holes;
  }

  static void addHole(Holes& holes, const std::array<int, 3>& cell, const LatticeParts& parts) {
    holes.cells.insert(cell);
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        std::array<int, 3> beside = cell;
        beside[axis] += step;
        if (beside[axis] >= 0 && beside[axis] < latticeCells(parts, axis)) holes.cells.insert(beside);
      }
  }

  /// Of the points, those that the correction covers, with its displacement there.
  Probes evaluated(const std::vector<Eigen::Vector3d>& points_m) const {
    std::vector<char> is_covered(points_m.size(), 0);
    std::vector<Eigen::Vector3d> displacement_m(points_m.size());
    const std::size_t n_blocks = (points_m.size() + kBlock - 1) / kBlock;
    control_.parallel_for(n_blocks, [&](std::size_t block) {
      if (control_.stop.stop_requested()) return;
      for (std::size_t i = block * kBlock; i < std::min((block + 1) * kBlock, points_m.size()); ++i) {
        if (!model_.covers(points_m[i])) continue;
        is_covered[i] = 1;
        displacement_m[i] = model_.displacement_m(points_m[i]);
      }
    });
    Probes probes;
    for (std::size_t i = 0; i < points_m.size(); ++i) {
      if (!is_covered[i]) continue;
      probes.p_m.push_back(points_m[i]);
      probes.displacement_m.push_back(displacement_m[i]);
    }
    return probes;
  }

  static double deviationOf(const BakedLattice& lattice, const Probes& probes) {
    double largest_m = 0.0;
    for (std::size_t i = 0; i < probes.p_m.size(); ++i)
      largest_m = std::max(largest_m, (lattice.displacement_m(probes.p_m[i]) - probes.displacement_m[i]).norm());
    return largest_m;
  }

  Probes cellCenters(const BakedLattice& lattice) const {
    const LatticeParts& parts = lattice.parts();
    std::vector<Eigen::Vector3d> centers_m;
    for (int i = 0; i < latticeCells(parts, 0); ++i)
      for (int j = 0; j < latticeCells(parts, 1); ++j)
        for (int k = 0; k < latticeCells(parts, 2); ++k) {
          const Eigen::Vector3d p_m = parts.origin_m + parts.spacing_m * Eigen::Vector3d(i + 1.5, j + 1.5, k + 1.5);
          if (region_.contains(p_m)) centers_m.push_back(p_m);
        }
    return evaluated(centers_m);
  }

  /// The smallest spacing whose lattice stays within the memory allowed.
  double finestSpacing_m() const {
    double coarse_m = (box_.high_m - box_.low_m).maxCoeff();
    double fine_m = coarse_m / 1e5;
    if (!(coarse_m > 0.0)) return 1.0;
    for (int step = 0; step < 60; ++step) {
      const double middle_m = std::sqrt(fine_m * coarse_m);
      (latticeCoefficientsFor(box_, middle_m) > double(kMostLatticeCoefficients) ? fine_m : coarse_m) = middle_m;
    }
    return coarse_m;
  }

  Result<std::unique_ptr<BakedLattice>> finished(const BakedLattice& lattice, double deviation_m, std::size_t n_points,
                                                 const Holes& holes) const {
    LatticeParts parts = lattice.parts();
    const bool with_uncertainty = !probes_.p_m.empty() && model_.uncertainty_m(probes_.p_m.front()).has_value();
    if (with_uncertainty) {
      FT_TRY(auto sampled, sampleLattice(model_, box_, parts.spacing_m, true, control_));
      parts = std::move(sampled);
    }
    markProbedCells(parts);
    leaveOut(holes, parts);
    parts.note = noteOf(parts, deviation_m, n_points);
    if (!holes.cells.empty())
      parts.note += " Not covered by the lattice: " + shareText(holes.share) +
                    " of the region, where the correction bends too sharply for it.";
    control_.progress(1.0);
    return std::make_unique<BakedLattice>(std::move(parts));
  }

  /// A covered sliver between the samples leaves no trace in them.
  void markProbedCells(LatticeParts& parts) const {
    if (parts.covered.empty()) return;
    for (const Eigen::Vector3d& p_m : probes_.p_m) parts.covered[latticeCellIndex(parts, cellAt(parts, p_m))] = true;
  }

  static void leaveOut(const Holes& holes, LatticeParts& parts) {
    if (holes.cells.empty()) return;
    const auto n = static_cast<std::size_t>(latticeCells(parts, 0)) * static_cast<std::size_t>(latticeCells(parts, 1)) *
                   static_cast<std::size_t>(latticeCells(parts, 2));
    if (parts.covered.empty()) parts.covered.assign(n, true);
    for (const std::array<int, 3>& cell : holes.cells) parts.covered[latticeCellIndex(parts, cell)] = false;
  }

  static std::string shareText(double share) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2g %%", 100.0 * share);
    return text;
  }

  static std::string lengthText(double length_m) {
    char text[32];
    const bool in_mm = length_m >= 1e-3;
    std::snprintf(text, sizeof text, "%.3g %s", (in_mm ? 1e3 : 1e6) * length_m, in_mm ? "mm" : "um");
    return text;
  }

  static std::string sizeText(const LatticeParts& parts) {
    char text[96];
    std::snprintf(text, sizeof text, "%dx%dx%d at %.3g mm", parts.counts[0], parts.counts[1], parts.counts[2],
                  1000.0 * parts.spacing_m);
    return text;
  }

  static std::string noteOf(const LatticeParts& parts, double deviation_m, std::size_t n_points) {
    char text[128];
    std::snprintf(text, sizeof text, ", largest deviation %.2g um at %zu points.", 1e6 * deviation_m, n_points);
    return "Baked: lattice " + sizeText(parts) + text;
  }

  tl::unexpected<Error> unreachable(const BakedLattice& lattice, double deviation_m) const {
    return fail(ErrorCode::kUnsupported,
                "A lattice cannot follow this correction within " + lengthText(max_deviation_m_) +
                    ": at the finest that 32 MB hold, " + sizeText(lattice.parts()) + ", it is off by up to " +
                    lengthText(deviation_m) +
                    " at the points looked at, and a fifth of the bound is kept for what lies between them; ask for a "
                    "larger deviation, or bake a method that does not jump or bend between its cells");
  }

  const PositionModel& model_;
  const Region& region_;
  LatticeBox box_;
  double wanted_m_;
  double max_deviation_m_;
  const RunControl& control_;
  Probes probes_;
};

}  // namespace

Result<std::unique_ptr<BakedLattice>> bakeLattice(const PositionModel& model, const Region& region,
                                                  std::span<const Eigen::Vector3d> places_m, double max_deviation_m,
                                                  const RunControl& control) {
  FT_CHECK(max_deviation_m > 0.0);
  if (region.empty() || places_m.empty())
    return fail(ErrorCode::kDegenerate,
                "A lattice needs a calibrated region to fill, and these places span no plane and no volume");
  return LatticeBaker(model, region, places_m, max_deviation_m, control).bake();
}

}  // namespace fieldtrue::correctors
