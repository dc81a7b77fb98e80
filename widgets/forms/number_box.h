#pragma once

#include <QDoubleSpinBox>
#include <QSpinBox>

namespace fieldtrue::widgets {

/// A field for a number. Point and comma both stand before the decimals, 1e-3 is a number, whatever the desktop's
/// language; what is no number yet stays as it was typed, instead of losing the mark that made it wrong.
class NumberBox : public QDoubleSpinBox {
 public:
  explicit NumberBox(QWidget* parent = nullptr);
  QValidator::State validate(QString& text, int& pos) const override;
  double valueFromText(const QString& text) const override;

 private:
  QString bare(const QString& text) const;
};

/// A field for a whole number: 3,5 stays as typed and is 3 when the field is left, instead of becoming 35.
class CountBox : public QSpinBox {
 public:
  explicit CountBox(QWidget* parent = nullptr);
  QValidator::State validate(QString& text, int& pos) const override;
  void fixup(QString&) const override {}  ///< Qt's own takes the marks out.
};

}  // namespace fieldtrue::widgets
