#pragma once

#include <QTemporaryDir>

namespace fieldtrue::testing {

/// A folder of a test's own with a new path for every session.
class SessionFolder : public QTemporaryDir {
 public:
  QString newPath() { return filePath(QStringLiteral("%1.fieldtrue").arg(++n_sessions_)); }

 private:
  int n_sessions_ = 0;
};

}  // namespace fieldtrue::testing
