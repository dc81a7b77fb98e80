#include <array>
#include <cmath>
#include <cstdio>

#include "calib/core/file_io.h"
#include "calib/core/number_text.h"
#include "calib/exporters/itk_field.h"
#include "calib/exporters/lattice_export.h"
#include "calib/exporters/rows.h"

/// Files of programs that know rigid transforms only: the best rigid part of a calibration, and what it leaves.
namespace fieldtrue::exporters {
namespace rigid_files {
namespace {

struct RigidPart {
  Pose true_from_measured;
  Deviation left;
  double rms_left_m = 0.0;
};

Result<RigidPart> rigidPartOf(const ExportSubject& subject) {
  std::vector<Eigen::Vector3d> from_m, to_m;
  for (const Eigen::Vector3d& p_m : subject.places_m()) {
    from_m.push_back(p_m);
    to_m.push_back(subject.mapped_m(p_m));
  }
  RigidPart part;
  FT_TRY(part.true_from_measured, fitRigid(from_m, to_m));
  auto probes = subject.probes(kProbes);
  if (probes.empty())
    for (std::size_t i = 0; i < from_m.size(); ++i) probes.emplace_back(from_m[i], to_m[i]);
  double squares_m2 = 0.0;
  for (const auto& [p_m, goes_m] : probes) squares_m2 += (part.true_from_measured * p_m - goes_m).squaredNorm();
  part.rms_left_m = std::sqrt(squares_m2 / static_cast<double>(probes.size()));
  part.left =
      deviationAt(probes, [&](const Eigen::Vector3d& p_m) { return std::optional(part.true_from_measured * p_m); });
  return part;
}

Written writtenOf(const RigidPart& part) {
  Written written;
  written.deviation = part.left;
  written.notes.push_back("Rigid part only: it leaves " + shortNumber(1000.0 * part.rms_left_m) + " mm RMS, " +
                          shortNumber(1000.0 * part.left.worst_m) + " mm at worst, of what the calibration corrects.");
  return written;
}

Facts factsOf(const ExportSubject& subject, const std::string& unit, const RigidPart& part) {
  Facts facts = subject.facts(unit);
  facts.emplace_back("content", "best rigid part of the calibration; what it leaves is not corrected");
  facts.emplace_back("left_rms_mm", shortNumber(1000.0 * part.rms_left_m));
  facts.emplace_back("left_worst_mm", shortNumber(1000.0 * part.left.worst_m));
  return facts;
}

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '<' || c == '&' || c == '"') {
      safe += c == '<' ? "&lt;" : c == '&' ? "&amp;" : "&quot;";
    } else {
      safe += c;
    }
  }
  // Two dashes end a comment.
  for (std::size_t at = safe.find("--"); at != std::string::npos; at = safe.find("--", at)) safe.replace(at, 2, "-");
  return safe;
}

/// PLUS wants YYYY.MM.DD HH:MM:SS; the date of the calibration may be anything.
std::string plusDate(const std::string& date) {
  std::array<int, 6> parts{};
  const int n = std::sscanf(date.c_str(), "%d%*1[-.]%d%*1[-.]%d%*1[ T]%d:%d:%d", &parts[0], &parts[1], &parts[2],
                            &parts[3], &parts[4], &parts[5]);
  if (n < 3) return "";
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%04d.%02d.%02d %02d:%02d:%02d", parts[0], parts[1], parts[2], parts[3],
                parts[4], parts[5]);
  return text.data();
}

Result<Written> writePlus(const ExportSubject& subject, const ExportOptions& options, const std::filesystem::path& path,
                          const RunControl&) {
  FT_TRY(const auto part, rigidPartOf(subject));
  FT_TRY_VOID(checkDeviation(part.left, options, "A rigid transform"));
  constexpr double kMm = 1000.0;
  const Eigen::Matrix3d r = part.true_from_measured.orientation.toRotationMatrix();
  std::string matrix;
  for (int row = 0; row < 3; ++row) {
    matrix += threeNumbers(r.row(row));
    matrix += ' ';
    matrix += formatNumber(kMm * part.true_from_measured.position_m[row]);
    matrix += "  ";
  }
  matrix += "0 0 0 1";
  const std::string date = plusDate(subject.corrector().table().metadata.date.value_or(""));
  std::string text =
      "<?xml version=\"1.0\"?>\n<!--\n" + escaped(factLines(factsOf(subject, "millimetres", part), "")) +
      "-->\n<PlusConfiguration version=\"2.4\">\n  <CoordinateDefinitions>\n    <Transform From=\"Tracker\" "
      "To=\"Reference\"\n      Matrix=\"" +
      matrix + "\"\n      Error=\"" + formatNumber(kMm * part.rms_left_m) + "\"";
  if (!date.empty()) text += " Date=\"" + date + "\"";
  text += "/>\n  </CoordinateDefinitions>\n</PlusConfiguration>\n";
  FT_TRY_VOID(writeFileAtomically(path, [&](std::ostream& out) { out << text; }));
  return writtenOf(part);
}

Result<Written> writeVrpn(const ExportSubject& subject, const ExportOptions& options, const std::filesystem::path& path,
                          const RunControl&) {
  FT_TRY(const auto part, rigidPartOf(subject));
  FT_TRY_VOID(checkDeviation(part.left, options, "A rigid transform"));
  Eigen::Vector3d low_m = part.true_from_measured * subject.places_m().front(), high_m = low_m;
  for (const Eigen::Vector3d& p_m : subject.places_m()) {
    low_m = low_m.cwiseMin(part.true_from_measured * p_m);
    high_m = high_m.cwiseMax(part.true_from_measured * p_m);
  }
  const Eigen::Quaterniond q = canonical(part.true_from_measured.orientation);
  const Eigen::Quaterniond mount = canonical(subject.corrector().alignment().mountOf({}));
  const auto quaternion = [](const Eigen::Quaterniond& one) {
    return threeNumbers(one.vec()) + " " + formatNumber(one.w());
  };
  std::string text = factLines(factsOf(subject, "metres; quaternions x y z w", part));
  text += "# Name of the tracker, its workspace, room from tracker, number of sensors, then each sensor's mounting.\n";
  text += "Tracker0\n";
  text += "# workspace: lowest and highest corner\n" + threeNumbers(low_m) + " " + threeNumbers(high_m) + "\n";
  text += "# room from tracker: translation, quaternion\n" + threeNumbers(part.true_from_measured.position_m) + " " +
          quaternion(q) + "\n";
  text += "# sensors\n1\n0\n0 0 0 " + quaternion(mount) + "\n";
  FT_TRY_VOID(writeFileAtomically(path, [&](std::ostream& out) { out << text; }));
  return writtenOf(part);
}

}  // namespace
}  // namespace rigid_files

Exporter plusXmlExporter() {
  using namespace rigid_files;
  return {.id = "plus_xml",
          .label = "PLUS coordinate definition",
          .extension = ".plus.xml",
          .reads_it = "PLUS (a part of its device-set configuration)",
          .in_words = "millimetres; Tracker to Reference, rigid part only",
          .purpose = Purpose::kRigid,
          .write = writePlus};
}

Exporter vrpnCfgExporter() {
  using namespace rigid_files;
  return {.id = "vrpn_cfg",
          .label = "VRPN tracker configuration",
          .extension = ".vrpn.cfg",
          .reads_it = "VRPN (vrpn_Tracker.cfg)",
          .in_words = "metres; room from tracker, rigid part only",
          .purpose = Purpose::kRigid,
          .write = writeVrpn};
}

}  // namespace fieldtrue::exporters
