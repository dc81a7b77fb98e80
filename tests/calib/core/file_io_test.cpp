#include "calib/core/file_io.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <QTemporaryDir>
#include <QTest>
#include <charconv>
#include <cmath>
#include <csignal>
#include <iterator>
#include <limits>
#include <stdexcept>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

Result<void> writeText(const std::filesystem::path& path, const std::string& text) {
  return writeFileAtomically(path, [&](std::ostream& out) { out << text; });
}

/// While it lives, no file of this process can grow beyond a size: what a full disk looks like.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  ~FileSizeLimit() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

/// The bytes of any file, a session's too.
std::string bytesOf(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Whether a second program finds the file locked.
bool isLockedForOthers(const std::filesystem::path& path) {
  const pid_t child = ::fork();
  if (child == 0) {
    struct flock lock {};
    lock.l_type = F_WRLCK;
    const int file = ::open(path.c_str(), O_RDWR);
    ::_exit(::fcntl(file, F_SETLK, &lock) == 0 ? 0 : 1);
  }
  int status = 0;
  return ::waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 1;
}

std::size_t filesIn(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

}  // namespace

class FileIoTest : public QObject {
  Q_OBJECT

 private slots:
  void init() {
    QVERIFY(folder_.isValid());
    path_ = std::filesystem::path(folder_.path().toStdString()) / "table.csv";
    std::filesystem::remove_all(path_);
  }

  void writesAndReads() {
    std::string text("a\0b\r\n", 5);
    text.append(200000, 'x');
    FT_VERIFY_OK(writeText(path_, text));
    const auto back = readFile(path_);
    FT_VERIFY_OK(back);
    QVERIFY(*back == text);
    FT_VERIFY_OK(writeText(path_, ""));
    QVERIFY(readFile(path_)->empty());
    QCOMPARE(filesIn(path_.parent_path()), std::size_t{1});
  }

  void keepsPermissionsAndLinks() {
    FT_VERIFY_OK(writeText(path_, "old"));
    ::chmod(path_.c_str(), 0640);
    const std::filesystem::path link = path_.parent_path() / "link.csv";
    std::filesystem::create_symlink("table.csv", link);
    FT_VERIFY_OK(writeText(link, "new"));
    QVERIFY(std::filesystem::is_symlink(link));
    QCOMPARE(*readFile(path_), std::string("new"));
    struct stat status {};
    QCOMPARE(::stat(path_.c_str(), &status), 0);
    QCOMPARE(status.st_mode & 0777, mode_t{0640});
    std::filesystem::remove(link);
  }

  void fullDiskLeavesTheOldFile() {
    FT_VERIFY_OK(writeText(path_, "old"));
    Result<void> written;
    {
      const FileSizeLimit limit(100000);
      written = writeText(path_, std::string(500000, 'x'));
    }
    QVERIFY(!written);
    QVERIFY(written.error().code == ErrorCode::kIo);
    FT_VERIFY_MATCH(holdsAll(written.error().message,
                             {"Cannot write", "table.csv", "File too large", "the file that was there is unchanged"}));
    QCOMPARE(*readFile(path_), std::string("old"));
    QCOMPARE(filesIn(path_.parent_path()), std::size_t{1});
  }

  void fullDeviceSaysSo() {
    const auto written = writeText("/dev/full", "anything");
    QVERIFY(!written);
    QVERIFY(written.error().code == ErrorCode::kIo);
    FT_VERIFY_MATCH(holdsAll(written.error().message, {"Cannot write /dev/full", "No space left on device"}));
    QVERIFY(std::filesystem::is_character_file("/dev/full"));
  }

  void throwingWriterLeavesTheOldFile() {
    FT_VERIFY_OK(writeText(path_, "old"));
    const auto throwing = [](std::ostream& out) {
      out << "half";
      throw std::logic_error("mistake");
    };
    QVERIFY_THROWS_EXCEPTION(std::logic_error, (void)writeFileAtomically(path_, throwing));
    QCOMPARE(*readFile(path_), std::string("old"));
    QCOMPARE(filesIn(path_.parent_path()), std::size_t{1});
  }

  void sessionsAreNotWrittenOver() {
    std::string database("SQLite format 3\0", 16);
    database += "and a day's work";
    const std::filesystem::path session = path_.parent_path() / "day.fieldtrue";
    const std::filesystem::path link = path_.parent_path() / "link.csv";
    FT_VERIFY_OK(writeText(session, "a name that does not exist yet is free"));
    std::filesystem::create_symlink("day.fieldtrue", link);
    FT_VERIFY_OK(writeText(path_, database));
    for (const auto& path : {session, link, path_}) {
      const std::string before = bytesOf(path);
      const auto written = writeText(path, "new");
      QVERIFY(!written);
      FT_VERIFY_MATCH(holdsAll(written.error().message,
                               {QByteArray::fromStdString(path.string()), "it is a session", "unchanged"}));
      QCOMPARE(bytesOf(path), before);
    }
  }

  void sessionsAreNotRead_data() {
    QTest::addColumn<QString>("name");
    QTest::newRow("session") << "open.fieldtrue";
    QTest::newRow("in capitals") << "open.FIELDTRUE";
    QTest::newRow("its journal") << "open.fieldtrue-wal";
    QTest::newRow("a link to it") << "open.csv";
  }
  /// A session that this program has locked stays locked, whoever asks for its bytes.
  void sessionsAreNotRead() {
    QFETCH(QString, name);
    const std::filesystem::path path = path_.parent_path() / name.toStdString();
    const std::filesystem::path session = path_.parent_path() / "linked.fieldtrue";
    const bool is_link = path.extension() == ".csv";
    if (is_link) std::filesystem::create_symlink(session.filename(), path);
    std::ofstream(path) << "a day's work";
    const int file = ::open(path.c_str(), O_RDWR);
    struct flock lock {};
    lock.l_type = F_WRLCK;
    QCOMPARE(::fcntl(file, F_SETLK, &lock), 0);
    const auto whole = readFile(path);
    const auto stream = openForReading(path);
    QVERIFY(!whole && !stream);
    QCOMPARE(stream.error().message, whole.error().message);
    FT_VERIFY_MATCH(
        holdsAll(whole.error().message, {name.toUtf8(), "it is a session; open it, or use", "tables --session"}));
    QVERIFY(isLockedForOthers(path));
    ::close(file);
    QVERIFY(!isLockedForOthers(path));
    std::filesystem::remove(path);
    std::filesystem::remove(session);
  }

  void anAbsentSessionIsAbsent() {
    const auto read = readFile(path_.parent_path() / "absent.fieldtrue");
    QVERIFY(!read && read.error().code == ErrorCode::kIo);
    FT_VERIFY_MATCH(holdsAll(read.error().message, {"No such file or directory"}));
  }

  void badPaths() {
    const std::filesystem::path absent = path_.parent_path() / "absent" / "table.csv";
    const auto written = writeText(absent, "text");
    QVERIFY(!written);
    FT_VERIFY_MATCH(holdsAll(written.error().message, {"absent/table.csv", "No such file or directory"}));
    const auto folder = writeText(path_.parent_path(), "text");
    QVERIFY(!folder);
    FT_VERIFY_MATCH(holdsAll(folder.error().message, {"it is a folder"}));
    const auto read = readFile(absent);
    QVERIFY(!read && read.error().code == ErrorCode::kIo);
    FT_VERIFY_MATCH(holdsAll(read.error().message, {"Cannot read", "absent/table.csv", "No such file or directory"}));
    QVERIFY(!readFile(path_.parent_path()));
    QVERIFY(!openForReading(absent) && !openForReading(path_.parent_path()));
  }

  void numbers_data() {
    QTest::addColumn<double>("value");
    QTest::addColumn<QString>("text");
    QTest::newRow("tenth") << 0.1 << "0.1";
    QTest::newRow("third") << 1.0 / 3.0 << "0.3333333333333333";
    QTest::newRow("whole") << 1.0 << "1";
    QTest::newRow("negative zero") << -0.0 << "-0";
    QTest::newRow("smallest") << 5e-324 << "5e-324";
    QTest::newRow("largest") << std::numeric_limits<double>::max() << "1.7976931348623157e+308";
    QTest::newRow("nan") << -std::nan("") << "nan";
  }
  void numbers() {
    QFETCH(double, value);
    QFETCH(QString, text);
    const std::string written = formatNumber(value);
    QCOMPARE(QString::fromStdString(written), text);
    if (std::isnan(value)) return;
    double back = 0.0;
    std::from_chars(written.data(), written.data() + written.size(), back);
    FT_VERIFY_MATCH(sameBits(back, value));
  }

 private:
  QTemporaryDir folder_;
  std::filesystem::path path_;
};

FIELDTRUE_TEST(FileIoTest)
#include "file_io_test.moc"
