#pragma once

#include <QCoreApplication>
#include <QElapsedTimer>
#include <QFile>
#include <QProcess>
#include <QRegularExpression>
#include <QStringList>
#include <QTest>
#include <nlohmann/json.hpp>

/// Runs the built fieldtrue-cli, as a person or a script would.
namespace fieldtrue::testing {

/// What a run of the program left.
struct CliRun {
  int status = -1;  ///< -1: it did not end by itself.
  QByteArray out;
  QByteArray err;
  nlohmann::json json() const { return nlohmann::json::parse(out.toStdString(), nullptr, false); }
};

inline QString cliPath() { return QCoreApplication::applicationDirPath() + "/../app/fieldtrue-cli"; }

inline CliRun finished(QProcess& process, int timeout_ms) {
#ifdef __SANITIZE_ADDRESS__
  timeout_ms *= 5;
#endif
  CliRun run;
  if (process.waitForFinished(timeout_ms) && process.exitStatus() == QProcess::NormalExit) {
    run.status = process.exitCode();
  } else {
    process.kill();
    process.waitForFinished(5000);
  }
  run.out = process.readAllStandardOutput();
  run.err = process.readAllStandardError();
  return run;
}

inline CliRun runCli(const QStringList& arguments, const QByteArray& input = {}, int timeout_ms = 300000) {
  QProcess process;
  process.start(cliPath(), arguments);
  process.write(input);
  process.closeWriteChannel();
  return finished(process, timeout_ms);
}

inline QByteArray readWhole(const QString& path) {
  QFile file(path);
  return file.open(QIODevice::ReadOnly) ? file.readAll() : QByteArray();
}

/// Reads the process's output until a line matches.
inline QRegularExpressionMatch waitForLine(QProcess& process, const QString& pattern, int timeout_ms = 60000) {
  const QRegularExpression expression(pattern, QRegularExpression::MultilineOption);
  QElapsedTimer timer;
  timer.start();
  QString text;
  do {
    text += QString::fromUtf8(process.readAllStandardOutput());
    const auto match = expression.match(text);
    if (match.hasMatch()) return match;
  } while (timer.elapsed() < timeout_ms && (process.waitForReadyRead(1000) || process.state() == QProcess::Running));
  return {};
}

inline bool writeWhole(const QString& path, const QByteArray& bytes) {
  QFile file(path);
  return file.open(QIODevice::WriteOnly) && file.write(bytes) == bytes.size();
}

}  // namespace fieldtrue::testing

/// Verifies that a run ended with a status; prints what it said when not.
#define FT_VERIFY_STATUS(run, expected)                                                                               \
  do {                                                                                                                \
    const auto& ft_run = (run);                                                                                       \
    QVERIFY2(ft_run.status == (expected),                                                                             \
             ("status " + QByteArray::number(ft_run.status) + "\n" + ft_run.out.right(2000) + ft_run.err.right(2000)) \
                 .constData());                                                                                       \
  } while (false)
