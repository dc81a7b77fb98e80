#pragma once

#include <QObject>
#include <QString>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/devices/line_exchange.h"
#include "acquisition/devices/stream_settings.h"
#include "acquisition/protocols/sample_status.h"
#include "acquisition/protocols/stream_parser.h"

namespace fieldtrue::acquisition {

/// How long a driver waits for what.
struct LineTimings {
  int settle_ms = 100;  ///< After stopping a stream.
  int clear_ms = 50;    ///< After what clears a half-typed command.
  int command_ms = 20;  ///< After a command.
  int quiet_ms = 60;    ///< Silence that ends a drain.
  int drain_most_ms = 1500;
  int reply_ms = 1000;
  int reset_ms = 12000;   ///< Silence after a restart.
  int lock_ms = 2000;     ///< For the first good readings after the stream is on.
  int silence_ms = 1500;  ///< Without readings while running.
  int stop_quiet_ms = 200;
};

/// A tracker on a line, before anybody spoke with it. What a tracker needs beyond stands in a struct that extends it.
struct LineSetup {
  std::string id;                 ///< Of the registry's row; keys of tables begin with it.
  std::string make;               ///< As tables name it: "Polhemus Fastrak".
  std::string name;               ///< What messages call it: "Fastrak".
  std::string excitation = "ac";  ///< `ac` or `pulsed_dc`; empty = it has none.
  std::string transmitter_model = "dipole";
  std::string where;        ///< The line as the person wrote it, for messages.
  std::string device_text;  ///< How to write the device with another rate: "fastrak:/dev/ttyUSB0".
  int baud = 115200;
  bool may_reset = true;  ///< Restarts a tracker that does not answer.
  LineTimings timings;
};

/// What a tracker said of itself while it was set up, and how it is set.
struct TrackerIdentity {
  QString title;                             ///< For messages: "Fastrak 2.41".
  std::string model;                         ///< For tables: "Polhemus Fastrak 2.41, Lab 2".
  std::vector<int> stations;                 ///< Switched on, ascending, counted from 1.
  double rate_hz = 0.0;                      ///< Of each station.
  int baud = 0;                              ///< At which it answered.
  std::map<std::string, std::string> facts;  ///< Stored with the session: "filter" -> "off", "units", "hemisphere" ...
  std::vector<std::string> refused;          ///< Commands it did not take, with the reason.
  std::optional<double> quantum_m;           ///< Step of its positions, where it is of the size of the noise.
  std::optional<std::string> transmitter_model, excitation;  ///< Where they differ from the setup's.
};

/// How a tracker that is set up streams.
struct StreamPlan {
  std::unique_ptr<StreamParser> parser;
  StreamSettings settings;       ///< What the parser was made from.
  std::string begin;             ///< Said once the parser listens.
  std::string ask_again;         ///< Said after every answer, for trackers that do not send by themselves; else empty.
  int ask_gap_ms = 0;            ///< Waited before asking again where an answer said nothing new.
  bool watches_mirrors = true;   ///< Whether its readings can be mirrored through the transmitter.
  const char* part = "Station";  ///< What messages call one of its sensors.
  /// The meaning of a sample's status in words.
  std::string (*meaning)(const std::string& status) = commonStatusMeaning;
};

/// A plan that was made from settings of the caller's own, which must be right (FT_CHECK).
StreamPlan madeStream(Result<StreamPlan> plan);

/// How a tracker is found on a line, whatever state it is in.
struct Greeting {
  std::string stop;   ///< Ends a stream that runs already.
  std::string clear;  ///< Clears a half-typed command.
  std::string ask;    ///< Asks who it is.
  std::function<bool(const std::string& heard)> answered;
  std::string reset;       ///< Restarts it; empty = it cannot be.
  std::vector<int> rates;  ///< Tried in this order where nothing answers and the line has a rate.
  QString rate_switches = "its rate switches say";  ///< "check that ... 115200": where its rate is set.
  QString unreadable;  ///< What to do where only noise answers; empty = another rate and the switches.
};

/// One step of setting a tracker up.
struct LineStep {
  std::string say;
  int wait_ms = 0;                                         ///< A pause; with `complete` the longest wait.
  std::function<bool(const std::string& heard)> complete;  ///< Whether all of the reply is there; empty = a pause.
  /// Looks at what was heard; false ends the steps, and says itself why or goes on in another way.
  std::function<bool(const std::string& heard)> heard;
};

/// Brings a tracker from any state to a stream that its parser reads, step by step and without blocking.
class TrackerStartup : public QObject {
  Q_OBJECT
 public:
  TrackerStartup(Transport& line, LineSetup setup, QObject* parent = nullptr);
  virtual void run() = 0;
  /// How it streams from now on; once `finished` was emitted.
  virtual StreamPlan stream() const = 0;
  /// What ends a stream, whatever state the tracker is in.
  virtual std::string farewell() const = 0;
  const TrackerIdentity& identity() const { return identity_; }

 signals:
  void progressed(const QString& text);
  void finished();
  void failed(const QString& text);
  void bytesSeen(bool sent, const QByteArray& bytes);

 protected:
  using Heard = std::function<void(const std::string& heard)>;
  /// Stops a stream, clears the line and asks who is there; looks for another rate, then restarts it. `then` gets the
  /// answer; where there is none the startup has failed and said why.
  void greet(Greeting greeting, Heard then);
  /// The steps in order, then what follows.
  void perform(std::vector<LineStep> steps, std::function<void()> then);
  /// Asks until the answer is complete, a few times; `then` gets it, or the startup has failed and said why.
  void askFirmly(const std::string& ask, std::function<bool(const std::string&)> complete, Heard then);
  /// Hands the line over to the parser and finishes.
  void finish();

  QString name() const;
  QString where() const;
  void failNothingPluggedIn(const std::vector<int>& wanted);
  void failNotTaken(const QString& setting);
  /// Another kind of tracker answered. @param name with its article @param id of its row
  void failIsAnother(const QString& name, const QString& id);

  Transport& line_;
  LineExchange exchange_;
  TrackerIdentity identity_;

 private:
  void stopStream();
  void ask(int tries);
  void noAnswer();
  void tryNextRate();
  void giveUp();
  void reset();
  void step(std::size_t next);
  void askOnce(int tries);

  LineSetup setup_;
  Greeting greeting_;
  Heard answered_;
  std::vector<LineStep> steps_;
  std::function<void()> after_steps_;
  LineStep firm_;
  std::size_t next_rate_ = 0;
  bool rates_known_ = true;
  bool was_reset_ = false;
};

}  // namespace fieldtrue::acquisition
