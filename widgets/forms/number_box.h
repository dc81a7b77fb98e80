#pragma once

#include <QDoubleSpinBox>
#include <QSpinBox>

namespace fieldtrue::widgets {

/// A field for a number. Point and comma both stand before the decimals, 1e-3 is a number, whatever the desktop's
/// language; what is no number yet stays as it was typed, instead of losing the mark that made it wrong. A number
/// beyond the ends becomes the nearer end when the field is left.
class NumberBox : public QDoubleSpinBox {
 public:
  explicit NumberBox(QWidget* parent = nullptr);
  QValidator::State validate(QString& text, int& pos) const override;
  void fixup(QString& text) const override;
  double valueFromText(const QString& text) const override;
};

/// A field for a whole number: 3,5 stays as typed and is 3 when the field is left, instead of becoming 35; 1000 is the
/// largest number allowed then, instead of the digits of it that fit.
class CountBox : public QSpinBox {
 public:
  explicit CountBox(QWidget* parent = nullptr);
  QValidator::State validate(QString& text, int& pos) const override;
  void fixup(QString& text) const override;
};

}  // namespace fieldtrue::widgets
