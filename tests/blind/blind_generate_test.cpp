#include <Eigen/Eigenvalues>
#include <QTemporaryDir>
#include <QTest>
#include <filesystem>
#include <map>
#include <set>

#include "tests/blind/generate.h"
#include "tests/blind/generate_session.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/session_table.h"
#include "tests/blind/sha256.h"
#include "tests/support/test_main.h"

using namespace blind;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

/// A set made without the program under test.
struct Made {
  QTemporaryDir holder;
  fs::path path = fs::path(holder.path().toStdString()) / "set";
  int status = 0;

  explicit Made(std::vector<std::string> words) {
    words.insert(words.end(), {"--out", path.string(), "--max-rows", "90", "--cli", "/nowhere"});
    status = runGenerate(words);
  }
  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> texts;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path))
      if (entry.is_regular_file()) texts[fs::relative(entry.path(), path).string()] = textOf(entry.path());
    return texts;
  }
};

const Made& mixedSet() {
  static const Made made({"--seed", "4", "--sessions", "40", "--levels"});
  return made;
}

std::vector<json> sessionsOn(const std::string& shelf) {
  std::vector<json> sessions;
  const json truth = openSealed(mixedSet().path);
  for (const json& session : truth["sessions"])
    if (session["shelf"] == shelf) sessions.push_back(session);
  return sessions;
}

}  // namespace

class BlindGenerateTest : public QObject {
  Q_OBJECT
 private slots:
  void hashAsPublished_data();
  void hashAsPublished();
  void sameSeedSameBytes();
  void otherSeedOtherSessions();
  void shelvesAndStrengthsAreCounted();
  void namesAndHeadersTellNothing();
  void unseenPlacesAreSealed();
  void covariancesHold();
  void classesHoldEveryEffectOnce();
  void rhoIsWhatWasWished();
  void oracleShrinksMoreWhereThereIsMore();
  void sealedFolderIsNotOverwritten();
  void wrongUsageIsTold_data();
  void wrongUsageIsTold();
};

void BlindGenerateTest::hashAsPublished_data() {
  QTest::addColumn<QString>("text");
  QTest::addColumn<QString>("hash");
  // FIPS 180-2, appendix B.1 and B.2, and the empty message.
  QTest::newRow("abc") << "abc"
                       << "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
  QTest::newRow("two blocks") << "abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"
                              << "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1";
  QTest::newRow("nothing") << ""
                           << "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
}

void BlindGenerateTest::hashAsPublished() {
  QFETCH(QString, text);
  QFETCH(QString, hash);
  QCOMPARE(QString::fromStdString(sha256Hex(text.toStdString())), hash);
}

void BlindGenerateTest::sameSeedSameBytes() {
  const Made again({"--seed", "4", "--count", "40", "--levels", "--jobs", "3"});
  QCOMPARE(again.status, 0);
  QVERIFY(again.files() == mixedSet().files());
}

void BlindGenerateTest::otherSeedOtherSessions() {
  const Made other({"--seed", "5", "--sessions", "1"});
  QVERIFY(other.files().at("session_0001.nodes.csv") != mixedSet().files().at("session_0001.nodes.csv"));
}

void BlindGenerateTest::shelvesAndStrengthsAreCounted() {
  // Of 40: a quarter without effect, 45 % with one, a fifth of these at each strength and between them.
  QCOMPARE(sessionsOn("none").size(), std::size_t(10));
  const std::vector<json> single = sessionsOn("single");
  QCOMPARE(single.size(), std::size_t(18));
  std::map<std::string, int> at;
  for (const json& session : single) ++at[session["rho_level"].dump()];
  const std::map<std::string, int> expected = {{"0.35", 4}, {"0.7", 4}, {"1.4", 4}, {"2.8", 3}, {"null", 3}};
  QVERIFY(at == expected);
  for (const json& session : sessionsOn("pairs")) QVERIFY(session["effects"].size() >= 2);
  for (const json& session : sessionsOn("none")) QVERIFY(session["effects"].empty());
}

