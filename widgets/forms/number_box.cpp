#include "widgets/forms/number_box.h"

#include <QLocale>
#include <QRegularExpression>

namespace fieldtrue::widgets {
namespace {

QLocale plainLocale() {
  QLocale locale = QLocale::c();
  locale.setNumberOptions(QLocale::OmitGroupSeparator | QLocale::RejectGroupSeparator);
  return locale;
}

/// What may be on its way to a number.
bool mayBecomeNumber(const QString& text) {
  static const QRegularExpression digits_and_marks(QStringLiteral("^[-+0-9.,eE]*$"));
  return digits_and_marks.match(text).hasMatch();
}

}  // namespace

NumberBox::NumberBox(QWidget* parent) : QDoubleSpinBox(parent) { setLocale(plainLocale()); }

QString NumberBox::bare(const QString& text) const {
  QString number = text;
  if (!prefix().isEmpty() && number.startsWith(prefix())) number.remove(0, prefix().size());
  if (!suffix().isEmpty() && number.endsWith(suffix())) number.chop(suffix().size());
  return number.trimmed().replace(QLatin1Char(','), QLatin1Char('.'));
}

QValidator::State NumberBox::validate(QString& text, int&) const {
  if (!specialValueText().isEmpty() && text == specialValueText()) return QValidator::Acceptable;
  const QString number = bare(text);
  bool is_number = false;
  const double value = QLocale::c().toDouble(number, &is_number);
  if (is_number && value >= minimum() && value <= maximum()) return QValidator::Acceptable;
  return is_number || mayBecomeNumber(number) ? QValidator::Intermediate : QValidator::Invalid;
}

double NumberBox::valueFromText(const QString& text) const {
  if (!specialValueText().isEmpty() && text == specialValueText()) return minimum();
  return QLocale::c().toDouble(bare(text));
}

CountBox::CountBox(QWidget* parent) : QSpinBox(parent) { setLocale(plainLocale()); }

QValidator::State CountBox::validate(QString& text, int& pos) const {
  // Qt would read 3,5 as 35 with a mark between its groups of digits.
  const bool has_mark = text.contains(QLatin1Char(',')) || text.contains(QLatin1Char('.'));
  return has_mark && mayBecomeNumber(text) ? QValidator::Intermediate : QSpinBox::validate(text, pos);
}

}  // namespace fieldtrue::widgets
