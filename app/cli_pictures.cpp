#include "app/cli_pictures.h"

#include <QCoreApplication>
#include <QFileInfo>
#include <QProcess>

namespace fieldtrue::cli {
namespace {

constexpr int kNoLimit = -1;

Result<std::vector<Result<QByteArray>>> askProgram(std::span<const widgets::PictureRequest> requests) {
  const QString folder = QCoreApplication::applicationDirPath();
  const QString path = folder + QStringLiteral("/fieldtrue-pictures");
  if (!QFileInfo(path).isExecutable()) {
    return fail(ErrorCode::kUnsupported, "fieldtrue-pictures is not beside this program, in " + folder.toStdString());
  }
  QProcess program;
  program.setProcessChannelMode(QProcess::ForwardedErrorChannel);
  program.start(path, QStringList{});
  program.write(widgets::toBytes(requests));
  program.closeWriteChannel();
  if (!program.waitForFinished(kNoLimit)) {
    return fail(ErrorCode::kUnsupported,
                "fieldtrue-pictures cannot be started: " + program.errorString().toStdString());
  }
  if (program.exitStatus() != QProcess::NormalExit) {
    return fail(ErrorCode::kUnsupported, "fieldtrue-pictures was ended by the system before it had drawn");
  }
  if (program.exitCode() != 0) {
    return fail(ErrorCode::kUnsupported,
                "fieldtrue-pictures ended with status " + std::to_string(program.exitCode()) + " before it had drawn");
  }
  auto drawn = widgets::picturesFromBytes(program.readAllStandardOutput());
  if (drawn && drawn->size() != requests.size()) return fail(ErrorCode::kUnsupported, "fieldtrue-pictures drew others");
  return drawn;
}

}  // namespace

std::vector<Result<QByteArray>> drawByProgram(std::span<const widgets::PictureRequest> requests) {
  auto drawn = askProgram(requests);
  if (drawn) return *std::move(drawn);
  return std::vector<Result<QByteArray>>(requests.size(), tl::unexpected(drawn.error()));
}

}  // namespace fieldtrue::cli
