#pragma once

#include <QObject>
#include <QString>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/devices/line_exchange.h"
#include "acquisition/protocols/fastrak.h"
#include "calib/core/settings.h"

namespace fieldtrue::acquisition {

/// How long the driver waits for what.
struct FastrakTimings {
  int settle_ms = 100;  ///< After stopping a stream.
  int clear_ms = 50;    ///< After a carriage return.
  int command_ms = 20;  ///< After a command.
  int quiet_ms = 60;    ///< Silence that ends a drain.
  int drain_most_ms = 1500;
  int reply_ms = 1000;
  int reset_ms = 12000;   ///< Silence after ^Y.
  int lock_ms = 2000;     ///< For the first good records after continuous output is on.
  int silence_ms = 1500;  ///< Without records while running.
  int stop_quiet_ms = 200;
};

/// How a Fastrak is to be set up.
struct FastrakSetup {
  std::string name = "Fastrak";  ///< What messages call it.
  bool tells_version = true;     ///< Whether its version belongs to its name.
  std::string where;             ///< The line as the person wrote it, for messages.
  std::string device_text;       ///< How to write the device with another rate: "fastrak:/dev/ttyUSB0".
  int baud = 115200;
  double rate_hz = kFastrakRate_hz;  ///< Shared by the stations; other than 120 only for an emulated tracker.
  std::string stations = "auto";     ///< "auto" = those plugged in, or digits: "13".
  std::string hemisphere = "+x";     ///< "+x" ... "-z" or "tracked".
  std::string filter = "off";        ///< "off", "low", "medium", "heavy".
  bool raw_frame = true;             ///< Resets alignment and boresight.
  bool may_reset = true;             ///< ^Y when there is no answer.
  FastrakTimings timings;
};

/// The tracker as messages call it once it has answered: "Fastrak 2.41".
QString titleOf(const FastrakSetup& setup, const FastrakStatus& status);

/// The output list the driver asks for: position, quaternion, stylus, tail mark.
inline constexpr std::array<int, 4> kFastrakDriverItems = {2, 11, 16, 1};

/// The settings of a Fastrak as data, for registry, forms and command line.
std::vector<Setting> fastrakSettings();
/// @param settings resolved from fastrakSettings()
void applyFastrakSettings(const Settings& settings, FastrakSetup& setup);

/// What the tracker said while it was set up.
struct FastrakIdentity {
  FastrakStatus status;
  std::vector<int> stations;  ///< Switched on, ascending.
  std::map<std::string, std::string>
      readings;                      ///< Settings kept in the tracker, read back: "increment", "position_envelope".
  std::vector<std::string> refused;  ///< Commands it did not take, with the reason.
  int baud = 0;                      ///< At which it answered.
};

/// Brings a Fastrak from any state to binary records in centimetres with filters and compensation as asked, step by
/// step and without blocking. Works on units that stream already, and looks for another rate where the line has one.
class FastrakStartup : public QObject {
  Q_OBJECT
 public:
  FastrakStartup(Transport& line, FastrakSetup setup, QObject* parent = nullptr);
  void run();
  const FastrakIdentity& identity() const { return identity_; }

 signals:
  void progressed(const QString& text);
  void finished();
  void failed(const QString& text);
  void bytesSeen(bool sent, const QByteArray& bytes);

 private:
  void stopStream();
  void askStatus(int tries);
  void statusCame(const FastrakStatus& status);
  void noStatus();
  void tryNextRate();
  void reset();
  void giveUp();
  std::vector<FastrakCommand> commands() const;
  std::vector<FastrakCommand> filterCommands() const;
  void sendCommands(std::size_t next);
  void readBackSettings(std::size_t next);
  void verify(int tries);
  void startOutput();
  void noteRefusal(const std::string& heard);

  Transport& line_;
  FastrakSetup setup_;
  LineExchange exchange_;
  FastrakIdentity identity_;
  std::vector<FastrakCommand> commands_;
  std::size_t next_rate_ = 0;
  bool rates_known_ = true;
  bool was_reset_ = false;
};

}  // namespace fieldtrue::acquisition
