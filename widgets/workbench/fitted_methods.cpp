#include "widgets/workbench/fitted_methods.h"

#include "calib/evaluation/sensor_splits.h"

namespace fieldtrue::widgets {

FittedMethods::FittedMethods(QObject* parent) : QObject(parent) {}

void FittedMethods::reset(const CalibrationTable& table, const std::optional<evaluation::Comparison>& comparison) {
  jobs_.stop();
  table_ = table;
  choices_.clear();
  fitted_.clear();
  why_.clear();
  running_.clear();
  if (!comparison) return;
  align_ = comparison->align;
  for (const evaluation::MethodScore& score : comparison->position) {
    calibration::CorrectorChoice& choice = choices_.emplace_back();
    choice.position_id = score.method;
    choice.position_settings = score.settings;
  }
}

std::shared_ptr<const calibration::Corrector> FittedMethods::get(std::size_t row) {
  const auto fitted = fitted_.find(row);
  if (fitted != fitted_.end()) return fitted->second;
  if (row < choices_.size() && !running_.contains(row) && !why_.contains(row)) start(row);
  return nullptr;
}

QString FittedMethods::why(std::size_t row) const {
  const auto why = why_.find(row);
  return why == why_.end() ? QString() : why->second;
}

void FittedMethods::stop() {
  if (running_.empty()) return;
  jobs_.stop();
  for (const std::size_t row : running_) why_[row] = tr("The fit was stopped; compare again to fit it.");
  running_.clear();
  emit changed();
}

void FittedMethods::start(std::size_t row) {
  running_.insert(row);
  jobs_.run(
      [rows = evaluation::fitRowsOf(table_), metadata = table_.metadata, choice = choices_[row], align = align_](
          const RunControl& control) { return calibration::Corrector::fit(rows, metadata, choice, align, control); },
      [this, row](Result<calibration::Corrector> result) { arrived(row, std::move(result)); });
}

void FittedMethods::arrived(std::size_t row, Result<calibration::Corrector> result) {
  running_.erase(row);
  if (result)
    fitted_[row] = std::make_shared<const calibration::Corrector>(std::move(*result));
  else
    why_[row] = QString::fromStdString(result.error().message);
  emit changed();
}

}  // namespace fieldtrue::widgets
