#pragma once

#include <QElapsedTimer>
#include <QObject>
#include <QTimer>
#include <functional>
#include <string>

#include "acquisition/transports/transport.h"

namespace fieldtrue::acquisition {

/// Talks with a device one step at a time: says something, waits, and hands on what was heard. One step at once.
class LineExchange : public QObject {
  Q_OBJECT
 public:
  using Then = std::function<void(const std::string& heard)>;
  explicit LineExchange(Transport& line, QObject* parent = nullptr);

  /// Says something and waits a while.
  void tell(const std::string& bytes, int pause_ms, Then then);
  /// Listens until nothing came for `quiet_ms`, at most `most_ms`.
  void drain(int quiet_ms, int most_ms, Then then);
  /// Says something and waits until what was heard is complete, at most `most_ms`; the continuation looks at it again.
  void ask(const std::string& bytes, std::function<bool(const std::string&)> complete, int most_ms, Then then);
  /// Bytes heard since this object was made.
  std::uint64_t bytesHeard() const { return bytes_heard_; }
  const std::string& lastHeard() const { return last_heard_; }

 signals:
  void bytesSeen(bool sent, const QByteArray& bytes);

 private:
  void begin(const std::string& bytes, int wait_ms, Then then);
  void readReady();
  void finish();

  Transport& line_;
  QTimer timer_;
  QElapsedTimer step_;
  Then then_;
  std::function<bool(const std::string&)> complete_;
  int quiet_ms_ = 0;
  int most_ms_ = 0;
  std::string heard_;
  std::string last_heard_;
  std::uint64_t bytes_heard_ = 0;
};

}  // namespace fieldtrue::acquisition
