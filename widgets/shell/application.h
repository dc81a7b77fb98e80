#pragma once

#include <QApplication>

namespace fieldtrue::widgets {

/// The application object with the exception barrier around every event: what a slot throws is told in a sentence, and
/// the program goes on. Qt itself cannot carry an exception through its event loop.
class Application : public QApplication {
  Q_OBJECT
 public:
  using QApplication::QApplication;
  bool notify(QObject* receiver, QEvent* event) override;

 signals:
  /// May come from any thread.
  void threw(const QString& sentence);
};

}  // namespace fieldtrue::widgets
