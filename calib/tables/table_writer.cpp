#include "calib/tables/table_writer.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "calib/core/file_io.h"
#include "calib/tables/table_io.h"
#include "calib/tables/table_metadata.h"

namespace fieldtrue {

namespace {

constexpr const char* kNodeHeadAfterIndex =
    "sensor,visit,t_start_s,t_end_s,x_true_m,y_true_m,z_true_m,qw_true,qx_true,qy_true,qz_true,x_m,y_m,z_m,qw,qx,qy,qz,"
    "sd_x_m,sd_y_m,sd_z_m,cov_xy_m2,cov_xz_m2,cov_yz_m2,sd_rot_rad,n_used,n_rejected,n_effective,role\n";
constexpr const char* kSampleHead = "node,sensor,visit,t_s,x_m,y_m,z_m,qw,qx,qy,qz,status\n";

/// Builds one row of comma-separated fields.
class RowText {
 public:
  const std::string& text() const { return text_; }
  void number(double value) {
    separate();
    if (std::isnan(value)) {
      text_ += "nan";
      return;
    }
    std::array<char, 32> digits;
    text_.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
  }
  void integer(int value) {
    separate();
    text_ += std::to_string(value);
  }
  void optional(const std::optional<double>& value) { value ? number(*value) : blanks(1); }
  void blanks(int count) {
    for (int i = 0; i < count; ++i) separate();
  }
  void vector(const Eigen::Vector3d& value) {
    for (int axis = 0; axis < 3; ++axis) number(value[axis]);
  }
  /// w >= 0; a unit quaternion keeps its bits.
  void rotation(const Eigen::Quaterniond& q) {
    const double norm = q.norm();
    const double scale = (q.w() < 0.0 ? -1.0 : 1.0) / (norm > 0.0 && std::abs(norm - 1.0) > 1e-12 ? norm : 1.0);
    for (const double part : {q.w(), q.x(), q.y(), q.z()}) number(part * scale);
  }
  void word(const std::string& value) {
    separate();
    if (value.find_first_of(",\"\r\n") == std::string::npos) {
      text_ += value;
      return;
    }
    text_ += '"';
    for (const char c : value) {
      if (c == '"') text_ += '"';
      text_ += c == '\r' || c == '\n' ? ' ' : c;
    }
    text_ += '"';
  }

 private:
  void separate() {
    if (!is_first_) text_ += ',';
    is_first_ = false;
  }
  std::string text_;
  bool is_first_ = true;
};

void appendCovariance(RowText& row, const std::optional<Eigen::Matrix3d>& covariance_m2) {
  if (!covariance_m2) {
    row.blanks(6);
    return;
  }
  const Eigen::Matrix3d& c = *covariance_m2;
  row.vector(c.diagonal().cwiseSqrt());
  row.vector({c(0, 1), c(0, 2), c(1, 2)});
}

std::string rowText(const Node& node, bool has_index) {
  RowText row;
  row.integer(node.node);
  if (has_index && node.index) {
    for (const int step : *node.index) row.integer(step);
  } else if (has_index) {
    row.blanks(3);
  }
  row.integer(node.sensor);
  row.integer(node.visit);
  row.optional(node.t_start_s);
  row.optional(node.t_end_s);
  row.vector(node.reference_from_sensor.position_m);
  row.rotation(node.reference_from_sensor.orientation);
  row.vector(node.tracker_from_sensor.position_m);
  node.has_orientation ? row.rotation(node.tracker_from_sensor.orientation) : row.blanks(4);
  appendCovariance(row, node.covariance_m2);
  row.optional(node.sd_rot_rad);
  row.integer(node.n_used);
  row.integer(node.n_rejected);
  row.number(node.n_effective);
  row.word(std::string(nameOf(node.role)));
  return row.text();
}

std::string rowText(const SampleRow& sample_row) {
  const Sample& sample = sample_row.sample;
  RowText row;
  row.integer(sample_row.node);
  row.integer(sample.sensor);
  row.integer(sample_row.visit);
  row.number(sample.time_s);
  row.vector(sample.tracker_from_sensor.position_m);
  row.rotation(sample.tracker_from_sensor.orientation);
  // A reading that is not one must not read back as a good sample.
  const bool is_reading = sample.tracker_from_sensor.position_m.allFinite();
  row.word(is_reading || !sample.status.empty() ? sample.status : "missing");
  return row.text();
}

}  // namespace

void writeNodeTable(std::ostream& out, const CalibrationTable& table) {
  writeMetadata(out, table.metadata);
  const bool has_index =
      std::any_of(table.nodes.begin(), table.nodes.end(), [](const Node& node) { return node.index.has_value(); });
  out << (has_index ? "node,i,j,k," : "node,") << kNodeHeadAfterIndex;
  for (const Node& node : table.nodes) out << rowText(node, has_index) << '\n';
}

void writeSampleTable(std::ostream& out, const SampleTable& table) {
  writeMetadata(out, table.metadata);
  out << kSampleHead;
  for (const SampleRow& row : table.rows) out << rowText(row) << '\n';
}

Result<void> writeNodeTable(const std::filesystem::path& path, const CalibrationTable& table) {
  return writeFileAtomically(path, [&](std::ostream& out) { writeNodeTable(out, table); });
}

Result<void> writeSampleTable(const std::filesystem::path& path, const SampleTable& table) {
  return writeFileAtomically(path, [&](std::ostream& out) { writeSampleTable(out, table); });
}

}  // namespace fieldtrue
