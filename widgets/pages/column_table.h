#pragma once

#include <QTableWidget>
#include <string>
#include <vector>

#include "calib/core/settings.h"
#include "calib/importers/text_table.h"

namespace fieldtrue::widgets {

/// The first rows of a table of text, and above each column a choice of what it is.
class ColumnTable : public QTableWidget {
  Q_OBJECT
 public:
  explicit ColumnTable(QWidget* parent = nullptr);
  /// @param roles settings that name a column
  /// @param chosen their values; other keys are left alone
  void setTable(const importers::TextPreview& preview, const std::vector<Setting>& roles, const Settings& chosen);
  /// The roles' values: each the name of a column, or blank.
  Settings values() const;

 signals:
  void changed();

 private:
  void onChosen(int column);
  std::vector<Setting> roles_;
  std::vector<std::string> columns_;
};

}  // namespace fieldtrue::widgets
