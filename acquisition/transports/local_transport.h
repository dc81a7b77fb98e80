#pragma once

#include <QSocketNotifier>
#include <memory>
#include <string>
#include <vector>

#include "acquisition/transports/buffered_transport.h"
#include "acquisition/transports/line_driver.h"

namespace fieldtrue::acquisition {

/// A device file of this machine. Tries its drivers in order: the first that supports the line carries it.
class LocalTransport : public BufferedTransport {
  Q_OBJECT
 public:
  LocalTransport(std::string path, int baud, std::vector<std::unique_ptr<LineDriver>> drivers,
                 QObject* parent = nullptr);
  ~LocalTransport() override;

  Result<void> openLine() override;
  void close() override;
  void setRequestToSend(bool on) override;
  void setBreak(bool on) override;
  bool setBaud(int baud) override;

 protected:
  qint64 writeData(const char* from, qint64 size) override;

 private:
  void readReady();
  void writePending();
  void gone();

  std::string path_;
  int baud_;
  std::vector<std::unique_ptr<LineDriver>> drivers_;
  LineDriver* driver_ = nullptr;
  std::unique_ptr<QSocketNotifier> readable_;
  std::unique_ptr<QSocketNotifier> writable_;
  QByteArray pending_;
};

}  // namespace fieldtrue::acquisition