void BlindGenerateTest::namesAndHeadersTellNothing() {
  std::map<std::string, std::set<std::string>> headers_of;
  for (const auto& [name, text] : mixedSet().files()) {
    if (name == "truth.json" || name == "seal.json") continue;
    QVERIFY(name.rfind("session_00", 0) == 0 || name.rfind("unseen/session_00", 0) == 0);
    for (const std::string& id : catalogueIds()) QVERIFY(text.find(id) == std::string::npos);
    for (const char* word : {"off:", "single", "pairs", "signals", "rho"})
      QVERIFY(text.find(word) == std::string::npos);
  }
  std::set<fs::file_time_type> times;
  const json truth = openSealed(mixedSet().path);
  for (const json& session : truth["sessions"]) {
    const fs::path path = mixedSet().path / (session["file"].get<std::string>() + ".nodes.csv");
    times.insert(fs::last_write_time(path));
    const SessionTable nodes = readTable(path);
    // What is measured and what is known decides the columns, never the effect.
    QCOMPARE(nodes.columns.size(), std::size_t(session["position_only"] == true ? 28 : 33));
    QCOMPARE(nodes.metadata.size(), std::size_t(session["alignment_known"] == true ? 9 : 7));
    QCOMPARE(nodes.rows.size(), session["rows"].get<std::size_t>());
    QVERIFY(nodes.rows.size() <= 90);
  }
  QCOMPARE(times.size(), std::size_t(1));
}

/// Beside each session 200 places that no table holds, 150 of them in the box of its places, sealed with the truth.
void BlindGenerateTest::unseenPlacesAreSealed() {
  const json truth = openSealed(mixedSet().path);
  for (const json& session : truth["sessions"]) {
    const std::string file = session["file"];
    const fs::path path = mixedSet().path / "unseen" / (file + ".csv");
    QCOMPARE(sha256Hex(textOf(path)), session["unseen_sha256"].get<std::string>());
    const SessionTable unseen = readTable(path);
    const SessionTable nodes = readTable(mixedSet().path / (file + ".nodes.csv"));
    QCOMPARE(unseen.rows.size(), std::size_t(200));
    int inside = 0;
    for (const auto& row : unseen.rows) {
      bool is_inside = true;
      for (const char* axis : {"x_true_m", "y_true_m", "z_true_m"}) {
        double low = 1e9, high = -1e9;
        for (const auto& node : nodes.rows) {
          low = std::min(low, numberIn(node[nodes.neededColumn(axis)]));
          high = std::max(high, numberIn(node[nodes.neededColumn(axis)]));
        }
        const double at = numberIn(row[unseen.neededColumn(axis)]);
        is_inside = is_inside && at >= low - 1e-5 && at <= high + 1e-5;
      }
      QCOMPARE(is_inside, row[unseen.neededColumn("inside")] == "1");
      inside += is_inside ? 1 : 0;
    }
    QCOMPARE(inside, 150);
  }
}

void BlindGenerateTest::covariancesHold() {
  // Readings on a lattice can move together exactly: the written matrix must stay a covariance.
  const Made faulty({"--seed", "3", "--sessions", "24", "--shelf", "signals"});
  QCOMPARE(faulty.status, 0);
  int read = 0;
  for (const auto& [name, text] : faulty.files()) {
    if (name.find(".nodes.csv") == std::string::npos) continue;
    const SessionTable nodes = readTable(faulty.path / name);
    for (const std::vector<std::string>& row : nodes.rows) {
      const auto number = [&](const char* column) { return numberIn(row[nodes.neededColumn(column)]); };
      Eigen::Matrix3d covariance;
      covariance << std::pow(number("sd_x_m"), 2), number("cov_xy_m2"), number("cov_xz_m2"), number("cov_xy_m2"),
          std::pow(number("sd_y_m"), 2), number("cov_yz_m2"), number("cov_xz_m2"), number("cov_yz_m2"),
          std::pow(number("sd_z_m"), 2);
      QVERIFY(std::abs(covariance(0, 1)) <= std::sqrt(covariance(0, 0) * covariance(1, 1)));
      // A reading that never leaves its step has no variance: zero up to the arithmetic of the eigenvalues.
      const double least = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues()[0];
      QVERIFY(least >= -1e-12 * covariance.trace());
      ++read;
    }
  }
  QVERIFY(read > 1000);
}

