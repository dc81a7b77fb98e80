#pragma once

#include <QTemporaryDir>
#include <QTest>
#include <memory>

#include "tests/widgets/window_test.h"
#include "widgets/shell/main_window.h"

namespace fieldtrue::testing {

/// What tests of the whole window share: the window, a folder of their own, and widgets by their names.
class WindowDriver : public QObject {
 protected:
  template <class T>
  T* find(const char* name) {
    T* widget = window_->findChild<T*>(QString::fromLatin1(name));
    if (!widget) qFatal("no widget named %s", name);
    return widget;
  }
  void click(const char* name) { QTest::mouseClick(find<QWidget>(name), Qt::LeftButton); }
  bool onPage(const QString& name) { return find<QWidget>(qPrintable(name))->isVisible(); }

  QTemporaryDir folder_;
  std::unique_ptr<widgets::MainWindow> window_;
};

}  // namespace fieldtrue::testing
