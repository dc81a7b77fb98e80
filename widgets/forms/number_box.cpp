#include "widgets/forms/number_box.h"

#include <QLocale>
#include <QRegularExpression>
#include <algorithm>
#include <cmath>

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

/// The number in a field's text.
QString bare(QString text, const QString& prefix, const QString& suffix) {
  if (!prefix.isEmpty() && text.startsWith(prefix)) text.remove(0, prefix.size());
  if (!suffix.isEmpty() && text.endsWith(suffix)) text.chop(suffix.size());
  return text.trimmed().replace(QLatin1Char(','), QLatin1Char('.'));
}

}  // namespace

NumberBox::NumberBox(QWidget* parent) : QDoubleSpinBox(parent) { setLocale(plainLocale()); }

QValidator::State NumberBox::validate(QString& text, int&) const {
  if (!specialValueText().isEmpty() && text == specialValueText()) return QValidator::Acceptable;
  const QString number = bare(text, prefix(), suffix());
  bool is_number = false;
  const double value = QLocale::c().toDouble(number, &is_number);
  if (is_number && value >= minimum() && value <= maximum()) return QValidator::Acceptable;
  return is_number || mayBecomeNumber(number) ? QValidator::Intermediate : QValidator::Invalid;
}

void NumberBox::fixup(QString& text) const {
  bool is_number = false;
  const double value = QLocale::c().toDouble(bare(text, prefix(), suffix()), &is_number);
  if (is_number) text = prefix() + textFromValue(std::clamp(value, minimum(), maximum())) + suffix();
}

double NumberBox::valueFromText(const QString& text) const {
  if (!specialValueText().isEmpty() && text == specialValueText()) return minimum();
  return QLocale::c().toDouble(bare(text, prefix(), suffix()));
}

CountBox::CountBox(QWidget* parent) : QSpinBox(parent) { setLocale(plainLocale()); }

QValidator::State CountBox::validate(QString& text, int& pos) const {
  // Qt would read 3,5 as 35 with a mark between its groups of digits.
  const bool has_mark = text.contains(QLatin1Char(',')) || text.contains(QLatin1Char('.'));
  if (has_mark && mayBecomeNumber(text)) return QValidator::Intermediate;
  // Of a number that is too large Qt would take the digits that fit, 10 of 100.
  const QValidator::State state = QSpinBox::validate(text, pos);
  return state == QValidator::Invalid && mayBecomeNumber(bare(text, prefix(), suffix())) ? QValidator::Intermediate
                                                                                         : state;
}

void CountBox::fixup(QString& text) const {
  bool is_number = false;
  const double value = QLocale::c().toDouble(bare(text, prefix(), suffix()), &is_number);
  const bool is_whole = is_number && value == std::floor(value);
  if (is_whole)
    text = prefix() + textFromValue(static_cast<int>(std::clamp<double>(value, minimum(), maximum()))) + suffix();
}

}  // namespace fieldtrue::widgets
