#include "acquisition/session/session_file.h"

#include <QDir>
#include <QFile>
#include <QFileInfo>
#include <array>
#include <atomic>

namespace fieldtrue {

namespace {

constexpr int kFormatVersion = 1;
constexpr int kApplicationId = 0x46545255;  // "FTRU"

constexpr std::array kTables{
    "CREATE TABLE meta(key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID",
    "CREATE TABLE places(place INTEGER PRIMARY KEY, node INTEGER NOT NULL, visit INTEGER NOT NULL,"
    " i INTEGER, j INTEGER, k INTEGER, x_true_m REAL NOT NULL, y_true_m REAL NOT NULL, z_true_m REAL NOT NULL,"
    " qw_true REAL NOT NULL, qx_true REAL NOT NULL, qy_true REAL NOT NULL, qz_true REAL NOT NULL, role TEXT NOT NULL)",
    // undone: 0 stands, 1 taken back, 2 taken back and then overtaken by a new action.
    "CREATE TABLE actions(id INTEGER PRIMARY KEY, place INTEGER NOT NULL REFERENCES places(place),"
    " kind TEXT NOT NULL CHECK(kind IN ('take', 'skip')), reason TEXT NOT NULL, time_utc TEXT NOT NULL,"
    " undone INTEGER NOT NULL DEFAULT 0)",
    "CREATE INDEX actions_by_place ON actions(place, id)",
    "CREATE TABLE takes(action INTEGER PRIMARY KEY REFERENCES actions(id), sensor INTEGER NOT NULL,"
    " x_m REAL NOT NULL, y_m REAL NOT NULL, z_m REAL NOT NULL,"
    " qw REAL NOT NULL, qx REAL NOT NULL, qy REAL NOT NULL, qz REAL NOT NULL,"
    " cov_xx_m2 REAL NOT NULL, cov_yy_m2 REAL NOT NULL, cov_zz_m2 REAL NOT NULL,"
    " cov_xy_m2 REAL NOT NULL, cov_xz_m2 REAL NOT NULL, cov_yz_m2 REAL NOT NULL, sd_rot_rad REAL NOT NULL,"
    " autocorrelation REAL NOT NULL, n_effective REAL NOT NULL, quantum_m REAL NOT NULL, n_used INTEGER NOT NULL,"
    " n_rejected INTEGER NOT NULL, t_start_s REAL NOT NULL, t_end_s REAL NOT NULL)",
    "CREATE TABLE samples(action INTEGER NOT NULL REFERENCES takes(action), seq INTEGER NOT NULL, sensor INTEGER NOT "
    "NULL,"
    " t_s REAL NOT NULL, x_m REAL, y_m REAL, z_m REAL, qw REAL, qx REAL, qy REAL, qz REAL, status TEXT NOT NULL,"
    " rejected TEXT, PRIMARY KEY(action, seq)) WITHOUT ROWID",
    "CREATE TABLE events(id INTEGER PRIMARY KEY, time_utc TEXT NOT NULL, kind TEXT NOT NULL, text TEXT NOT NULL)",
    "CREATE TABLE fits(id INTEGER PRIMARY KEY, time_utc TEXT NOT NULL, name TEXT NOT NULL, ftcal TEXT NOT NULL)",
    "CREATE TABLE state(key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID",
};

/// SQLite's primary result codes that have a sentence of their own.
enum SqliteCode {
  kBusy = 5,
  kLocked = 6,
  kReadOnly = 8,
  kIoError = 10,
  kCorrupt = 11,
  kFull = 13,
  kCantOpen = 14,
  kNotADb = 26
};

QString newConnectionName() {
  static std::atomic<unsigned> number{0};
  return QStringLiteral("fieldtrue-session-%1").arg(number++);
}

Result<int> readPragma(const SessionFile& file, const char* name) {
  auto query = file.run(QStringLiteral("PRAGMA %1").arg(QLatin1String(name)));
  if (!query) return tl::unexpected(query.error());
  return query->next() ? query->value(0).toInt() : 0;
}

}  // namespace

SessionFile::SessionFile(QString path) : path_(std::move(path)), connection_(newConnectionName()) {}

SessionFile::~SessionFile() {
  if (held_) {
    (void)run(QStringLiteral("PRAGMA wal_checkpoint(TRUNCATE)"));
    (void)run(QStringLiteral("PRAGMA journal_mode=DELETE"));
  }
  QSqlDatabase::database(connection_, false).close();
  QSqlDatabase::removeDatabase(connection_);
}

Result<std::unique_ptr<SessionFile>> SessionFile::create(const QString& path) {
  const QFileInfo info(path);
  if (info.exists()) {
    return fail(ErrorCode::kIo, path.toStdString() + ": exists already; choose another name or open it");
  }
  if (!info.absoluteDir().exists()) {
    return fail(ErrorCode::kIo, path.toStdString() + ": there is no folder " + info.absolutePath().toStdString());
  }
  std::unique_ptr<SessionFile> file(new SessionFile(path));
  Result<void> made = file->connect();
  if (made) made = file->hold();
  if (made) made = file->createTables();
  if (!made) {
    file.reset();
    QFile::remove(path);
    return tl::unexpected(made.error());
  }
  file->held_ = true;
  return file;
}

Result<std::unique_ptr<SessionFile>> SessionFile::open(const QString& path) {
  const QFileInfo info(path);
  if (!info.exists()) return fail(ErrorCode::kIo, path.toStdString() + ": no such session file");
  if (!info.isFile()) return fail(ErrorCode::kIo, path.toStdString() + ": is not a file");
  std::unique_ptr<SessionFile> file(new SessionFile(path));
  Result<void> opened = file->connect();
  if (opened) opened = file->checkIdentity();
  if (opened) opened = file->hold();
  if (!opened) return tl::unexpected(opened.error());
  file->held_ = true;
  return file;
}

Result<void> SessionFile::connect() {
  if (!QSqlDatabase::isDriverAvailable(QStringLiteral("QSQLITE"))) {
    return fail(ErrorCode::kUnsupported, "sessions need Qt's SQLite driver; install the package libqt6sql6-sqlite");
  }
  QSqlDatabase database = QSqlDatabase::addDatabase(QStringLiteral("QSQLITE"), connection_);
  database.setDatabaseName(path_);
  database.setConnectOptions(QStringLiteral("QSQLITE_BUSY_TIMEOUT=300"));
  if (!database.open()) return tl::unexpected(explain(database.lastError()));
  return {};
}

Result<void> SessionFile::checkIdentity() const {
  const Result<int> id = readPragma(*this, "application_id");
  if (!id) return tl::unexpected(id.error());
  if (*id != kApplicationId) return fail(ErrorCode::kBadInput, path_.toStdString() + ": is not a Fieldtrue session");
  const Result<int> version = readPragma(*this, "user_version");
  if (!version) return tl::unexpected(version.error());
  if (*version > kFormatVersion) {
    return fail(ErrorCode::kNewerVersion,
                path_.toStdString() + ": was written by a newer version of Fieldtrue (session format " +
                    std::to_string(*version) + ", this version reads up to " + std::to_string(kFormatVersion) + ")");
  }
  auto check = run(QStringLiteral("PRAGMA quick_check(1)"));
  if (!check) return tl::unexpected(check.error());
  if (!check->next() || check->value(0).toString() != QLatin1String("ok")) {
    return fail(ErrorCode::kBadInput, path_.toStdString() + ": the session file is damaged");
  }
  return {};
}

Result<void> SessionFile::hold() const {
  for (const char* statement : {"PRAGMA locking_mode=EXCLUSIVE", "PRAGMA journal_mode=WAL", "PRAGMA synchronous=FULL",
                                "PRAGMA foreign_keys=ON", "BEGIN IMMEDIATE", "COMMIT"}) {
    if (auto done = run(QLatin1String(statement)); !done) return tl::unexpected(done.error());
  }
  return {};
}

Result<void> SessionFile::createTables() {
  return transaction([this]() -> Result<void> {
    for (const char* statement : kTables) {
      if (auto done = run(QLatin1String(statement)); !done) return tl::unexpected(done.error());
    }
    for (const QString& pragma : {QStringLiteral("PRAGMA application_id=%1").arg(kApplicationId),
                                  QStringLiteral("PRAGMA user_version=%1").arg(kFormatVersion)}) {
      if (auto done = run(pragma); !done) return tl::unexpected(done.error());
    }
    return {};
  });
}

Result<QSqlQuery> SessionFile::run(const QString& sql, const QVariantList& values) const {
  QSqlQuery query(QSqlDatabase::database(connection_, false));
  query.setForwardOnly(true);
  if (!query.prepare(sql)) return tl::unexpected(explain(query.lastError()));
  for (const QVariant& value : values) query.addBindValue(value);
  if (!query.exec()) return tl::unexpected(explain(query.lastError()));
  return query;
}

Result<void> SessionFile::transaction(const std::function<Result<void>()>& body) {
  if (auto begun = run(QStringLiteral("BEGIN IMMEDIATE")); !begun) return tl::unexpected(begun.error());
  Result<void> done = body();
  if (done) {
    if (auto committed = run(QStringLiteral("COMMIT")); !committed) done = tl::unexpected(committed.error());
  }
  if (!done) (void)run(QStringLiteral("ROLLBACK"));
  return done;
}

Error SessionFile::explain(const QSqlError& error) const {
  const std::string name = path_.toStdString();
  const std::string detail = " (" + error.databaseText().toStdString() + ")";
  switch (error.nativeErrorCode().toInt() & 0xff) {
    case kBusy:
    case kLocked:
      return {ErrorCode::kIo, name + ": the session is open in another program; close it there first"};
    case kReadOnly:
      return {ErrorCode::kIo, name + ": the session file or its folder is write-protected"};
    case kFull:
      return {ErrorCode::kIo, name + ": the disk is full; free some space and try again"};
    case kIoError:
      return {ErrorCode::kIo, name + ": the disk refused to read or write the session file" + detail};
    case kCorrupt:
      return {ErrorCode::kBadInput, name + ": the session file is damaged" + detail};
    case kNotADb:
      return {ErrorCode::kBadInput, name + ": is not a Fieldtrue session"};
    case kCantOpen:
      return {ErrorCode::kIo, name + ": cannot be opened; check that the folder can be written to"};
    default:
      return {ErrorCode::kIo, name + ": the session file could not be used: " + error.text().toStdString()};
  }
}

}  // namespace fieldtrue
