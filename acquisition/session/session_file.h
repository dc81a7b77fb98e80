#pragma once

#include <QSqlDatabase>
#include <QSqlError>
#include <QSqlQuery>
#include <QString>
#include <QTemporaryDir>
#include <QVariantList>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// The open database of one session: connection, lock, durability and errors in words. Use from one thread.
///
/// Held with SQLite's exclusive lock, which the system drops when a program dies, so a second program is kept out and a
/// crash leaves nothing to clean up. The file is never opened beside SQLite: closing a second descriptor of a file
/// drops the POSIX locks of the whole process.
///
/// The file itself says whether it is open: what a crash left is told from a copy made without its `-wal`. Where the
/// file or its folder cannot be written to, a private copy of it and of its `-wal` is opened, and nothing is stored.
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
  bool isReadOnly() const { return copy_ != nullptr; }  ///< Nothing can be stored: it is open as a private copy.
  /// What whoever opened it should know, one sentence each.
  const std::vector<std::string>& remarks() const { return remarks_; }
  /// The file is gone on with as it is: that its newest rows may be elsewhere is said no more.
  void goOnAsItIs() { lacks_wal_ = false; }

  /// Runs one prepared statement with positional values.
  Result<QSqlQuery> run(const QString& sql, const QVariantList& values = {}) const;
  /// Runs one statement for each of the rows of values.
  Result<void> runForAll(const QString& sql, const std::vector<QVariantList>& rows) const;
  /// Hands every row of a query to `row`. An error in the middle of the rows is an error: what came before it is no
  /// answer.
  Result<void> read(const QString& sql, const QVariantList& values,
                    const std::function<void(const QSqlQuery&)>& row) const;
  /// Runs the body between BEGIN and COMMIT; on any error nothing of it stays.
  Result<void> transaction(const std::function<Result<void>()>& body);
  /// The one sentence for an error of the database.
  Error explain(const QSqlError& error) const;

 private:
  explicit SessionFile(QString path);
  Result<void> connect();
  Result<void> checkIdentity() const;
  Result<void> hold();
  Result<void> createTables();
  Result<void> addWhatIsNew();
  Result<void> openWhereItIs();
  Result<void> openCopy();
  Result<bool> saysItIsOpen() const;
  Result<void> sayWhetherOpen(bool open) const;
  void disconnect() const;

  QString path_;
  QString opened_path_;  ///< The file itself, or its private copy.
  QString connection_;
  std::unique_ptr<QTemporaryDir> copy_;
  std::vector<std::string> remarks_;
  bool held_ = false;
  bool lacks_wal_ = false;  ///< It was open when it was copied, and its `-wal` did not come with it.
};

}  // namespace fieldtrue::acquisition
