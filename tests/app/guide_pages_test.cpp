#include <QDirIterator>
#include <QMultiMap>
#include <QTest>

#include "tests/app/guide_text.h"
#include "tests/support/test_main.h"

/// What README and guide point at is there, and what they quote of the code stands in it.
using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

constexpr int kWidestLine = 130;

QString textOf(const QString& path) { return QString::fromUtf8(readWhole(path)); }

QRegularExpressionMatchIterator linksOf(const QString& text) {
  static const QRegularExpression link(QStringLiteral("\\]\\(([^)#\\s]+)(#[^)]*)?\\)"));
  return link.globalMatch(text);
}

/// Every source file in folders of the project by its name; names that several folders have, all of them.
QMultiMap<QString, QString> filesByName(std::initializer_list<const char*> folders) {
  QMultiMap<QString, QString> found;
  const QDir root(projectPath(QString()));
  for (const char* folder : folders) {
    QDirIterator files(root.filePath(QLatin1String(folder)), {QStringLiteral("*.cpp"), QStringLiteral("*.h")},
                       QDir::Files, QDirIterator::Subdirectories);
    while (files.hasNext()) {
      const QString path = files.next();
      found.insert(QFileInfo(path).fileName(), path);
    }
  }
  return found;
}

QMultiMap<QString, QString> sourcesByName() { return filesByName({"calib", "acquisition", "widgets", "app"}); }

QStringList codeSpans(const QString& cell) {
  static const QRegularExpression span(QStringLiteral("`([^`]+)`"));
  QStringList spans;
  for (auto found = span.globalMatch(cell); found.hasNext();) spans << found.next().captured(1);
  return spans;
}

}  // namespace

class GuidePagesTest : public QObject {
  Q_OBJECT
 private slots:
  void everyLinkAndPictureIsThere_data() { addDocuments(); }
  void everyLinkAndPictureIsThere() {
    QFETCH(QString, path);
    const QDir folder = QFileInfo(path).absoluteDir();
    for (auto links = linksOf(textOf(path)); links.hasNext();) {
      const QString target = links.next().captured(1);
      if (target.startsWith(QLatin1String("http"))) continue;
      QVERIFY2(QFileInfo::exists(folder.filePath(target)), qPrintable(target));
    }
  }

  /// Tables and pictures may be wider: they cannot be broken.
  void linesAreNotTooWide_data() { addDocuments(); }
  void linesAreNotTooWide() {
    QFETCH(QString, path);
    for (const QString& line : textOf(path).split(QLatin1Char('\n'))) {
      if (line.startsWith(QLatin1Char('|')) || line.startsWith(QLatin1String("!["))) continue;
      QVERIFY2(line.size() <= kWidestLine, qPrintable(line));
    }
  }

  /// `some_test someFunction` on the page of the trackers' checks: that function of that test.
  void everyTestThatIsNamedIsThere() {
    static const QRegularExpression named(QStringLiteral("`([a-z_]+_test)(?:\\s+([A-Za-z]+))?`"));
    const QMultiMap<QString, QString> tests = filesByName({"tests"});
    int n_named = 0;
    const QString page = textOf(projectPath("resources/guide/tracker-checks.md"));
    for (auto names = named.globalMatch(page); names.hasNext(); ++n_named) {
      const QRegularExpressionMatch name = names.next();
      const QStringList files = tests.values(name.captured(1) + ".cpp");
      QVERIFY2(files.size() == 1, qPrintable(name.captured(0)));
      QVERIFY2(name.captured(2).isEmpty() || textOf(files.front()).contains(" " + name.captured(2) + "()"),
               qPrintable(name.captured(0)));
    }
    QVERIFY2(n_named > 50, qPrintable(QString::number(n_named)));
  }

  void everyPageIsInIndexAndResources() {
    const QString index = textOf(projectPath("resources/guide/index.md"));
    const QString resources = textOf(projectPath("resources/guide.qrc"));
    for (const QString& path : documents().mid(1)) {
      const QString name = QFileInfo(path).fileName();
      QVERIFY2(name == QLatin1String("index.md") || index.contains("](" + name + ")"), qPrintable(name));
      QVERIFY2(resources.contains("<file>guide/" + name + "</file>"), qPrintable(name));
    }
  }

  void everyPictureOfThePagesIsInResources() {
    const QString resources = textOf(projectPath("resources/pictures.qrc"));
    for (const QString& path : documents().mid(1)) {
      for (auto links = linksOf(textOf(path)); links.hasNext();) {
        const QString target = links.next().captured(1);
        if (target.endsWith(QLatin1String(".png")))
          QVERIFY2(resources.contains("<file>" + QString(target).remove("../") + "</file>"), qPrintable(target));
      }
    }
  }

  /// A row of a table of constants: names, values and the file in which they stand so.
  void constantsStandInTheCode_data() {
    QTest::addColumn<QString>("name");
    QTest::addColumn<QString>("value");
    QTest::addColumn<QString>("file");
    for (const QString& line : textOf(projectPath("resources/guide/diagnosis-mathematics.md")).split('\n')) {
      const QStringList cells = line.split(QLatin1Char('|'));
      if (cells.size() != 6) continue;
      const QStringList names = codeSpans(cells.at(1));
      const QStringList values = codeSpans(cells.at(2));
      const QStringList files = codeSpans(cells.at(4));
      if (names.isEmpty() || files.size() != 1) continue;
      for (int i = 0; i < names.size(); ++i)
        QTest::newRow(qPrintable(names.at(i) + " in " + files.first()))
            << names.at(i) << values.value(i) << files.first();
    }
  }
  void constantsStandInTheCode() {
    QFETCH(QString, name);
    QFETCH(QString, value);
    QFETCH(QString, file);
    static const QMultiMap<QString, QString> sources = sourcesByName();
    QVERIFY2(sources.contains(file), "there is no such file");
    const QRegularExpression definition(QStringLiteral("\\b%1 = %2[;,]").arg(name, QRegularExpression::escape(value)));
    bool is_there = false;
    for (const QString& path : sources.values(file)) is_there = is_there || definition.match(textOf(path)).hasMatch();
    QVERIFY2(is_there, qPrintable(name + " is not " + value + " there"));
  }

 private:
  static void addDocuments() {
    QTest::addColumn<QString>("path");
    for (const QString& path : documents()) QTest::newRow(qPrintable(QFileInfo(path).fileName())) << path;
  }
};

FIELDTRUE_TEST(GuidePagesTest)
#include "guide_pages_test.moc"
