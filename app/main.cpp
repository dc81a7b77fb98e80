#include <QCommandLineParser>
#include <QFileInfo>
#include <QIcon>
#include <QTimer>
#include <algorithm>
#include <array>
#include <clocale>
#include <string_view>

#include "calib/core/file_io.h"
#include "calib/core/memory_limit.h"
#include "widgets/shell/application.h"
#include "widgets/shell/main_window.h"
#include "widgets/style/theme.h"
#include "widgets/views/host/gl_format.h"

namespace {

const QString kDemo = QStringLiteral("demo"), kDark = QStringLiteral("dark"), kLight = QStringLiteral("light");

void describe(QCommandLineParser& parser) {
  QCoreApplication::setApplicationName(QStringLiteral("fieldtrue"));
  QCoreApplication::setApplicationVersion(QStringLiteral(FIELDTRUE_VERSION));
  parser.setApplicationDescription(QCoreApplication::tr("Calibrates electromagnetic trackers."));
  parser.addHelpOption();
  parser.addVersionOption();
  parser.addPositionalArgument(QStringLiteral("session"),
                               QCoreApplication::tr("Session file (*.fieldtrue) to open where it was, or a file of "
                                                    "another program to import."),
                               QStringLiteral("[session]"));
  parser.addOptions({{kDemo, QCoreApplication::tr("Run the demonstration with the simulated tracker.")},
                     {kDark, QCoreApplication::tr("Dark colours, whatever the desktop uses.")},
                     {kLight, QCoreApplication::tr("Light colours, whatever the desktop uses.")}});
}

/// Help and version need no display.
bool asksForWords(int argc, char** argv) {
  constexpr std::array<std::string_view, 5> kWords = {"-h", "--help", "--help-all", "-v", "--version"};
  return std::any_of(argv + 1, argv + argc, [&](const char* one) {
    return std::find(kWords.begin(), kWords.end(), std::string_view(one)) != kWords.end();
  });
}

}  // namespace

int main(int argc, char** argv) {
  QCommandLineParser parser;
  describe(parser);
  if (asksForWords(argc, argv)) {
    const QCoreApplication without_display(argc, argv);
    parser.process(without_display);
  }
  fieldtrue::outliveFileSizeLimit();
  fieldtrue::keepFreedMemory();
  fieldtrue::widgets::setDefaultGlFormat();
  fieldtrue::widgets::Application application(argc, argv);
  // Qt takes over the desktop's locale; printf must keep the decimal point that files and messages are written with.
  std::setlocale(LC_NUMERIC, "C");
  parser.process(application);

  const bool use_dark = parser.isSet(kDark) || (!parser.isSet(kLight) && fieldtrue::widgets::systemPrefersDark());
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
    if (parser.isSet(kDemo)) {
      window.workbench().startDemonstration();
    } else if (!sessions.isEmpty()) {
      const QString& file = sessions.first();
      const bool is_session = QFileInfo(file).suffix() == QLatin1String("fieldtrue");
      is_session ? window.workbench().openSession(file) : window.workbench().importFile(file);
    }
  });
  return QApplication::exec();
}
