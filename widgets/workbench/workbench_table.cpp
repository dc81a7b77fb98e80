#include <map>
#include <utility>

#include "calib/recording/unit_slip.h"
#include "calib/tables/table_sensors.h"
#include "widgets/workbench/workbench.h"

/// The rows of the open session: gathered place by place, and whether they may be worked on.
namespace fieldtrue::widgets {
namespace {

/// A table with many rows costs the pages time: they are told of its changes no oftener than this for each row.
constexpr double kTableInterval_ms = 0.05;

}  // namespace

void Workbench::onTables(const CalibrationTable& table, const SampleTable& samples) {
  std::map<std::pair<int, int>, PlaceRows*> by_key;
  for (PlaceRows& place : places_) {
    place.rows.clear();
    place.samples.clear();
    by_key[{place.node, place.visit}] = &place;
  }
  loose_samples_.clear();
  for (const Node& node : table.nodes) {
    if (const auto at = by_key.find({node.node, node.visit}); at != by_key.end()) at->second->rows.push_back(node);
  }
  for (const SampleRow& row : samples.rows) {
    const auto at = by_key.find({row.node, row.visit});
    if (row.node < 0) {
      loose_samples_.push_back(row);
    } else if (at != by_key.end()) {
      at->second->samples.push_back(row.sample);
    }
  }
  table_.metadata = table.metadata;
  is_opening_ = false;
  changeTable();
}

void Workbench::onPlace(int place, const std::vector<Node>& nodes, const std::vector<Sample>& samples) {
  if (static_cast<std::size_t>(place) >= places_.size()) return;
  places_[static_cast<std::size_t>(place)].rows = nodes;
  places_[static_cast<std::size_t>(place)].samples = samples;
  changeTable();
}

void Workbench::changeTable() {
  table_is_stale_ = true;
  ++rows_version_;
  refusal_.clear();
  if (!table_timer_.isActive()) {
    table_timer_.start(static_cast<int>(kTableInterval_ms * static_cast<double>(places_.size())));
  }
}

const CalibrationTable& Workbench::table() const {
  if (!table_is_stale_) return table_;
  table_is_stale_ = false;
  table_.nodes.clear();
  for (const PlaceRows& place : places_)
    for (const Node& row : place.rows)
      if (!chosen_sensor_ || row.sensor == *chosen_sensor_) table_.nodes.push_back(row);
  return table_;
}

CalibrationTable Workbench::recordedTable() const {
  CalibrationTable all{table_.metadata, {}};
  for (const PlaceRows& place : places_) all.nodes.insert(all.nodes.end(), place.rows.begin(), place.rows.end());
  return all;
}

std::vector<int> Workbench::sensors() const { return sensorsOf(recordedTable()); }

void Workbench::chooseSensor(std::optional<int> sensor) {
  if (chosen_sensor_ == sensor) return;
  comparison_jobs_.stop();
  chosen_sensor_ = sensor;
  refusal_.clear();
  endCondition(QStringLiteral("session/table"));
  comparison_.reset();
  table_is_stale_ = true;
  ++rows_version_;
  emit comparisonChanged();
  emit tableChanged();
}

bool Workbench::mayUse(const CalibrationTable& table, const std::function<void()>& then) {
  refusal_.clear();
  endCondition(QStringLiteral("session/table"));
  if (const auto units = recording::checkUnits(table); !units && !uses_any_units_) {
    refuse(units.error().message, tr("Use anyway"), [this, then, path = session_path_] {
      if (path != session_path_) return;
      uses_any_units_ = true;
      refusal_.clear();
      emit tableChanged();
      if (then) then();
    });
  }
  return refusal_.isEmpty();
}

void Workbench::refuse(const std::string& why, const QString& action_label, std::function<void()> action) {
  refusal_ = QString::fromStdString(why) + QLatin1Char('.');
  refusal_[0] = refusal_[0].toUpper();
  showMessage({refusal_, Severity::kAttention, action_label, std::move(action), QStringLiteral("session/table")});
}

SampleTable Workbench::samples() const {
  SampleTable all{table_.metadata, {}};
  for (const PlaceRows& place : places_) {
    for (const Sample& sample : place.samples) all.rows.push_back({place.node, place.visit, sample});
  }
  all.rows.insert(all.rows.end(), loose_samples_.begin(), loose_samples_.end());
  return all;
}

SampleTable Workbench::samplesAt(int node) const {
  SampleTable some{table_.metadata, {}};
  for (const PlaceRows& place : places_) {
    if (place.node != node) continue;
    for (const Sample& sample : place.samples) some.rows.push_back({place.node, place.visit, sample});
  }
  return some;
}

}  // namespace fieldtrue::widgets
