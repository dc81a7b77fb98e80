#include "acquisition/session/session_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <QDir>
#include <QFile>
#include <QFileInfo>
#include <array>
#include <atomic>

namespace fieldtrue::acquisition {

namespace {

constexpr int kFormatVersion = 1;
constexpr int kApplicationId = 0x46545255;  // "FTRU"

/// Of the tables of takes, after the key. A macro, for SQL is joined of literals.
#define FIELDTRUE_TAKE_COLUMNS                                                                                   \
  "sensor INTEGER NOT NULL, x_m REAL NOT NULL, y_m REAL NOT NULL, z_m REAL NOT NULL,"                            \
  " qw REAL NOT NULL, qx REAL NOT NULL, qy REAL NOT NULL, qz REAL NOT NULL,"                                     \
  " cov_xx_m2 REAL NOT NULL, cov_yy_m2 REAL NOT NULL, cov_zz_m2 REAL NOT NULL,"                                  \
  " cov_xy_m2 REAL NOT NULL, cov_xz_m2 REAL NOT NULL, cov_yz_m2 REAL NOT NULL, sd_rot_rad REAL NOT NULL,"        \
  " autocorrelation REAL NOT NULL, n_effective REAL NOT NULL, quantum_m REAL NOT NULL, n_used INTEGER NOT NULL," \
  " n_rejected INTEGER NOT NULL, t_start_s REAL NOT NULL, t_end_s REAL NOT NULL"

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
    // Of the leading sensor.
    "CREATE TABLE takes(action INTEGER PRIMARY KEY REFERENCES actions(id), " FIELDTRUE_TAKE_COLUMNS ")",
    "CREATE TABLE samples(action INTEGER NOT NULL REFERENCES takes(action), seq INTEGER NOT NULL, sensor INTEGER NOT "
    "NULL,"
    " t_s REAL NOT NULL, x_m REAL, y_m REAL, z_m REAL, qw REAL, qx REAL, qy REAL, qz REAL, status TEXT NOT NULL,"
    " rejected TEXT, PRIMARY KEY(action, seq)) WITHOUT ROWID",
    "CREATE TABLE events(id INTEGER PRIMARY KEY, time_utc TEXT NOT NULL, kind TEXT NOT NULL, text TEXT NOT NULL)",
    "CREATE TABLE fits(id INTEGER PRIMARY KEY, time_utc TEXT NOT NULL, name TEXT NOT NULL, ftcal TEXT NOT NULL)",
    "CREATE TABLE state(key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID",
};

/// What sessions of earlier versions lack; those versions read past it.
constexpr std::array kLaterTables{
    // Readings of no stored take: between places (cancelled_node NULL), or of a take that failed or was cancelled.
    "CREATE TABLE IF NOT EXISTS loose_samples(id INTEGER PRIMARY KEY, cancelled_node INTEGER, sensor INTEGER NOT NULL,"
    " t_s REAL NOT NULL, x_m REAL, y_m REAL, z_m REAL, qw REAL, qx REAL, qy REAL, qz REAL, status TEXT NOT NULL)",
    // Of the sensors beside the leading one; sample numbers go on from one sensor to the next.
    "CREATE TABLE IF NOT EXISTS takes_of_others(action INTEGER NOT NULL REFERENCES actions(id), " FIELDTRUE_TAKE_COLUMNS
    ", PRIMARY KEY(action, sensor)) WITHOUT ROWID",
    // Few rows ever: without it every take would look through all actions for those taken back.
    "CREATE INDEX IF NOT EXISTS actions_taken_back ON actions(id) WHERE undone = 1",
};

constexpr const char* kOpenKey = "is_open";
/// SQLite's lock bytes: PENDING_BYTE, RESERVED_BYTE and the shared range.
constexpr off_t kLockStart = 0x40000000;
constexpr off_t kLockBytes = 512;

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
  int value = 0;
  const auto done = file.read(QStringLiteral("PRAGMA %1").arg(QLatin1String(name)), {},
                              [&value](const QSqlQuery& row) { value = row.value(0).toInt(); });
  if (!done) return tl::unexpected(done.error());
  return value;
}

QString walOf(const QString& path) { return path + QStringLiteral("-wal"); }

/// By the system's own word, which knows of read-only media too.
bool canWrite(const QString& path) { return ::access(QFile::encodeName(path).constData(), W_OK) == 0; }

/// SQLite makes its journal in the folder and may have to bring one up to date that a crash left.
bool canWriteInPlace(const QString& path) {
  return canWrite(path) && canWrite(QFileInfo(path).absolutePath()) &&
         (!QFileInfo::exists(walOf(path)) || canWrite(walOf(path)));
}

