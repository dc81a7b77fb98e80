#include <QCommandLineParser>
#include <QIcon>
#include <QTimer>
#include <clocale>

#include "calib/core/file_io.h"
#include "calib/core/memory_limit.h"
#include "widgets/shell/application.h"
#include "widgets/shell/main_window.h"
#include "widgets/style/theme.h"
#include "widgets/views/host/gl_format.h"

int main(int argc, char** argv) {
  fieldtrue::outliveFileSizeLimit();
  fieldtrue::keepFreedMemory();
  fieldtrue::widgets::setDefaultGlFormat();
  fieldtrue::widgets::Application application(argc, argv);
  // Qt takes over the desktop's locale; printf must keep the decimal point that files and messages are written with.
  std::setlocale(LC_NUMERIC, "C");
  QApplication::setApplicationName(QStringLiteral("fieldtrue"));
  QApplication::setApplicationVersion(QStringLiteral(FIELDTRUE_VERSION));

  QCommandLineParser parser;
  parser.setApplicationDescription(QApplication::tr("Calibrates electromagnetic trackers."));
  parser.addHelpOption();
  parser.addVersionOption();
  parser.addPositionalArgument(QStringLiteral("session"),
                               QApplication::tr("Session file (*.fieldtrue) to open where it was."),
                               QStringLiteral("[session]"));
  const QCommandLineOption demo(QStringLiteral("demo"),
                                QApplication::tr("Run the demonstration with the simulated tracker."));
  const QCommandLineOption dark(QStringLiteral("dark"), QApplication::tr("Dark colours, whatever the desktop uses."));
  const QCommandLineOption light(QStringLiteral("light"),
                                 QApplication::tr("Light colours, whatever the desktop uses."));
  parser.addOptions({demo, dark, light});
  parser.process(application);

  const bool use_dark = parser.isSet(dark) || (!parser.isSet(light) && fieldtrue::widgets::systemPrefersDark());
  fieldtrue::widgets::applyTheme(application, use_dark);
  QApplication::setWindowIcon(QIcon(QStringLiteral(":/fieldtrue.svg")));
  fieldtrue::widgets::MainWindow window;
  QObject::connect(&application, &fieldtrue::widgets::Application::threw, &window.workbench(),
                   [&window](const QString& sentence) {
                     window.workbench().showMessage({sentence, fieldtrue::widgets::Severity::kDanger, {}, {}});
                   });
  window.show();
  window.activateWindow();
  const QStringList sessions = parser.positionalArguments();
  QTimer::singleShot(0, &window, [&] {
    if (parser.isSet(demo)) {
      window.workbench().startDemonstration();
    } else if (!sessions.isEmpty()) {
      window.workbench().openSession(sessions.first());
    }
  });
  return QApplication::exec();
}
