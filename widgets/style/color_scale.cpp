#include "widgets/style/color_scale.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "widgets/style/theme.h"

namespace fieldtrue::widgets {
namespace {

/// Ten equally spaced colours of viridis.
constexpr std::array<QRgb, 10> kControlColors = {0x440154, 0x482878, 0x3e4989, 0x31688e, 0x26828e,
                                                 0x1f9e89, 0x35b779, 0x6ece58, 0xb5de2b, 0xfde725};
constexpr QRgb kUnknown = 0x9a9a9a;
constexpr QRgb kLess = 0x1f66b5;
constexpr QRgb kEven = 0xb4b4b4;
constexpr QRgb kMore = 0xc65a00;

}  // namespace

QColor mixed(const QColor& a, const QColor& b, double share_of_b) {
  const auto mix = [share_of_b](int x, int y) { return static_cast<int>(std::lround(x + share_of_b * (y - x))); };
  return QColor(mix(a.red(), b.red()), mix(a.green(), b.green()), mix(a.blue(), b.blue()));
}

QColor magnitudeColor(double fraction) {
  if (std::isnan(fraction)) return QColor(kUnknown);
  const double along = std::clamp(fraction, 0.0, 1.0) * (kControlColors.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(along), kControlColors.size() - 2);
  const double share = along - static_cast<double>(below);
  return mixed(QColor(kControlColors[below]), QColor(kControlColors[below + 1]), share);
}

QColor differenceColor(double fraction) {
  if (std::isnan(fraction)) return QColor(kUnknown);
  return mixed(QColor(kEven), QColor(fraction < 0.0 ? kLess : kMore), std::min(std::abs(fraction), 1.0));
}

}  // namespace fieldtrue::widgets
