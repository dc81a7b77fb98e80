#include "widgets/views/host/scene_font.h"

#include <vtkTextProperty.h>

#include <QDirIterator>
#include <QStandardPaths>
#include <QStringList>
#include <string>

namespace fieldtrue::widgets {
namespace {

std::string findFont(const QStringList& names) {
  QStringList folders = QStandardPaths::standardLocations(QStandardPaths::FontsLocation);
  folders << QStringLiteral("/usr/share/fonts");
  for (const QString& name : names)
    for (const QString& folder : folders)
      if (QDirIterator found(folder, {name}, QDir::Files, QDirIterator::Subdirectories); found.hasNext())
        return found.next().toStdString();
  return {};
}

const std::string& fontFile(bool bold) {
  static const std::string regular =
      findFont({QStringLiteral("DejaVuSans.ttf"), QStringLiteral("NotoSans-Regular.ttf")});
  static const std::string strong =
      findFont({QStringLiteral("DejaVuSans-Bold.ttf"), QStringLiteral("NotoSans-Bold.ttf")});
  return bold ? strong : regular;
}

}  // namespace

void setFont(vtkTextProperty* text, bool bold) {
  text->SetItalic(false);
  if (const std::string& file = fontFile(bold); !file.empty()) {
    text->SetFontFamily(VTK_FONT_FILE);
    text->SetFontFile(file.c_str());
    text->SetBold(false);
    return;
  }
  text->SetFontFamilyToArial();
  text->SetBold(bold);
}

}  // namespace fieldtrue::widgets
