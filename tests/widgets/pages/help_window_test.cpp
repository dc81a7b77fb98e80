// Help in the real window: F1 and the button open the guide at the page of the step on screen; its links and its list
// lead from page to page; it reads in light and dark.

#include "widgets/shell/help_window.h"

#include <QApplication>
#include <QImage>
#include <QListWidget>
#include <QTest>
#include <QTextTable>
#include <QToolButton>
#include <memory>

#include "tests/widgets/window_test.h"
#include "widgets/guide/guide.h"
#include "widgets/shell/main_window.h"
#include "widgets/style/theme.h"

namespace fieldtrue::widgets {

class HelpWindowTest : public QObject {
  Q_OBJECT

 private slots:
  void init();
  void cleanup();
  void f1OpensThePageOfTheStep_data();
  void f1OpensThePageOfTheStep();
  void theButtonOpensItToo();
  void linksLeadToOtherPages();
  void theListShowsEveryPage();
  void linksOutOfTheGuideAreNotDead();
  void picturesFitTheWindow();
  void readsInLightAndDark();

 private:
  HelpWindow* help() const { return window_->findChild<HelpWindow*>(); }
  GuideBrowser* browser() const { return help()->findChild<GuideBrowser*>(); }
  QListWidget* list() const { return help()->findChild<QListWidget*>(QStringLiteral("helpPages")); }
  /// Whether Help is there afterwards.
  bool openAt(const QString& page);
  /// Leaves a picture where FIELDTRUE_ARTEFACTS asks for it.
  void picture(const QString& name) const;

  std::unique_ptr<MainWindow> window_;
};

void HelpWindowTest::init() {
  applyTheme(*qApp, false);
  window_ = std::make_unique<MainWindow>();
  window_->show();
  window_->activateWindow();
  QVERIFY(QTest::qWaitForWindowExposed(window_.get()));
}

void HelpWindowTest::cleanup() { window_.reset(); }

bool HelpWindowTest::openAt(const QString& page) {
  window_->workbench().goToPage(page);
  window_->activateWindow();
  if (!QTest::qWaitFor([this] { return window_->isActiveWindow(); })) return false;
  QTest::keyClick(window_.get(), Qt::Key_F1);
  return help() != nullptr;
}

void HelpWindowTest::picture(const QString& name) const {
  if (!qEnvironmentVariableIsSet("FIELDTRUE_ARTEFACTS")) return;
  QTest::qWait(400);
  help()->grab().save(QStringLiteral("%1/help-%2.png").arg(qEnvironmentVariable("FIELDTRUE_ARTEFACTS"), name));
}

void HelpWindowTest::f1OpensThePageOfTheStep_data() {
  QTest::addColumn<QString>("page");
  QTest::addColumn<QString>("guide");
  const auto row = [](const char* page, const char* guide) {
    QTest::newRow(page) << QString::fromLatin1(page) << QString::fromLatin1(guide);
  };
  row("start", "index");
  row("connect", "trackers");
  row("plan", "recording");
  row("acquire", "recording");
  row("compare", "comparing");
  row("gap", "diagnosis");
  row("export", "export");
}

void HelpWindowTest::f1OpensThePageOfTheStep() {
  QFETCH(QString, page);
  QFETCH(QString, guide);
  QVERIFY(openAt(page));
  QVERIFY(help()->isVisible());
  QCOMPARE(help()->pageId(), guide);
  QVERIFY(list()->currentItem() != nullptr);
  QCOMPARE(list()->currentItem()->data(Qt::UserRole).toString(), guide);
  // Every page begins with its title.
  const QString title = guideText(guide)->section(QLatin1Char('\n'), 0, 0).mid(2);
  QCOMPARE(browser()->document()->begin().text(), title);
}

void HelpWindowTest::theButtonOpensItToo() {
  QTest::mouseClick(window_->findChild<QToolButton*>(QStringLiteral("helpButton")), Qt::LeftButton);
  QVERIFY(help() != nullptr && help()->isVisible());
  QCOMPARE(help()->pageId(), QStringLiteral("index"));
}

void HelpWindowTest::linksLeadToOtherPages() {
  QVERIFY(openAt(QStringLiteral("start")));
  emit browser()->anchorClicked(QUrl(QStringLiteral("methods.md")));
  QCOMPARE(help()->pageId(), QStringLiteral("methods"));
  emit browser()->anchorClicked(QUrl(QStringLiteral("diagnosis.md")));
  QCOMPARE(help()->pageId(), QStringLiteral("diagnosis"));
  emit browser()->anchorClicked(QUrl(QStringLiteral("nowhere.md")));
  QCOMPARE(help()->pageId(), QStringLiteral("diagnosis"));
}

void HelpWindowTest::theListShowsEveryPage() {
  QVERIFY(openAt(QStringLiteral("start")));
  QCOMPARE(list()->count(), static_cast<int>(guidePages().size()));
  QVERIFY(list()->count() > 10);
  for (int row = 0; row < list()->count(); ++row) {
    list()->setCurrentRow(row);
    QCOMPARE(help()->pageId(), guidePages()[static_cast<std::size_t>(row)].id);
    QVERIFY(browser()->document()->characterCount() > 500);
  }
}

void HelpWindowTest::linksOutOfTheGuideAreNotDead() {
  QVERIFY(openAt(QStringLiteral("start")));
  for (const GuidePage& page : guidePages()) {
    help()->showPage(page.id);
    QVERIFY2(!browser()->toHtml().contains(QStringLiteral("href=\"../../")), qPrintable(page.id));
  }
}

void HelpWindowTest::picturesFitTheWindow() {
  QVERIFY(openAt(QStringLiteral("compare")));
  help()->resize(700, 600);
  const auto widest = [this] { return browser()->document()->idealWidth(); };
  QTRY_VERIFY(browser()->document()->isEmpty() == false && widest() > 0);
  const QVariant found = browser()->document()->resource(QTextDocument::ImageResource,
                                                         QUrl(QStringLiteral("../pictures/compare-two.png")));
  QVERIFY(found.isValid());
  QTRY_VERIFY(browser()
                  ->document()
                  ->resource(QTextDocument::ImageResource, QUrl(QStringLiteral("../pictures/compare-two.png")))
                  .value<QImage>()
                  .width() <= browser()->viewport()->width());
  picture(QStringLiteral("narrow"));
}

void HelpWindowTest::readsInLightAndDark() {
  QVERIFY(openAt(QStringLiteral("gap")));
  for (const bool dark : {false, true}) {
    applyTheme(*qApp, dark);
    for (const GuidePage& page : guidePages()) {
      help()->showPage(page.id);
      // Words and their ground are the theme's: the palette draws both.
      QCOMPARE(browser()->palette().color(QPalette::Text), theme().text);
      QCOMPARE(browser()->palette().color(QPalette::Base), theme().surface);
      for (QTextFrame* frame : browser()->document()->rootFrame()->childFrames())
        if (const auto* table = qobject_cast<QTextTable*>(frame))
          QCOMPARE(table->format().borderBrush().color(), theme().line);
      picture((dark ? QStringLiteral("dark-") : QStringLiteral("light-")) + page.id);
    }
  }
}

}  // namespace fieldtrue::widgets

FIELDTRUE_WINDOW_TEST(fieldtrue::widgets::HelpWindowTest)
#include "help_window_test.moc"
