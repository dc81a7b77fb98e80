#include <nlohmann/json.hpp>

#include "calib/core/file_io.h"
#include "calib/core/json_reader.h"
#include "calib/core/number_text.h"
#include "calib/exporters/lattice_export.h"
#include "calib/exporters/rows.h"

namespace fieldtrue::exporters {
namespace polynomial_files {
namespace {

/// A calibration by a polynomial, written out: with u = axes^T (p - center) / scale the true position is
/// rotation p + translation + sum of coefficient * u0^a u1^b u2^c.
struct WrittenOut {
  Eigen::Matrix3d axes;
  Eigen::Vector3d center_m;
  Eigen::Vector3d scale_m;
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation_m;
  std::vector<std::array<int, 3>> powers;
  std::vector<Eigen::Vector3d> coefficients_m;
  int degree = 0;

  Eigen::Vector3d mapped_m(const Eigen::Vector3d& p_m) const {
    const Eigen::Vector3d u = (axes.transpose() * (p_m - center_m)).cwiseQuotient(scale_m);
    Eigen::Vector3d sum_m = rotation * p_m + translation_m;
    for (std::size_t term = 0; term < powers.size(); ++term) {
      double value = 1.0;
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (int power = 0; power < powers[term][axis]; ++power) value *= u[static_cast<Eigen::Index>(axis)];
      sum_m += value * coefficients_m[term];
    }
    return sum_m;
  }
};

/// Powers in the order of the coefficients: by total degree, the first axis's power falling first.
/// @source Kindratenko's survey, equation 14
std::vector<std::array<int, 3>> powersOf(int dimension, int degree) {
  std::vector<std::array<int, 3>> powers;
  for (int total = 0; total <= degree; ++total)
    for (int first = total; first >= 0; --first)
      for (int second = total - first; second >= (dimension == 2 ? total - first : 0); --second)
        powers.push_back({first, second, total - first - second});
  return powers;
}

Result<void> checkIsPolynomial(const calibration::Corrector& corrector) {
  const std::string& method = corrector.choice().position_id;
  if (method == "polynomial" && !corrector.isBaked()) return {};
  return fail(ErrorCode::kUnsupported,
              "Coefficients can be written of the method polynomial only; this calibration corrects by " + method +
                  (corrector.isBaked() ? ", baked" : "") + ": fit polynomial, or choose a lattice");
}

Result<WrittenOut> writtenOut(const ExportSubject& subject) {
  const calibration::Corrector& corrector = subject.corrector();
  return readJson<WrittenOut>(nlohmann::json::parse(corrector.toText()), "the calibration",
                              [&](const JsonReader& file) {
                                const JsonReader parameters = file["position"]["parameters"];
                                WrittenOut out;
                                out.axes = parameters["axes"].matrix3();
                                out.center_m = parameters["center_m"].vector3();
                                out.scale_m = parameters["scale_m"].vector3();
                                out.degree = parameters["degree"].integer();
                                out.powers = powersOf(parameters["dimension"].integer(), out.degree);
                                const Pose& reference_from_tracker = corrector.alignment().reference_from_tracker;
                                out.rotation = reference_from_tracker.orientation.toRotationMatrix();
                                out.translation_m = reference_from_tracker.position_m;
                                const Eigen::MatrixXd coefficients_m = parameters["coefficients"].matrix(3);
                                for (Eigen::Index row = 0; row < coefficients_m.rows(); ++row)
                                  out.coefficients_m.emplace_back(out.rotation * coefficients_m.row(row).transpose());
                                return out;
                              });
}

Written writtenOf(const ExportSubject& subject, const WrittenOut& out) {
  Written written;
  written.deviation = deviationAt(subject.probes(kProbes),
                                  [&](const Eigen::Vector3d& p_m) { return std::optional(out.mapped_m(p_m)); });
  written.notes.push_back(std::to_string(out.powers.size()) + " terms of degree " + std::to_string(out.degree) +
                          " for each coordinate; exact.");
  return written;
}

Result<Written> writeJson(const ExportSubject& subject, const ExportOptions&, const std::filesystem::path& path,
                          const RunControl&) {
  FT_TRY(const auto out, writtenOut(subject));
  nlohmann::json about = nlohmann::json::object();
  for (const auto& [key, value] : subject.facts("metres")) about[key] = value;
  nlohmann::json terms = nlohmann::json::array();
  for (std::size_t term = 0; term < out.powers.size(); ++term)
    terms.push_back({{"powers", out.powers[term]}, {"coefficient_m", jsonOf(out.coefficients_m[term])}});
  const nlohmann::json json = {
      {"schema", "fieldtrue.polynomial/1"},
      {"about", about},
      {"formula",
       "u = axes^T (p - center_m) / scale_m; true = rotation p + translation_m + sum of coefficient_m * "
       "u[0]^powers[0] * u[1]^powers[1] * u[2]^powers[2]"},
      {"degree", out.degree},
      {"axes", jsonOf(Eigen::MatrixXd(out.axes))},
      {"center_m", jsonOf(out.center_m)},
      {"scale_m", jsonOf(out.scale_m)},
      {"rotation", jsonOf(Eigen::MatrixXd(out.rotation))},
      {"translation_m", jsonOf(out.translation_m)},
      {"terms", terms}};
  FT_TRY_VOID(writeFileAtomically(path, [&](std::ostream& stream) { stream << json.dump(1) << '\n'; }));
  return writtenOf(subject, out);
}

std::string inComment(std::string text) {
  for (std::size_t at = text.find("*/"); at != std::string::npos; at = text.find("*/", at)) text.replace(at, 2, "* ");
  return text;
}

/// A number as C99 reads it back to the bit, with a point so that no compiler takes it for an integer.
std::string literal(double value) {
  std::string text = formatNumber(value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return value < 0.0 ? "(" + text + ")" : text;
}

std::string cText(const ExportSubject& subject, const WrittenOut& out) {
  std::string text = "/*\n" + inComment(factLines(subject.facts("metres"), " * ")) +
                     " *\n * fieldtrue_correct: where a position that the tracker measured truly is, both in metres.\n"
                     " * C99; it needs nothing else. in and out may be the same array.\n */\n"
                     "void fieldtrue_correct(const double in[3], double out[3]);\n\n"
                     "void fieldtrue_correct(const double in[3], double out[3]) {\n";
  const char* names = "xyz";
  for (int axis = 0; axis < 3; ++axis)
    text += std::string("  const double ") + names[axis] + " = in[" + std::to_string(axis) + "];\n";
  for (int axis = 0; axis < 3; ++axis)
    text += std::string("  const double d") + names[axis] + " = " + names[axis] + " - " + literal(out.center_m[axis]) +
            ";\n";
  for (int axis = 0; axis < 3; ++axis) {
    text += "  const double u" + std::to_string(axis) + " = (";
    for (int k = 0; k < 3; ++k) {
      text += k > 0 ? " + " : "";
      text += literal(out.axes(k, axis)) + " * d" + names[k];
    }
    text += ") / " + literal(out.scale_m[axis]) + ";\n";
  }
  for (int axis = 0; axis < 3; ++axis)
    for (int power = 2; power <= out.degree; ++power) {
      const std::string u = "u" + std::to_string(axis);
      const std::string below = power == 2 ? u : u + "_" + std::to_string(power - 1);
      text.append("  const double ").append(u).append("_").append(std::to_string(power));
      text.append(" = ").append(below).append(" * ").append(u).append(";\n");
    }
  const auto factor = [](std::size_t axis, int power) {
    std::string name = "u" + std::to_string(axis);
    if (power > 1) name += "_" + std::to_string(power);
    return name;
  };
  for (int axis = 0; axis < 3; ++axis) {
    text += "  out[" + std::to_string(axis) + "] = ";
    for (int k = 0; k < 3; ++k) text += literal(out.rotation(axis, k)) + " * " + names[k] + " + ";
    text += literal(out.translation_m[axis]);
    for (std::size_t term = 0; term < out.powers.size(); ++term) {
      text += "\n           + " + literal(out.coefficients_m[term][axis]);
      for (std::size_t of = 0; of < 3; ++of)
        if (out.powers[term][of] > 0) text += " * " + factor(of, out.powers[term][of]);
    }
    text += ";\n";
  }
  // A power that no term uses would be warned of.
  for (int axis = 0; axis < 3; ++axis) text += "  (void)u" + std::to_string(axis) + ";\n";
  for (int axis = 0; axis < 3; ++axis)
    for (int power = 2; power <= out.degree; ++power)
      text += "  (void)u" + std::to_string(axis) + "_" + std::to_string(power) + ";\n";
  return text + "}\n";
}

Result<Written> writeC(const ExportSubject& subject, const ExportOptions&, const std::filesystem::path& path,
                       const RunControl&) {
  FT_TRY(const auto out, writtenOut(subject));
  const std::string text = cText(subject, out);
  FT_TRY_VOID(writeFileAtomically(path, [&](std::ostream& stream) { stream << text; }));
  return writtenOf(subject, out);
}

}  // namespace
}  // namespace polynomial_files

Exporter polynomialJsonExporter() {
  using namespace polynomial_files;
  return {.id = "polynomial_json",
          .label = "Polynomial coefficients (JSON)",
          .extension = ".polynomial.json",
          .reads_it = "any program: powers, coefficients, centre and scale",
          .in_words = "metres; measured (tracker frame) to true (the calibration's frame)",
          .purpose = Purpose::kProgram,
          .write = writeJson,
          .check = checkIsPolynomial};
}

Exporter polynomialCExporter() {
  using namespace polynomial_files;
  return {.id = "polynomial_c",
          .label = "C function of the polynomial",
          .extension = ".c",
          .reads_it = "any C or C++ program, Unity plug-ins, firmware: one C99 function without a library",
          .in_words = "metres; measured (tracker frame) to true (the calibration's frame)",
          .purpose = Purpose::kProgram,
          .write = writeC,
          .check = checkIsPolynomial};
}

}  // namespace fieldtrue::exporters
