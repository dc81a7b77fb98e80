#pragma once

#include <QElapsedTimer>
#include <QObject>
#include <QString>
#include <QTimer>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "acquisition/devices/line_exchange.h"
#include "acquisition/devices/registry.h"
#include "acquisition/transports/transport.h"
#include "acquisition/transports/usb_adapters.h"

namespace fieldtrue::acquisition {

/// A tracker that was found, and how to write it.
struct FoundTracker {
  std::string kind;    ///< Of the registry.
  std::string label;   ///< "Polhemus Fastrak".
  std::string device;  ///< "fastrak:/dev/ttyUSB0@19200".
  bool was_streaming = false;
  ProbeAnswer answer;
};

/// What was found on one line.
struct LineFinding {
  std::string line;  ///< Without a rate.
  std::optional<UsbAdapter> adapter;
  std::optional<FoundTracker> tracker;
  std::string text;  ///< One sentence: what answered, or why nothing did.
  std::string note;  ///< Of the adapter: it was known on another port, or another program has the line open too.
};

/// Finds out what is on one line: listens, then asks as each kind of tracker is asked, at each of its rates, until one
/// answers. The line is closed again at the end.
class LineSearch : public QObject {
  Q_OBJECT
 public:
  using MakeLine = std::function<Result<std::unique_ptr<Transport>>(const std::string& address)>;
  /// @param line as makeTransport reads it, without a rate
  explicit LineSearch(std::string line, MakeLine make_line = makeTransport, QObject* parent = nullptr);
  ~LineSearch() override;
  void start();
  /// Ends it; finished follows, with what is known by then.
  void stop(const QString& why);
  const LineFinding& finding() const { return finding_; }
  bool isFinished() const { return finished_; }

 signals:
  void finished();

 private:
  void opened();
  void listen();
  void listened(const std::string& heard);
  void askNext();
  void ask(const DeviceKind& kind);
  void askAfterBreak(const TrackerProbe& probe);
  void answered(const std::string& heard);
  void nextRate();
  void found(const DeviceKind& kind, ProbeAnswer answer);
  void nothing();
  void finish(std::string text);

  LineFinding finding_;
  MakeLine make_line_;
  std::vector<const DeviceKind*> kinds_;  ///< Those that can be on this line, the likeliest first.
  std::vector<int> rates_;
  std::size_t rate_ = 0;
  std::size_t kind_ = 0;
  std::set<std::string> asked_;  ///< At this rate.
  const DeviceKind* streaming_ = nullptr;
  ProbeAnswer stream_answer_;
  std::unique_ptr<Transport> transport_;
  std::unique_ptr<LineExchange> exchange_;
  bool finished_ = false;
};

/// Looks for trackers on several lines side by side. Lives in one thread; opening a line may take a while there.
class TrackerSearch : public QObject {
  Q_OBJECT
 public:
  /// @param lines empty = the usual ones: every serial line of this machine, and the usual addresses of trackers that
  ///        are on none
  /// @param and_usual_lines those too
  explicit TrackerSearch(std::vector<std::string> lines = {}, bool and_usual_lines = false, QObject* parent = nullptr);
  std::vector<LineFinding> findings() const;

 public slots:
  void start();
  void stop();

 signals:
  void lineDone(const fieldtrue::acquisition::LineFinding& finding);
  void finished();

 private:
  void end(const QString& why);
  void lineFinished(LineSearch* line);

  std::vector<std::string> lines_;
  bool usual_lines_;
  std::vector<std::unique_ptr<LineSearch>> searches_;
  std::set<std::string> quiet_;  ///< Lines nobody named: nothing there is not told.
  QTimer limit_;
  bool running_ = false;
};

}  // namespace fieldtrue::acquisition

Q_DECLARE_METATYPE(fieldtrue::acquisition::LineFinding)
