#include "calib/exporters/fixed_lattice.h"

#include "calib/core/number_text.h"

namespace fieldtrue::exporters {

Result<Written> writeFixedLattice(const ExportSubject& subject, const ExportOptions& options,
                                  const std::filesystem::path& path, const LatticePoints& points,
                                  const LatticeForm& form, const std::string& label, const RunControl& control) {
  const auto probes = subject.probes(kProbes);
  if (probes.empty())
    return fail(ErrorCode::kDegenerate,
                "This calibration holds nowhere: its places span no volume, so that no lattice "
                "can be written; record places in several layers");
  FT_TRY(const auto field, sampleField(subject, points, form, control));
  const auto deviationOf = [&](const LatticeField& of) {
    return deviationAt(probes, [&](const Eigen::Vector3d& p_m) -> std::optional<Eigen::Vector3d> {
      if (form.mapped_m) return form.mapped_m(of, p_m);
      return of.mapped_m(p_m);
    });
  };
  const Deviation before = deviationOf(field);
  FT_TRY_VOID(checkDeviation(before, options, label));
  Facts facts = subject.facts(form.unit);
  facts.emplace_back("largest_deviation_mm", shortNumber(1000.0 * before.worst_m) + " at " +
                                                 std::to_string(before.n_points) + " points of the region");
  FT_TRY_VOID(form.write(field, facts, path));
  FT_TRY(const auto read_back, form.read(path));
  Written written;
  written.deviation = deviationOf(read_back);
  written.notes.push_back("Lattice of " + std::to_string(points.counts[0]) + "x" + std::to_string(points.counts[1]) +
                          "x" + std::to_string(points.counts[2]) + " points, " + deviationText(*written.deviation) +
                          ".");
  return written;
}

}  // namespace fieldtrue::exporters
