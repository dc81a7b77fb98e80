#include "widgets/shell/help_window.h"

#include <QDesktopServices>
#include <QFile>
#include <QFileInfo>
#include <QHBoxLayout>
#include <QImage>
#include <QListWidget>
#include <QRegularExpression>
#include <QScrollBar>
#include <QTextBlock>
#include <QTextTable>
#include <algorithm>

#include "widgets/guide/guide.h"
#include "widgets/style/theme.h"

// Static libraries drop resources nobody names, and Q_INIT_RESOURCE must stand outside of namespaces.
static void initPictures() { Q_INIT_RESOURCE(pictures); }

namespace fieldtrue::widgets {
namespace {

constexpr int kListWidth = 220;
constexpr int kMargin = 24;
constexpr int kReloadAfterMs = 150;

QUrl urlOf(const QString& id) { return QUrl(QStringLiteral("qrc:/guide/%1.md").arg(id)); }

QString idOf(const QUrl& url) { return QFileInfo(url.path()).completeBaseName(); }

bool isPage(const QUrl& url) {
  const auto& pages = guidePages();
  return url.path().endsWith(QLatin1String(".md")) &&
         std::any_of(pages.begin(), pages.end(), [id = idOf(url)](const GuidePage& page) { return page.id == id; });
}

/// Files of the project beside the guide are named, but are not there to be opened.
QString withoutOuterLinks(QString markdown) {
  static const QRegularExpression link(QStringLiteral("\\[([^\\]]+)\\]\\(\\.\\./\\.\\./[^)]*\\)"));
  return markdown.replace(link, QStringLiteral("\\1"));
}

/// A picture, or its twin for dark desktops where there is one.
QImage pictureOf(const QUrl& url) {
  initPictures();
  const QString stem = QStringLiteral(":/pictures/") + QFileInfo(url.path()).completeBaseName();
  const QString dark = stem + QStringLiteral("-dark.png");
  return QImage(theme().dark && QFile::exists(dark) ? dark : stem + QStringLiteral(".png"));
}

void styleTable(QTextTable& table) {
  QTextTableFormat format = table.format();
  format.setBorderCollapse(true);
  format.setBorder(1);
  format.setBorderBrush(theme().line);
  format.setBorderStyle(QTextFrameFormat::BorderStyle_Solid);
  format.setCellPadding(5);
  format.setCellSpacing(0);
  format.setTopMargin(4);
  format.setBottomMargin(12);
  table.setFormat(format);
}

void styleBlock(const QTextBlock& block) {
  QTextCursor cursor(block);
  QTextBlockFormat format = block.blockFormat();
  if (format.hasProperty(QTextFormat::BlockCodeFence) || format.hasProperty(QTextFormat::BlockCodeLanguage)) {
    format.setBackground(theme().background);
    format.setNonBreakableLines(true);
    format.setLeftMargin(8);
  } else if (format.headingLevel() > 1) {
    format.setTopMargin(18);
    format.setBottomMargin(6);
  } else if (cursor.currentTable() == nullptr && cursor.currentList() == nullptr) {
    format.setBottomMargin(8);
  }
  cursor.setBlockFormat(format);
}

}  // namespace

GuideBrowser::GuideBrowser(QWidget* parent) : QTextBrowser(parent) {
  setObjectName(QStringLiteral("helpText"));
  setAccessibleName(tr("Page of the guide"));
  setOpenLinks(false);
  document()->setDocumentMargin(kMargin);
  resized_.setSingleShot(true);
  resized_.setInterval(kReloadAfterMs);
  connect(&resized_, &QTimer::timeout, this, &GuideBrowser::reloadInPlace);
  connect(this, &QTextBrowser::anchorClicked, this, &GuideBrowser::followLink);
  connect(this, &QTextBrowser::sourceChanged, this, &GuideBrowser::style);
  connect(&themeNotifier(), &ThemeNotifier::themeChanged, this, &GuideBrowser::reloadInPlace);
}

void GuideBrowser::showPage(const QString& id) { setSource(urlOf(id), QTextDocument::MarkdownResource); }

QVariant GuideBrowser::loadResource(int type, const QUrl& name) {
  if (type == QTextDocument::MarkdownResource) {
    page_ = idOf(name);
    const auto text = guideText(page_);
    return text ? withoutOuterLinks(*text).toUtf8() : QByteArray();
  }
  if (type != QTextDocument::ImageResource) return QTextBrowser::loadResource(type, name);
  const QImage picture = pictureOf(name);
  width_ = viewport()->width();
  const int room = std::max(200, width_ - 2 * kMargin - 8);
  return picture.width() > room ? picture.scaledToWidth(room, Qt::SmoothTransformation) : picture;
}

void GuideBrowser::resizeEvent(QResizeEvent* event) {
  QTextBrowser::resizeEvent(event);
  if (width_ != 0 && width_ != viewport()->width()) resized_.start();
}

void GuideBrowser::reloadInPlace() {
  const int at = verticalScrollBar()->value();
  document()->clear();  // Pictures that were loaded for another width or theme.
  reload();
  verticalScrollBar()->setValue(at);
}

void GuideBrowser::followLink(const QUrl& url) {
  if (isPage(url)) {
    showPage(idOf(url));
  } else if (url.scheme().startsWith(QLatin1String("http"))) {
    QDesktopServices::openUrl(url);
  }
}

void GuideBrowser::style() {
  for (QTextBlock block = document()->begin(); block.isValid(); block = block.next()) styleBlock(block);
  for (QTextFrame* frame : document()->rootFrame()->childFrames())
    if (auto* table = qobject_cast<QTextTable*>(frame)) styleTable(*table);
}

HelpWindow::HelpWindow(QWidget* parent) : QDialog(parent) {
  setObjectName(QStringLiteral("helpWindow"));
  setWindowTitle(tr("Guide - Fieldtrue"));
  resize(1260, 820);  // Room for code of 130 columns.
  list_ = new QListWidget(this);
  list_->setObjectName(QStringLiteral("helpPages"));
  list_->setAccessibleName(tr("Pages of the guide"));
  list_->setFixedWidth(kListWidth);
  list_->setWordWrap(true);
  list_->setSpacing(3);
  for (const GuidePage& page : guidePages()) {
    auto* item = new QListWidgetItem(page.title, list_);
    item->setData(Qt::UserRole, page.id);
  }
  browser_ = new GuideBrowser(this);
  auto* columns = new QHBoxLayout(this);
  columns->setContentsMargins(12, 12, 12, 12);
  columns->setSpacing(12);
  columns->addWidget(list_);
  columns->addWidget(browser_, 1);
  connect(list_, &QListWidget::currentItemChanged, this, [this](const QListWidgetItem* item) {
    if (item != nullptr && item->data(Qt::UserRole).toString() != pageId())
      browser_->showPage(item->data(Qt::UserRole).toString());
  });
  connect(browser_, &QTextBrowser::sourceChanged, this, &HelpWindow::markPage);
}

void HelpWindow::showPage(const QString& id) {
  browser_->showPage(id);
  browser_->setFocus();
}

void HelpWindow::markPage() {
  for (int row = 0; row < list_->count(); ++row)
    if (list_->item(row)->data(Qt::UserRole).toString() == pageId()) list_->setCurrentRow(row);
}

}  // namespace fieldtrue::widgets