void BlindGenerateTest::classesHoldEveryEffectOnce() {
  const json truth = openSealed(mixedSet().path);
  for (const json& session : truth["sessions"]) {
    std::vector<std::string> ids;
    for (const json& members : session["classes"])
      for (const json& id : members) ids.push_back(id.get<std::string>());
    std::sort(ids.begin(), ids.end());
    QCOMPARE(ids, catalogueIds());
  }
  QCOMPARE(catalogueIds().size(), std::size_t(20));
}

void BlindGenerateTest::rhoIsWhatWasWished() {
  int n_wished = 0;
  for (const char* shelf : {"single", "off"})
    for (const json& session : sessionsOn(shelf)) {
      if (session["rho_level"].is_null()) continue;
      ++n_wished;
      const double wished = session["rho_level"].get<double>();
      QVERIFY(std::abs(session["rho"].get<double>() / wished - 1) < 0.003);
    }
  QVERIFY(n_wished > 0);
}

void BlindGenerateTest::oracleShrinksMoreWhereThereIsMore() {
  std::map<double, std::vector<double>> fractions;
  for (const json& session : sessionsOn("single")) {
    const double fraction = session["oracle"]["fraction"].get<double>();
    QVERIFY(fraction > 0 && fraction < 1);
    if (!session["rho_level"].is_null()) fractions[session["rho_level"].get<double>()].push_back(fraction);
  }
  const auto mean = [&](double level) {
    double sum = 0;
    for (double fraction : fractions.at(level)) sum += fraction;
    return sum / static_cast<double>(fractions.at(level).size());
  };
  QVERIFY(mean(2.8) > mean(0.35));
}

void BlindGenerateTest::sealedFolderIsNotOverwritten() {
  const std::string before = textOf(mixedSet().path / "truth.json");
  const std::vector<std::string> words = {"--seed", "9", "--sessions", "1", "--out", mixedSet().path.string()};
  QCOMPARE(runGenerate(words), 1);
  QCOMPARE(textOf(mixedSet().path / "truth.json"), before);
}

void BlindGenerateTest::wrongUsageIsTold_data() {
  QTest::addColumn<QString>("words");
  QTest::newRow("no seed") << "--out x --sessions 3";
  QTest::newRow("no folder") << "--seed 1 --sessions 3";
  QTest::newRow("no count") << "--seed 1 --out x";
  QTest::newRow("count of none") << "--seed 1 --out x --sessions 0";
  QTest::newRow("seed below zero") << "--seed -1 --out x --sessions 2";
  QTest::newRow("seed of letters") << "--seed one --out x --sessions 2";
  QTest::newRow("unknown shelf") << "--seed 1 --out x --sessions 2 --shelf top";
  QTest::newRow("unknown role") << "--seed 1 --out x --sessions 2 --role exam";
  QTest::newRow("two ways of strength") << "--seed 1 --out x --sessions 2 --levels --strength 2";
  QTest::newRow("strength of nothing") << "--seed 1 --out x --sessions 2 --strength 0";
  QTest::newRow("unknown option") << "--seed 1 --out x --sessions 2 --loud";
  QTest::newRow("value missing") << "--seed";
}

void BlindGenerateTest::wrongUsageIsTold() {
  QFETCH(QString, words);
  std::vector<std::string> plain;
  for (const QString& word : words.split(' ')) plain.push_back(word.toStdString());
  QCOMPARE(runGenerate(plain), 2);
}

FIELDTRUE_TEST(BlindGenerateTest)
#include "blind_generate_test.moc"
