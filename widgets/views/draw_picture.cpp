#include "widgets/views/draw_picture.h"

#include <vtkRenderer.h>

#include <QBuffer>
#include <algorithm>
#include <cmath>

#include "widgets/views/charts/histogram_scene.h"
#include "widgets/views/field/field_scene.h"
#include "widgets/views/host/camera.h"
#include "widgets/views/host/offscreen_gl.h"
#include "widgets/views/room/room_scene.h"

namespace fieldtrue::widgets {
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

QImage render(const FieldPicture& picture, QSize size, bool dark, QString* why) {
  const auto build = [&](vtkRenderer* renderer) {
    auto scene = std::make_shared<FieldScene>(renderer);
    scene->setStyle(Theme::of(dark), ratioFor(size));
    scene->setField(picture.field);
    scene->setScaleMax_mm(picture.scale_max_mm);
    scene->setMagnification(picture.magnification);
    aim(*scene, renderer, size);
    return scene;
  };
  return draw(size, build, why);
}

QImage render(const RoomPicture& picture, QSize size, bool dark, QString* why) {
  const auto build = [&](vtkRenderer* renderer) {
    auto scene = std::make_shared<RoomScene>(renderer);
    scene->setStyle(Theme::of(dark), ratioFor(size));
    scene->setTransmitter(picture.reference_from_tracker);
    scene->setPlaces(picture.places);
    scene->setStates(picture.states, std::nullopt);
    aim(*scene, renderer, size);
    return scene;
  };
  return draw(size, build, why);
}

QImage render(const HistogramPicture& picture, QSize size, bool dark, QString* why) {
  const auto build = [&](vtkRenderer* renderer) {
    auto scene = std::make_shared<HistogramScene>(renderer);
    scene->setStyle(Theme::of(dark), ratioFor(size));
    scene->setSeries(picture.names, picture.values_mm, picture.axis_title);
    scene->update();
    return scene;
  };
  return draw(size, build, why);
}

QByteArray pngBytes(const QImage& image) {
  QByteArray png;
  QBuffer buffer(&png);
  buffer.open(QIODevice::WriteOnly);
  image.save(&buffer, "PNG");
  return png;
}

}  // namespace

QImage renderPicture(const PictureRequest& request, QString* why) {
  const QSize size(request.width_px, request.height_px);
  return std::visit([&](const auto& content) { return render(content, size, request.dark, why); }, request.content);
}

std::vector<Result<QByteArray>> drawPictures(std::span<const PictureRequest> requests) {
  std::vector<Result<QByteArray>> drawn;
  for (const PictureRequest& request : requests) {
    QString why = QStringLiteral("no reason given");
    const QImage image = renderPicture(request, &why);
    if (image.isNull())
      drawn.push_back(fail(ErrorCode::kUnsupported, why.toStdString()));
    else
      drawn.push_back(pngBytes(image));
  }
  return drawn;
}

}  // namespace fieldtrue::widgets
