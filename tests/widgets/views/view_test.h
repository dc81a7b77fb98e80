#pragma once

#include <QApplication>
#include <QColor>
#include <QImage>
#include <QTest>
#include <algorithm>
#include <cstdlib>
#include <vector>

#include "acquisition/session/session_store.h"
#include "tests/support/test_main.h"
#include "widgets/figures/error_field.h"
#include "widgets/style/theme.h"
#include "widgets/views/host/gl_format.h"

namespace fieldtrue::widgets::test {

inline bool hasDisplay() { return QGuiApplication::platformName() != QLatin1String("offscreen"); }

/// Pixels of a colour within a tolerance per channel, in part of a picture (all of it by default).
inline int countColor(const QImage& image, const QColor& color, int tolerance = 3, QRect part = {}) {
  if (part.isNull()) part = image.rect();
  part = part.intersected(image.rect());
  int count = 0;
  for (int y = part.top(); y <= part.bottom(); ++y) {
    for (int x = part.left(); x <= part.right(); ++x) {
      const QRgb pixel = image.pixel(x, y);
      const int off = std::max({std::abs(qRed(pixel) - color.red()), std::abs(qGreen(pixel) - color.green()),
                                std::abs(qBlue(pixel) - color.blue())});
      if (off <= tolerance) ++count;
    }
  }
  return count;
}

/// A 3 x 3 x 3 grid of 0.3 m pitch in front of the transmitter.
inline std::vector<PlannedPlace> gridPlaces() {
  std::vector<PlannedPlace> places;
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) {
        PlannedPlace place;
        place.node = static_cast<int>(places.size());
        place.index = std::array<int, 3>{i, j, k};
        place.reference_from_sensor.position_m = Eigen::Vector3d(0.4 + 0.3 * i, -0.3 + 0.3 * j, 0.3 * k);
        places.push_back(place);
      }
    }
  }
  return places;
}

/// The same error at every place of the grid.
inline ErrorField uniformField(const Eigen::Vector3d& error_m, const QString& title = {}) {
  ErrorField field;
  field.title = title;
  for (const PlannedPlace& place : gridPlaces()) {
    FieldArrow arrow;
    arrow.from_m = place.reference_from_sensor.position_m;
    arrow.error_m = error_m;
    arrow.node = place.node;
    arrow.name = QStringLiteral("P%1").arg(place.node);
    field.arrows.push_back(arrow);
  }
  return field;
}

/// Runs a test object of the views: the surface format set first, and a platform without a display where there is none.
template <class Test>
int runViewTest(int argc, char** argv) {
  if (!qEnvironmentVariableIsSet("DISPLAY") && !qEnvironmentVariableIsSet("WAYLAND_DISPLAY"))
    qputenv("QT_QPA_PLATFORM", "offscreen");
  setDefaultGlFormat();
  QApplication application(argc, argv);
  applyTheme(application, false);
  Test test;
  return fieldtrue::testing::runTest(test, argc, argv);
}

}  // namespace fieldtrue::widgets::test

#define VIEW_TEST(Test) FIELDTRUE_TEST_PROGRAM(::fieldtrue::widgets::test::runViewTest<Test>)
