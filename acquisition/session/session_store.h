#pragma once

#include <QDateTime>
#include <QString>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/plan/place_state.h"
#include "acquisition/plan/plan.h"
#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/statistics.h"

namespace fieldtrue::acquisition {

/// A reading of no stored take: between the places, or of a take that failed or was cancelled.
struct LooseSample {
  Sample sample;
  std::optional<int> cancelled_node;  ///< Where it was to be taken; none between the places.
};

/// What one sensor recorded at a place.
struct SensorTake {
  std::vector<Sample> samples;  ///< Of this sensor alone, not empty.
  NodeStatistics statistics;
};

/// What another program recorded at a place.
struct ForeignTake {
  std::size_t place = 0;
  std::vector<Node> means;      ///< One a sensor, at least one.
  std::vector<Sample> samples;  ///< Empty where only the means are known.
};

/// Its row of a sample table: node -1, and `cancelled:<node>` as status when it is of a take.
SampleRow rowOf(LooseSample reading);

/// One `*.fieldtrue` file: plan, raw samples, nodes, events and fits in SQLite. WAL with synchronous=FULL while open;
/// one file again when closed. Use from one thread. Every write but that of loose readings is on disk when the call
/// returns. A reading that fails midway is an error, never a part of the answer.
class SessionStore {
 public:
  /// Creates a new session file. @param created when the session begins, UTC
  /// @error kIo (exists already, no such folder, disk full)
  static Result<SessionStore> create(const QString& path, const Plan& plan, const TableMetadata& metadata,
                                     const QDateTime& created = QDateTime::currentDateTimeUtc());
  /// Opens an existing one; where it cannot be written to, a private copy of it.
  /// @error kIo; kBadInput when it is not a session; kNewerVersion
  static Result<SessionStore> open(const QString& path);
  SessionStore(SessionStore&&) noexcept;
  SessionStore& operator=(SessionStore&&) noexcept;
  ~SessionStore();  ///< Checkpoints and closes.

  const QString& path() const;
  bool isReadOnly() const;  ///< Open as a private copy: what would be stored is refused.
  /// What its user should know of how it was opened, one sentence each.
  const std::vector<std::string>& remarks() const;
  const Plan& plan() const;
  const std::vector<PlannedPlace>& places() const;
  const TableMetadata& metadata() const;
  Result<void> setMetadata(const TableMetadata& metadata);

  /// State of every planned place, same order as places(). A place without a live take is planned or skipped.
  Result<std::vector<PlaceState>> states() const;
  Result<PlaceState> state(std::size_t place) const;

  /// Stores a finished take of every sensor with its raw samples in one transaction; an earlier take of the place is
  /// kept but superseded, whichever sensors it was of.
  /// @param sensors at least one, the leading one first
  /// @param suspicious reason, empty when the take is fine
  /// @error kIo with the reason (disk full): nothing of the take is stored
  Result<void> storeTake(std::size_t place, const std::vector<SensorTake>& sensors, const std::string& suspicious);
  /// Stores takes that another program made, all of them or none.
  Result<void> storeForeign(const std::vector<ForeignTake>& takes);
  Result<void> skip(std::size_t place, const std::string& reason);
  /// Takes back the last take or skip (any number of times). @return the place it concerned, none when nothing is left
  Result<std::optional<std::size_t>> undo();
  /// Brings back what the last undo took back, until something new is stored.
  Result<std::optional<std::size_t>> redo();
  Result<bool> canUndo() const;
  Result<bool> canRedo() const;
  /// Keeps readings of no take. They are written with the next take, skip or undo, when 512 of them or 5 s have come
  /// together, and at closing: not one by one.
  Result<void> keepLoose(const std::vector<LooseSample>& readings);
  Result<void> flush();  ///< Writes the loose readings that wait.
  /// Keeps something that happened (device lost, take failed) with the time of the wall clock.
  Result<void> addEvent(const std::string& kind, const std::string& text);
  /// Keeps a fitted calibration's text with the session.
  Result<void> storeFit(const std::string& name, const std::string& ftcal_text);
  Result<std::vector<std::pair<std::string, std::string>>> fits() const;  ///< name, ftcal text; newest first.

  /// Every event, oldest first: kind, text.
  Result<std::vector<std::pair<std::string, std::string>>> events() const;

  /// A small state of the program ("page": "compare") kept in the file, so that a session opens where it was.
  Result<void> setState(const std::string& key, const std::string& value);
  Result<std::string> state(const std::string& key) const;

  /// Live takes as a node table, a row a sensor, with skipped places as rows of role skipped only when they have a
  /// take.
  Result<CalibrationTable> nodeTable() const;
  /// Raw samples of the live takes, then the loose ones with node -1.
  Result<SampleTable> sampleTable() const;
  /// The live take of a place: a row a sensor, the leading one first; empty when there is none.
  Result<std::vector<Node>> nodes(std::size_t place) const;
  /// Raw samples of the live take of a place, sensor by sensor.
  Result<std::vector<Sample>> samples(std::size_t place) const;

  QDateTime created() const;  ///< When the session began, UTC.
  /// Session time of the newest stored sample, loose ones and those of superseded takes too; none when there is none
  /// [s].
  Result<std::optional<double>> newestSample_s() const;

  /// The file may not grow beyond this; what does not fit fails as on a full disk. For quotas and tests.
  Result<void> limitSize(std::int64_t bytes);

 private:
  struct Impl;
  explicit SessionStore(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fieldtrue::acquisition
