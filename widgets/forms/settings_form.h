#pragma once

#include <QWidget>
#include <span>
#include <vector>

#include "calib/core/settings.h"

class QFormLayout;

namespace fieldtrue::widgets {

/// Draws any list of settings as a form. Emits changed when a value is edited.
class SettingsForm : public QWidget {
  Q_OBJECT
 public:
  explicit SettingsForm(QWidget* parent = nullptr);
  /// @param declared what to draw; values start at `values`, or at the defaults for keys not in it
  void setSettings(std::span<const Setting> declared, const Settings& values = {});
  Settings values() const;

 signals:
  void changed();

 private:
  QWidget* makeEditor(const Setting& setting, const SettingValue& value);
  QFormLayout* layout_;
  std::vector<Setting> declared_;
  std::vector<QWidget*> editors_;
};

}  // namespace fieldtrue::widgets
