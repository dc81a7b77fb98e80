#include "widgets/forms/length_box.h"

#include <QSignalBlocker>
#include <algorithm>

#include "widgets/style/unit_texts.h"

namespace fieldtrue::widgets {
namespace {

constexpr double kUsuallyAtMost = 100000.0;  ///< In the unit shown.

}  // namespace

LengthBox::LengthBox(double metres, LengthUnit unit, QWidget* parent)
    : NumberBox(parent), metres_(metres), unit_(unit) {
  setRange(-kUsuallyAtMost, kUsuallyAtMost);
  display();
  connect(this, &QDoubleSpinBox::valueChanged, this, [this](double value) { metres_ = value * metresPer(unit_); });
}

void LengthBox::setMetres(double metres) {
  metres_ = metres;
  display();
}

void LengthBox::setUnit(LengthUnit unit) {
  unit_ = unit;
  display();
}

void LengthBox::display() {
  const QSignalBlocker quiet(this);
  const double value = metres_ / metresPer(unit_);
  setDecimals(enteredDecimals(unit_));
  setRange(std::min(minimum(), value), std::max(maximum(), value));
  setValue(value);
}

}  // namespace fieldtrue::widgets