/// Whether another program holds the file by SQLite's locks, so that it may change while it is copied.
bool isHeldElsewhere(const QString& path) {
  const int file = ::open(QFile::encodeName(path).constData(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  struct flock lock {};
  lock.l_type = F_RDLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = kLockStart;
  lock.l_len = kLockBytes;
  const bool held = ::fcntl(file, F_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  ::close(file);
  return held;
}

std::string heldElsewhere(const QString& path) {
  return path.toStdString() + ": the session is open in another program; close it there first";
}

Result<void> copyFile(const QString& from, const QString& to) {
  QFile source(from);
  if (!source.copy(to)) {
    return fail(ErrorCode::kIo, from.toStdString() + ": cannot be written to where it is, and could not be copied to " +
                                    QFileInfo(to).absolutePath().toStdString() + " either (" +
                                    source.errorString().toStdString() + ")");
  }
  QFile::setPermissions(to, QFile::ReadOwner | QFile::WriteOwner);
  return {};
}

}  // namespace

SessionFile::SessionFile(QString path)
    : path_(std::move(path)), opened_path_(path_), connection_(newConnectionName()) {}

SessionFile::~SessionFile() {
  if (held_ && !isReadOnly()) {
    if (!lacks_wal_) (void)sayWhetherOpen(false);
    (void)run(QStringLiteral("PRAGMA wal_checkpoint(TRUNCATE)"));
    (void)run(QStringLiteral("PRAGMA journal_mode=DELETE"));
  }
  disconnect();
}

void SessionFile::disconnect() const {
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
  if (made) made = file->addWhatIsNew();
  if (made) made = file->sayWhetherOpen(true);
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
  const bool has_wal = QFileInfo::exists(walOf(path));
  FT_TRY_VOID(canWriteInPlace(path) ? file->openWhereItIs() : file->openCopy());
  if (file->lacks_wal_ && !has_wal) {
    file->remarks_.push_back(
        path.toStdString() + ": this file was copied while its session was open, or after a crash, without the file " +
        walOf(QFileInfo(path).fileName()).toStdString() +
        " beside the original, which may hold the newest places; copy both and open them together");
  } else {
    file->lacks_wal_ = false;
  }
  return file;
}

Result<void> SessionFile::openWhereItIs() {
  Result<void> opened = connect();
  if (opened) opened = checkIdentity();
  if (opened) opened = hold();
  if (!opened) return opened;
  held_ = true;
  FT_TRY(const bool was_open, saysItIsOpen());
  lacks_wal_ = was_open;
  opened = addWhatIsNew();
  if (opened) opened = sayWhetherOpen(true);
  return opened;
}

Result<void> SessionFile::openCopy() {
  if (isHeldElsewhere(path_)) return fail(ErrorCode::kIo, heldElsewhere(path_));
  copy_ = std::make_unique<QTemporaryDir>();
  if (!copy_->isValid()) {
    return fail(ErrorCode::kIo, path_.toStdString() +
                                    ": cannot be written to where it is, and there is no room for a " +
                                    "private copy (" + copy_->errorString().toStdString() + ")");
  }
  opened_path_ = copy_->filePath(QStringLiteral("copy.fieldtrue"));
  Result<void> copied = copyFile(path_, opened_path_);
  if (copied && QFileInfo::exists(walOf(path_))) copied = copyFile(walOf(path_), walOf(opened_path_));
  if (copied) copied = openWhereItIs();
  if (!copied) return copied;
  remarks_.push_back(path_.toStdString() +
                     ": the file or its folder cannot be written to, so a private copy was opened and nothing will be "
                     "stored; to go on recording, copy it to a folder that can be written to");
  FT_TRY_VOID(run(QStringLiteral("PRAGMA query_only=ON")));
  return {};
}

Result<void> SessionFile::connect() {
  if (!QSqlDatabase::isDriverAvailable(QStringLiteral("QSQLITE"))) {
    return fail(ErrorCode::kUnsupported, "sessions need Qt's SQLite driver; install the package libqt6sql6-sqlite");
  }
  QSqlDatabase database = QSqlDatabase::addDatabase(QStringLiteral("QSQLITE"), connection_);
  database.setDatabaseName(opened_path_);
  database.setConnectOptions(QStringLiteral("QSQLITE_BUSY_TIMEOUT=300"));
  if (!database.open()) return tl::unexpected(explain(database.lastError()));
  return {};
}

Result<void> SessionFile::checkIdentity() const {
  FT_TRY(const int id, readPragma(*this, "application_id"));
  if (id != kApplicationId) return fail(ErrorCode::kBadInput, path_.toStdString() + ": is not a Fieldtrue session");
  FT_TRY(const int version, readPragma(*this, "user_version"));
  if (version > kFormatVersion) {
    return fail(ErrorCode::kNewerVersion,
                path_.toStdString() + ": was written by a newer version of Fieldtrue (session format " +
                    std::to_string(version) + ", this version reads up to " + std::to_string(kFormatVersion) + ")");
  }
  QString verdict;
  const auto checked = read(QStringLiteral("PRAGMA quick_check(1)"), {},
                            [&verdict](const QSqlQuery& row) { verdict = row.value(0).toString(); });
  if (!checked) return tl::unexpected(checked.error());
  if (verdict != QLatin1String("ok")) {
    return fail(ErrorCode::kBadInput, path_.toStdString() + ": the session file is damaged");
  }
  return {};
}

Result<void> SessionFile::hold() {
  for (const char* statement : {"PRAGMA locking_mode=EXCLUSIVE", "PRAGMA journal_mode=WAL", "PRAGMA synchronous=FULL",
                                "PRAGMA foreign_keys=ON", "BEGIN IMMEDIATE", "COMMIT"}) {
    FT_TRY_VOID(run(QLatin1String(statement)));
  }
  return {};
}

Result<void> SessionFile::createTables() {
  return transaction([this]() -> Result<void> {
    for (const char* statement : kTables) {
      FT_TRY_VOID(run(QLatin1String(statement)));
    }
    for (const QString& pragma : {QStringLiteral("PRAGMA application_id=%1").arg(kApplicationId),
                                  QStringLiteral("PRAGMA user_version=%1").arg(kFormatVersion)}) {
      FT_TRY_VOID(run(pragma));
    }
    return {};
  });
}

Result<void> SessionFile::addWhatIsNew() {
  return transaction([this]() -> Result<void> {
    for (const char* statement : kLaterTables) {
      FT_TRY_VOID(run(QLatin1String(statement)));
    }
    return {};
  });
}

Result<bool> SessionFile::saysItIsOpen() const {
  bool open = false;
  const auto done = read(QStringLiteral("SELECT value FROM meta WHERE key = ?"), {QLatin1String(kOpenKey)},
                         [&open](const QSqlQuery& row) { open = row.value(0).toString() == QLatin1String("yes"); });
  if (!done) return tl::unexpected(done.error());
  return open;
}

Result<void> SessionFile::sayWhetherOpen(bool open) const {
  FT_TRY_VOID(run(QStringLiteral("INSERT INTO meta(key, value) VALUES(?, ?)"
                                 " ON CONFLICT(key) DO UPDATE SET value = excluded.value"),
                  {QLatin1String(kOpenKey), open ? QStringLiteral("yes") : QStringLiteral("no")}));
  // Into the file itself: only there does a copy without its journal find it. What a crash left is made whole with it.
  FT_TRY_VOID(run(QStringLiteral("PRAGMA wal_checkpoint(TRUNCATE)")));
  return {};
}

Result<QSqlQuery> SessionFile::run(const QString& sql, const QVariantList& values) const {
  QSqlQuery query(QSqlDatabase::database(connection_, false));
  query.setForwardOnly(true);
  if (!query.prepare(sql)) return tl::unexpected(explain(query.lastError()));
  for (const QVariant& value : values) query.addBindValue(value);
  if (!query.exec()) return tl::unexpected(explain(query.lastError()));
  return query;
}

Result<void> SessionFile::runForAll(const QString& sql, const std::vector<QVariantList>& rows) const {
  QSqlQuery query(QSqlDatabase::database(connection_, false));
  query.setForwardOnly(true);
  if (!query.prepare(sql)) return tl::unexpected(explain(query.lastError()));
  for (const QVariantList& values : rows) {
    for (qsizetype i = 0; i < values.size(); ++i) query.bindValue(static_cast<int>(i), values[i]);
    if (!query.exec()) return tl::unexpected(explain(query.lastError()));
  }
  return {};
}

Result<void> SessionFile::read(const QString& sql, const QVariantList& values,
                               const std::function<void(const QSqlQuery&)>& row) const {
  FT_TRY(auto query, run(sql, values));
  while (query.next()) row(query);
  if (query.lastError().isValid()) return tl::unexpected(explain(query.lastError()));
  return {};
}

Result<void> SessionFile::transaction(const std::function<Result<void>()>& body) {
  FT_TRY_VOID(run(QStringLiteral("BEGIN IMMEDIATE")));
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
      return {ErrorCode::kIo, heldElsewhere(path_)};
    case kReadOnly:
      if (isReadOnly()) {
        return {ErrorCode::kIo, name +
                                    ": not stored, for the session is open as a private copy of a file that cannot "
                                    "be written to; copy it to a folder that can, and open it there"};
      }
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

}  // namespace fieldtrue::acquisition
