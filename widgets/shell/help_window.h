#pragma once

#include <QDialog>
#include <QTextBrowser>
#include <QTimer>

#include "widgets/workbench/workbench.h"

class QListWidget;

namespace fieldtrue::widgets {

/// A page of the guide, its pictures as wide as there is room for and in the theme's colours.
class GuideBrowser : public QTextBrowser {
  Q_OBJECT
 public:
  explicit GuideBrowser(QWidget* parent = nullptr);
  void showPage(const QString& id);
  const QString& pageId() const { return page_; }

  QVariant loadResource(int type, const QUrl& name) override;

 protected:
  void resizeEvent(QResizeEvent* event) override;

 private:
  void reloadInPlace();
  void followLink(const QUrl& url);
  void style();

  QString page_;  ///< Which QTextBrowser::source() still lacks while it tells that the page changed.
  QTimer resized_;
  int width_ = 0;  ///< For which the pictures were made.
};

/// The guide in a window of its own: the pages at the left, one of them at the right.
class HelpWindow : public QDialog {
  Q_OBJECT
 public:
  explicit HelpWindow(QWidget* parent = nullptr);
  void showPage(const QString& id);
  const QString& pageId() const { return browser_->pageId(); }

 private:
  void markPage();

  QListWidget* list_;
  GuideBrowser* browser_;
};

}  // namespace fieldtrue::widgets
