#include "widgets/shell/application.h"

#include "calib/core/exception_barrier.h"

namespace fieldtrue::widgets {

bool Application::notify(QObject* receiver, QEvent* event) {
  const Result<bool> handled =
      withBarrier("what is stored stands", [&] { return QApplication::notify(receiver, event); });
  if (!handled) emit threw(QString::fromStdString(handled.error().message));
  return handled.value_or(false);
}

}  // namespace fieldtrue::widgets
