#include "tests/support/test_main.h"

#include <QFile>
#include <QTest>
#include <QXmlStreamReader>
#include <algorithm>
#include <cstdio>
#include <optional>

namespace fieldtrue::testing {
namespace {

struct Skip {
  QString what;
  QString why;
};

/// The arguments with a second log in XML. QTest drops "-o name" and "-xml" beside an "-o name,format", so those two
/// become one of that kind first.
QStringList withXmlLog(const QStringList& given, const QString& xml_path) {
  const QStringList formats = {"-txt", "-csv", "-junitxml", "-xml", "-lightxml", "-teamcity", "-tap"};
  QStringList kept;
  QString name = "-";
  QString format = "txt";
  bool named_format = false;
  for (qsizetype k = 0; k < given.size(); ++k) {
    if (k > 0 && formats.contains(given[k])) {
      format = given[k].mid(1);
    } else if (k > 0 && given[k] == "-o" && k + 1 < given.size()) {
      const QString& target = given[++k];
      if (target.contains(',')) {
        named_format = true;
        kept << "-o" << target;
      } else {
        name = target;
      }
    } else {
      kept << given[k];
    }
  }
  if (!named_format) kept << "-o" << name + "," + format;
  return kept << "-o" << xml_path + ",xml";
}

/// Control characters in a message of a test would end the reading of the log.
QString readableXml(const QByteArray& log) {
  QString text = QString::fromUtf8(log);
  for (QChar& c : text) {
    if (c < QChar(' ') && c != '\n' && c != '\t') c = '?';
  }
  return text;
}

/// What QTest's XML log calls skipped; nothing when the log is broken.
std::optional<QList<Skip>> skipsIn(const QByteArray& log) {
  QList<Skip> skips;
  QString test_case;
  QString function;
  bool in_skip = false;
  QXmlStreamReader xml(readableXml(log));
  while (!xml.atEnd()) {
    xml.readNext();
    if (!xml.isStartElement()) continue;
    const QString name = xml.attributes().value("name").toString();
    if (xml.name() == u"TestCase") test_case = name;
    if (xml.name() == u"TestFunction") function = test_case + "::" + name;
    if (xml.attributes().hasAttribute("type")) {
      in_skip = xml.attributes().value("type") == u"skip";
      if (in_skip) skips.push_back({function, {}});
    } else if (in_skip && xml.name() == u"DataTag") {
      skips.back().what += "(" + xml.readElementText() + ")";
    } else if (in_skip && xml.name() == u"Description") {
      skips.back().why = xml.readElementText().simplified();
    }
  }
  if (xml.hasError()) return std::nullopt;
  return skips;
}

void saySkipped(const QString& what, const QString& why) {
  std::fprintf(stderr, "SKIPPED %s: %s\n", qPrintable(what), qPrintable(why));
}

}  // namespace

int runTest(QObject& test, int argc, char** argv) {
  // A file without a name: nothing is left behind, however QTest ends the program.
  std::FILE* const log = std::tmpfile();
  if (!log) {
    std::fprintf(stderr, "No temporary file can be made for the log of the test; make room in /tmp\n");
    return 1;
  }
  const QString log_path = QStringLiteral("/proc/self/fd/%1").arg(fileno(log));
  QStringList arguments;
  for (int k = 0; k < argc; ++k) arguments << QString::fromLocal8Bit(argv[k]);
  const int failures = QTest::qExec(&test, withXmlLog(arguments, log_path));
  QFile written;
  const bool readable = written.open(log, QIODevice::ReadOnly) && written.seek(0);
  const auto skips = readable ? skipsIn(written.readAll()) : std::nullopt;
  written.close();
  std::fclose(log);
  if (!skips) std::fprintf(stderr, "The log of the test cannot be read, so its skips are not known\n");
  const QList<Skip> known = skips.value_or(QList<Skip>());
  for (const Skip& skip : known) saySkipped(skip.what, skip.why);
  if (failures != 0 || !skips) return 1;
  return known.isEmpty() ? 0 : kSkippedStatus;
}

int skipProgram(const char* why) {
  saySkipped("all of it", QString::fromLocal8Bit(why));
  return kSkippedStatus;
}

}  // namespace fieldtrue::testing
