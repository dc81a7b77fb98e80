#pragma once

#include <QWidget>
#include <optional>
#include <vector>

#include "calib/calibration/corrector.h"
#include "calib/exporters/imported_calibration.h"
#include "calib/importers/column_guess.h"
#include "calib/importers/importer.h"
#include "calib/importers/text_table.h"
#include "widgets/workbench/background.h"
#include "widgets/workbench/workbench.h"

class QComboBox;
class QGridLayout;
class QLabel;
class QLineEdit;
class QPushButton;

namespace fieldtrue::widgets {

class ColumnTable;
class SettingsForm;

/// Other programs' files: a recording becomes a session, a calibration one of this program's. The format is found by
/// reading; of a table of text the columns and the unit are guessed and shown with its first rows.
class ImportPage : public QWidget {
  Q_OBJECT
 public:
  explicit ImportPage(Workbench& workbench, QWidget* parent = nullptr);
  /// A session is opened instead.
  void setFile(const QString& path);

 private:
  /// A row of the list of formats: one or the other.
  struct Format {
    const importers::Importer* recording = nullptr;
    const exporters::CalibrationFormat* calibration = nullptr;
  };
  /// What a look at a file told.
  struct Look {
    int format = 0;
    std::optional<importers::ColumnGuess> guess;
    std::optional<importers::TextPreview> preview;
  };
  /// What reading gave; one of them.
  struct Read {
    std::optional<importers::Import> recording;
    std::optional<calibration::Corrector> calibration;
  };

  QLineEdit* addFileRow(QGridLayout* grid, int row, const QString& label, const char* name,
                        void (ImportPage::*choose)());
  void fillFormats();
  void chooseFile();
  void chooseTruth();
  void chooseTarget();
  void look(std::optional<int> format);
  void onLook(Result<Look> found);
  void showFormat(const Look& found);
  void onHowItIsWritten();
  void read();
  void onRead(Result<Read> result);
  void showRecording(const importers::Import& recording);
  void tell(const QString& summary, bool is_attention);
  bool canMake() const;
  void showMake();
  void make();
  void makeSession(const QString& path);
  void writeCalibration(const QString& path);
  const Format& format() const;
  bool readsColumns() const;
  Settings settings() const;
  QString suggestedTarget() const;

  Workbench& workbench_;
  BackgroundJobs looking_{this};
  BackgroundJobs reading_{this};
  BackgroundJobs making_{this};
  std::vector<Format> formats_;
  Read read_;
  QString guess_text_;
  QLineEdit* file_;
  QComboBox* format_;
  QLabel* truth_label_ = nullptr;
  QLineEdit* truth_;
  QPushButton* truth_button_ = nullptr;
  ColumnTable* columns_;
  SettingsForm* form_;
  QLabel* guess_;
  QLabel* summary_;
  QLabel* target_label_ = nullptr;
  QLineEdit* target_;
  QPushButton* make_;
};

}  // namespace fieldtrue::widgets
