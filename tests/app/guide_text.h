#pragma once

#include <QDir>
#include <QFileInfo>
#include <QRegularExpression>
#include <QStringList>
#include <vector>

#include "tests/app/cli_program.h"

/// The README and the pages of the guide, as files of the project.
namespace fieldtrue::testing {

inline QString projectPath(const QString& relative) {
  return QDir::cleanPath(QStringLiteral(FIELDTRUE_RESOURCES "/../") + relative);
}

/// README.md and resources/guide/*.md.
inline QStringList documents() {
  QStringList paths{projectPath(QStringLiteral("README.md"))};
  const QDir guide(projectPath(QStringLiteral("resources/guide")));
  for (const QString& name : guide.entryList({QStringLiteral("*.md")}, QDir::Files, QDir::Name))
    paths << guide.filePath(name);
  return paths;
}

/// A fenced block of a page.
struct CodeBlock {
  int line = 0;
  QString mark;  ///< What follows the fence: "sh run".
  QString text;
};

inline std::vector<CodeBlock> codeBlocks(const QString& path) {
  std::vector<CodeBlock> blocks;
  bool is_open = false;
  int number = 0;
  for (const QString& line : QString::fromUtf8(readWhole(path)).split(QLatin1Char('\n'))) {
    ++number;
    if (line.startsWith(QLatin1String("```"))) {
      is_open = !is_open;
      if (is_open) blocks.push_back({number, line.mid(3).trimmed(), {}});
    } else if (is_open) {
      blocks.back().text += line + QLatin1Char('\n');
    }
  }
  return blocks;
}

/// Commands of a block, one a line, continued lines joined.
inline QStringList commandsOf(const CodeBlock& block) {
  QString text = block.text;
  return text.replace(QRegularExpression(QStringLiteral("\\\\\\n\\s*")), QString())
      .split(QLatin1Char('\n'), Qt::SkipEmptyParts);
}

}  // namespace fieldtrue::testing
