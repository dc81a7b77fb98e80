#pragma once

#include <QDir>
#include <QTemporaryDir>
#include <QTest>
#include <QThreadPool>
#include <memory>

#include "tests/widgets/session_fixture.h"
#include "tests/widgets/window_test.h"
#include "widgets/shell/main_window.h"
#include "widgets/style/theme.h"

namespace fieldtrue::testing {

/// The longest that a slow machine may take for what a page does in the background.
constexpr int kWaitMs = 240000;

/// A widget by its name, which must be there.
template <class T>
T* find(QWidget& in, const char* name) {
  T* widget = in.findChild<T*>(QString::fromLatin1(name));
  if (!widget) qFatal("no widget named %s", name);
  return widget;
}

/// What tests of the whole window share: the window, a folder of their own, and widgets by their names.
class WindowDriver : public QObject {
 protected:
  template <class T>
  T* find(const char* name) {
    return testing::find<T>(*window_, name);
  }
  void click(const char* name) { QTest::mouseClick(find<QWidget>(name), Qt::LeftButton); }
  /// The window, with settings and sessions in the test's own folder.
  void showWindow() {
    keepIn(folder_);
    widgets::applyTheme(*qApp, qEnvironmentVariableIsSet("FIELDTRUE_DARK"));
    window_ = std::make_unique<widgets::MainWindow>();
    window_->resize(1280, 800);
    window_->show();
    QVERIFY(QTest::qWaitForWindowExposed(window_.get()));
  }
  void closeWindow() {
    QThreadPool::globalInstance()->waitForDone();
    window_.reset();
  }
  /// Keeps a picture of the window where pictures are asked for.
  void picture(const QString& name) {
    const QString folder = qEnvironmentVariable("FIELDTRUE_ARTEFACTS");
    if (folder.isEmpty()) return;
    QVERIFY(QDir().mkpath(folder));
    QTest::qWait(400);
    QVERIFY(window_->grab().save(folder + QLatin1Char('/') + name + QStringLiteral(".png")));
  }
  bool onPage(const QString& name) { return find<QWidget>(qPrintable(name))->isVisible(); }

  QTemporaryDir folder_;
  std::unique_ptr<widgets::MainWindow> window_;
};

}  // namespace fieldtrue::testing
