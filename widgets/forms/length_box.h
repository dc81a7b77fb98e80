#pragma once

#include "widgets/forms/number_box.h"
#include "widgets/style/units.h"

namespace fieldtrue::widgets {

/// A field for a length that keeps its metres: in another unit, or shown with fewer decimals, it is the same length.
/// Only what a person enters changes it. A length beyond the field's ends widens them.
class LengthBox : public NumberBox {
 public:
  LengthBox(double metres, LengthUnit unit, QWidget* parent = nullptr);
  double metres() const { return metres_; }
  void setMetres(double metres);  ///< Without valueChanged.
  void setUnit(LengthUnit unit);  ///< Without valueChanged.

 private:
  void display();

  double metres_;
  LengthUnit unit_;
};

}  // namespace fieldtrue::widgets
