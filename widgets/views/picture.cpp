#include "widgets/views/picture.h"

#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>

#include "widgets/views/camera.h"
#include "widgets/views/field_scene.h"
#include "widgets/views/histogram_scene.h"
#include "widgets/views/offscreen_gl.h"
#include "widgets/views/room_scene.h"

namespace fieldtrue {
namespace {

/// A picture of this height or width, whichever is relatively smaller, has text of the size it has on screen.
constexpr double kUsualWidth_px = 900.0;
constexpr double kUsualHeight_px = 560.0;
constexpr double kDotsPerInch = 72.0;

double ratioFor(QSize size) {
  const double ratio = std::min(size.width() / kUsualWidth_px, size.height() / kUsualHeight_px);
  return std::clamp(ratio, 0.75, 6.0);
}

QImage draw(QSize size, const std::function<std::shared_ptr<void>(vtkRenderer*)>& build, QString* why) {
  Result<QImage> image = drawOffscreen(size, static_cast<int>(std::lround(kDotsPerInch * ratioFor(size))), build);
  if (image) return *image;
  if (why != nullptr) *why = QString::fromStdString(image.error().message);
  return {};
}

template <class Scene>
void aim(Scene& scene, vtkRenderer* renderer, QSize size) {
  scene.update();
  const QMarginsF margins = QMarginsF(Scene::legendMargins()) * ratioFor(size);
  const ViewFrame frame{static_cast<double>(size.width()),
                        static_cast<double>(size.height()),
                        margins.left(),
                        margins.right(),
                        margins.top(),
                        margins.bottom()};
  apply(presetPose(CameraPreset::kOperator, scene.space(), frame), renderer->GetActiveCamera());
  scene.faceCamera();
  renderer->ResetCameraClippingRange();
}

}  // namespace

QImage renderFieldPicture(const ErrorField& field, double scale_max_mm, double magnification, QSize size, bool dark,
                          QString* why) {
  const auto build = [&](vtkRenderer* renderer) {
    auto scene = std::make_shared<FieldScene>(renderer);
    scene->setStyle(Theme::of(dark), ratioFor(size));
    scene->setField(field);
    scene->setScaleMax_mm(scale_max_mm);
    scene->setMagnification(magnification);
    aim(*scene, renderer, size);
    return scene;
  };
  return draw(size, build, why);
}

QImage renderRoomPicture(const std::vector<PlannedPlace>& places, const std::vector<PlaceState>& states,
                         const Pose& reference_from_tracker, QSize size, bool dark, QString* why) {
  const auto build = [&](vtkRenderer* renderer) {
    auto scene = std::make_shared<RoomScene>(renderer);
    scene->setStyle(Theme::of(dark), ratioFor(size));
    scene->setTransmitter(reference_from_tracker);
    scene->setPlaces(places);
    scene->setStates(states, std::nullopt);
    aim(*scene, renderer, size);
    return scene;
  };
  return draw(size, build, why);
}

QImage renderHistogramPicture(const std::vector<QString>& names, const std::vector<std::vector<double>>& values_mm,
                              const QString& axis_title, QSize size, bool dark, QString* why) {
  const auto build = [&](vtkRenderer* renderer) {
    auto scene = std::make_shared<HistogramScene>(renderer);
    scene->setStyle(Theme::of(dark), ratioFor(size));
    scene->setSeries(names, values_mm, axis_title);
    scene->update();
    return scene;
  };
  return draw(size, build, why);
}

}  // namespace fieldtrue
