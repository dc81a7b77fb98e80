#include "calib/archives/zip_archive.h"

#include <QTemporaryDir>
#include <QTest>

#include "calib/core/file_io.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

constexpr std::uint64_t kEnough = 1u << 20;

std::vector<ZipMember> twoMembers() {
  return {{"text.txt", "plain", false}, {"bytes.bin", std::string(5000, '\0') + "\xFF\x00 end"}};
}

}  // namespace

class ZipArchiveTest : public QObject {
  Q_OBJECT
 private slots:
  void readsWhatItWrote();
  void sameMembersMakeTheSameFile();
  void refusesWhatIsNone();
  void everyCutIsNoticed();
  void changedBytesAreNoticed();
  void tooMuch();
  void cannotBeWritten();

 private:
  std::filesystem::path at(const char* name) const { return folder_.filePath(name).toStdString(); }
  void put(const std::filesystem::path& path, const std::string& content) const {
    FT_VERIFY_OK(writeFileAtomically(path, [&](std::ostream& out) { out << content; }));
  }
  QTemporaryDir folder_;
};

void ZipArchiveTest::readsWhatItWrote() {
  FT_VERIFY_OK(writeZip(at("two.zip"), twoMembers()));
  const auto read = readZip(at("two.zip"), kEnough);
  FT_VERIFY_OK(read);
  QCOMPARE(read->size(), std::size_t{2});
  for (const ZipMember& member : twoMembers()) QCOMPARE(read->at(member.name), member.content);
  // What is not packed stands in the file as it is; what is packed is smaller.
  const auto file = readFile(at("two.zip"));
  QVERIFY(file->find("plain") != std::string::npos);
  QVERIFY(file->size() < 1000);
}

void ZipArchiveTest::sameMembersMakeTheSameFile() {
  FT_VERIFY_OK(writeZip(at("first.zip"), twoMembers()));
  QTest::qWait(2100);  // Times in archives count in steps of two seconds.
  FT_VERIFY_OK(writeZip(at("second.zip"), twoMembers()));
  QVERIFY(*readFile(at("first.zip")) == *readFile(at("second.zip")));
}

void ZipArchiveTest::refusesWhatIsNone() {
  FT_VERIFY_MATCH(holdsAll(readZip(at("nowhere.zip"), kEnough).error().message, {"nowhere.zip", "No such file"}));
  for (const char* content : {"", "PK", "no archive at all, but some text that is longer than an archive's end"}) {
    put(at("none.zip"), content);
    FT_VERIFY_MATCH(holdsAll(readZip(at("none.zip"), kEnough).error().message, {"none.zip", "zip archive"}));
  }
}

void ZipArchiveTest::everyCutIsNoticed() {
  FT_VERIFY_OK(writeZip(at("whole.zip"), twoMembers()));
  const std::string whole = *readFile(at("whole.zip"));
  for (std::size_t length = 0; length < whole.size(); ++length) {
    put(at("cut.zip"), whole.substr(0, length));
    QVERIFY(!readZip(at("cut.zip"), kEnough));
  }
}

void ZipArchiveTest::changedBytesAreNoticed() {
  FT_VERIFY_OK(writeZip(at("whole.zip"), twoMembers()));
  std::string changed = *readFile(at("whole.zip"));
  changed[changed.find("plain")] = 'P';
  put(at("changed.zip"), changed);
  FT_VERIFY_MATCH(holdsAll(readZip(at("changed.zip"), kEnough).error().message, {"text.txt", "damaged", "CRC"}));
}

void ZipArchiveTest::tooMuch() {
  FT_VERIFY_OK(writeZip(at("two.zip"), twoMembers()));
  FT_VERIFY_MATCH(holdsAll(readZip(at("two.zip"), 5000).error().message, {"two.zip", "more than 5000 bytes"}));
}

void ZipArchiveTest::cannotBeWritten() {
  FT_VERIFY_MATCH(holdsAll(writeZip(at("no/such/folder.zip"), twoMembers()).error().message, {"folder.zip"}));
}

FIELDTRUE_TEST(ZipArchiveTest)
#include "zip_archive_test.moc"
