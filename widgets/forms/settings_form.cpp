#include "widgets/forms/settings_form.h"

#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QLineEdit>
#include <QSpinBox>
#include <algorithm>
#include <cmath>

#include "widgets/forms/number_box.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kFewestDecimals = 4;
constexpr int kMostDecimals = 12;
constexpr double kUnbounded = 1e9;
constexpr double kWide = 1e3;  ///< From this ratio of range to smallest value on, steps follow the value's size.
constexpr const char* kGiven = "given_value";
constexpr const char* kShown = "shown_value";

/// Decimals that show the smallest number a setting starts or ends with to three figures.
int decimalsOf(const Setting& setting, double value) {
  int decimals = kFewestDecimals;
  for (const double number : {setting.min, value})
    if (number != 0.0 && std::isfinite(number))
      decimals = std::max(decimals, 2 - static_cast<int>(std::floor(std::log10(std::abs(number)))));
  return std::min(decimals, kMostDecimals);
}

QDoubleSpinBox* makeNumber(const Setting& setting, double value, bool may_be_automatic) {
  auto* box = new NumberBox;
  const bool bounded = setting.min != 0.0 || setting.max != 0.0;
  const double low = bounded ? setting.min : -kUnbounded, high = bounded ? setting.max : kUnbounded;
  box->setDecimals(setting.whole ? 0 : decimalsOf(setting, value));
  double step = setting.whole ? 1.0 : std::pow(10.0, std::floor(std::log10(std::max(1e-3, high - low))) - 1.0);
  if (!setting.whole && (!bounded || (low > 0.0 && high / low > kWide))) {
    box->setStepType(QAbstractSpinBox::AdaptiveDecimalStepType);
    step = std::pow(10.0, -box->decimals());
  }
  box->setRange(may_be_automatic ? low - step : low, high);
  box->setSingleStep(step);
  if (!setting.unit.empty()) box->setSuffix(QStringLiteral(" ") + QString::fromStdString(setting.unit));
  if (may_be_automatic) box->setSpecialValueText(QObject::tr("automatic"));
  box->setValue(value);
  // What nobody edits is given back to the last bit.
  box->setProperty(kGiven, value);
  box->setProperty(kShown, box->value());
  return box;
}

double numberOf(const QDoubleSpinBox* box) {
  const double value = box->value();
  return value == box->property(kShown).toDouble() ? box->property(kGiven).toDouble() : value;
}

SettingValue readEditor(const Setting& setting, QWidget* editor) {
  switch (setting.type) {
    case SettingType::kBool:
      return static_cast<QCheckBox*>(editor)->isChecked();
    case SettingType::kInteger:
      return std::int64_t{static_cast<QSpinBox*>(editor)->value()};
    case SettingType::kNumber:
      return numberOf(static_cast<QDoubleSpinBox*>(editor));
    case SettingType::kAutoNumber: {
      auto* box = static_cast<QDoubleSpinBox*>(editor);
      if (box->value() <= box->minimum()) return std::string("auto");
      return numberOf(box);
    }
    case SettingType::kChoice:
    case SettingType::kVector3:
    case SettingType::kMatrix3:
    case SettingType::kNumbers:
      break;
  }
  if (auto* combo = qobject_cast<QComboBox*>(editor)) return combo->currentText().toStdString();
  return valueOf(setting, static_cast<QLineEdit*>(editor)->text().toStdString()).value_or(setting.default_value);
}

}  // namespace

SettingsForm::SettingsForm(QWidget* parent) : QWidget(parent), layout_(new QFormLayout(this)) {
  layout_->setContentsMargins(0, 0, 0, 0);
}

void SettingsForm::setSettings(std::span<const Setting> declared, const Settings& values) {
  while (layout_->rowCount() > 0) layout_->removeRow(0);
  declared_.assign(declared.begin(), declared.end());
  editors_.clear();
  for (const Setting& setting : declared_) {
    const auto given = values.find(setting.key);
    QWidget* editor = makeEditor(setting, given == values.end() ? setting.default_value : given->second);
    editor->setToolTip(QString::fromStdString(setting.help));
    editor->setAccessibleName(QString::fromStdString(setting.label));
    editor->setObjectName(QStringLiteral("setting_") + QString::fromStdString(setting.key));
    layout_->addRow(QString::fromStdString(setting.label), editor);
    editors_.push_back(editor);
  }
  setVisible(!editors_.empty());
}

Settings SettingsForm::values() const {
  Settings values;
  for (std::size_t i = 0; i < declared_.size(); ++i) values[declared_[i].key] = readEditor(declared_[i], editors_[i]);
  return values;
}

QWidget* SettingsForm::makeEditor(const Setting& setting, const SettingValue& value) {
  switch (setting.type) {
    case SettingType::kBool: {
      auto* box = new QCheckBox;
      box->setChecked(std::get<bool>(value));
      connect(box, &QCheckBox::toggled, this, &SettingsForm::changed);
      return box;
    }
    case SettingType::kInteger: {
      auto* box = new CountBox;
      box->setRange(static_cast<int>(setting.min), static_cast<int>(setting.max));
      if (!setting.unit.empty()) box->setSuffix(QStringLiteral(" ") + QString::fromStdString(setting.unit));
      box->setValue(static_cast<int>(std::get<std::int64_t>(value)));
      connect(box, &QSpinBox::valueChanged, this, &SettingsForm::changed);
      return box;
    }
    case SettingType::kNumber:
    case SettingType::kAutoNumber: {
      const double* number = std::get_if<double>(&value);
      auto* box = makeNumber(setting, number ? *number : -2.0 * kUnbounded, setting.type == SettingType::kAutoNumber);
      connect(box, &QDoubleSpinBox::valueChanged, this, &SettingsForm::changed);
      return box;
    }
    case SettingType::kChoice:
    case SettingType::kVector3:
    case SettingType::kMatrix3:
    case SettingType::kNumbers:
      break;
  }
  const QString text = QString::fromStdString(textOf(value));
  if (setting.choices.empty()) {
    auto* edit = new QLineEdit(text);
    connect(edit, &QLineEdit::editingFinished, this, &SettingsForm::changed);
    return edit;
  }
  auto* combo = new QComboBox;
  for (const std::string& choice : setting.choices) combo->addItem(QString::fromStdString(choice));
  combo->setCurrentText(text);
  connect(combo, &QComboBox::currentTextChanged, this, &SettingsForm::changed);
  return combo;
}

}  // namespace fieldtrue::widgets
