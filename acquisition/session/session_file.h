#pragma once

#include <QSqlDatabase>
#include <QSqlError>
#include <QSqlQuery>
#include <QString>
#include <QVariantList>
#include <functional>
#include <memory>

#include "calib/core/error.h"

namespace fieldtrue {

/// The open database of one session: connection, lock, durability and errors in words. Use from one thread.
///
/// Held with SQLite's exclusive lock, which the system drops when a program dies, so a second program is kept out and a
/// crash leaves nothing to clean up. The file is never opened beside SQLite: closing a second descriptor of a file
/// drops the POSIX locks of the whole process.
class SessionFile {
 public:
  /// Makes a new file with the tables. @error kIo
  static Result<std::unique_ptr<SessionFile>> create(const QString& path);
  /// @error kIo; kBadInput when it is not a session or damaged; kNewerVersion
  static Result<std::unique_ptr<SessionFile>> open(const QString& path);
  ~SessionFile();  ///< Back to one file: checkpoint, no journal, lock released.
  SessionFile(const SessionFile&) = delete;
  SessionFile& operator=(const SessionFile&) = delete;

  const QString& path() const { return path_; }

  /// Runs one prepared statement with positional values.
  Result<QSqlQuery> run(const QString& sql, const QVariantList& values = {}) const;
  /// Runs the body between BEGIN and COMMIT; on any error nothing of it stays.
  Result<void> transaction(const std::function<Result<void>()>& body);
  /// The one sentence for an error of the database.
  Error explain(const QSqlError& error) const;

 private:
  explicit SessionFile(QString path);
  Result<void> connect();
  Result<void> checkIdentity() const;
  Result<void> hold() const;
  Result<void> createTables();

  QString path_;
  QString connection_;
  bool held_ = false;
};

}  // namespace fieldtrue
