#include "widgets/guide/guide.h"

#include <QFile>
#include <QRegularExpression>
#include <algorithm>

// Static libraries drop resources nobody names, and Q_INIT_RESOURCE must stand outside of namespaces.
static void initGuide() { Q_INIT_RESOURCE(guide); }

namespace fieldtrue::widgets {
namespace {

QString readPage(const QString& id) {
  initGuide();
  QFile file(QStringLiteral(":/guide/%1.md").arg(id));
  FT_CHECK(file.open(QIODevice::ReadOnly));
  return QString::fromUtf8(file.readAll());
}

std::vector<GuidePage> pagesOfIndex() {
  static const QRegularExpression link(QStringLiteral("\\[([^\\]]+)\\]\\(([a-z-]+)\\.md\\)"));
  std::vector<GuidePage> pages{{QString::fromLatin1(kGuideIndex), QStringLiteral("Guide")}};
  for (auto found = link.globalMatch(readPage(pages.front().id)); found.hasNext();) {
    const QRegularExpressionMatch match = found.next();
    const QString id = match.captured(2);
    const bool is_new = std::none_of(pages.begin(), pages.end(), [&](const GuidePage& page) { return page.id == id; });
    if (is_new) pages.push_back({id, match.captured(1)});
  }
  return pages;
}

}  // namespace

const std::vector<GuidePage>& guidePages() {
  static const std::vector<GuidePage> pages = pagesOfIndex();
  return pages;
}

Result<QString> guideText(const QString& id) {
  QString known;
  for (const GuidePage& page : guidePages()) {
    if (page.id == id) return readPage(id);
    known += (known.isEmpty() ? QString() : QStringLiteral(", ")) + page.id;
  }
  return fail(ErrorCode::kBadInput,
              "the guide has no page '" + id.toStdString() + "'; there are: " + known.toStdString());
}

}  // namespace fieldtrue::widgets
