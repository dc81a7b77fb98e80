#include "acquisition/session/session_store.h"

#include <QFile>
#include <QStringList>
#include <algorithm>
#include <map>

#include "acquisition/plan/place_state.h"
#include "acquisition/session/session_file.h"
#include "acquisition/session/session_rows.h"
#include "calib/core/json_text.h"
#include "calib/tables/table_json.h"

namespace fieldtrue::acquisition {

namespace {

/// What a device tells of itself need not be UTF-8; what is not is replaced.
std::string metadataText(const TableMetadata& metadata) {
  return toJson(metadata).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

QString text(const std::string& value) { return QString::fromStdString(value); }

QString now() { return QDateTime::currentDateTimeUtc().toString(Qt::ISODateWithMs); }

QString placeholders(qsizetype count) {
  QStringList marks;
  for (qsizetype i = 0; i < count; ++i) marks << QStringLiteral("?");
  return marks.join(QLatin1Char(','));
}

Result<void> withoutRows(const Result<QSqlQuery>& query) {
  if (!query) return tl::unexpected(query.error());
  return {};
}

/// The newest standing action of every place, or of one; the braces take `which`.
QString liveActions(const char* which) {
  return QStringLiteral("(SELECT place, MAX(id) AS id FROM actions WHERE undone = 0%1 GROUP BY place)")
      .arg(QLatin1String(which));
}
constexpr const char* kEveryPlace = "";
constexpr const char* kOnePlace = " AND place = ?";
/// Takes only: the newest that stands, also where a skip came later.
constexpr const char* kTakesOfEveryPlace = " AND kind = 'take'";
constexpr const char* kTakesOfOnePlace = " AND kind = 'take' AND place = ?";

constexpr const char* kTakesOfLeading = "takes";
constexpr const char* kTakesOfOthers = "takes_of_others";

constexpr std::size_t kMostLoose = 512;           ///< Readings kept back before they are written.
constexpr double kLongestLoose_s = 5.0;           ///< Time of readings kept back before they are written.
constexpr std::size_t kMostLooseWaiting = 20000;  ///< When none can be written the oldest go.

}  // namespace

struct SessionStore::Impl {
  std::unique_ptr<SessionFile> file;
  Plan plan;
  std::vector<PlannedPlace> places;
  TableMetadata metadata;
  QDateTime created;
  std::vector<LooseSample> loose;  ///< Not on disk yet.

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    // There is nobody left to tell when it fails; a take is never among what waits.
    if (file && !loose.empty()) (void)store([] { return Result<void>(); });
  }

  /// The one value of a query, none when it has no row or a NULL.
  Result<std::optional<QVariant>> value(const QString& sql, const QVariantList& values = {}) const {
    std::optional<QVariant> result;
    const auto done = file->read(sql, values, [&result](const QSqlQuery& row) {
      if (!row.isNull(0)) result = row.value(0);
    });
    if (!done) return tl::unexpected(done.error());
    return result;
  }

  Result<QString> meta(const QString& key) const {
    FT_TRY(const auto found, value(QStringLiteral("SELECT value FROM meta WHERE key = ?"), {key}));
    if (!found) return damaged("has no " + key.toStdString());
    return found->toString();
  }

  tl::unexpected<Error> damaged(const std::string& what) const {
    return fail(ErrorCode::kBadInput, file->path().toStdString() + ": the session file is damaged: it " + what);
  }

  Result<void> setMeta(const QString& key, const QString& value) const {
    return withoutRows(file->run(QStringLiteral("INSERT INTO meta(key, value) VALUES(?, ?)"
                                                " ON CONFLICT(key) DO UPDATE SET value = excluded.value"),
                                 {key, value}));
  }

  Result<void> writeHead() const {
    for (const auto& [key, value] :
         {std::pair{QStringLiteral("plan"), text(toJson(plan).dump())},
          std::pair{QStringLiteral("metadata"), text(metadataText(metadata))},
          std::pair{QStringLiteral("created_utc"), created.toString(Qt::ISODateWithMs)},
          std::pair{QStringLiteral("software"), QStringLiteral("fieldtrue " FIELDTRUE_VERSION)}}) {
      if (auto written = setMeta(key, value); !written) return written;
    }
    std::vector<QVariantList> rows;
    for (std::size_t place = 0; place < places.size(); ++place) {
      rows.push_back(placeValues(places[place]));
      rows.back().prepend(static_cast<qlonglong>(place));
    }
    return insert(QStringLiteral("places(place, %1)").arg(kPlaceColumns), rows);
  }

  /// @param into table and columns
  Result<void> insert(const QString& into, const std::vector<QVariantList>& rows) const {
    if (rows.empty()) return {};
    return file->runForAll(QStringLiteral("INSERT INTO %1 VALUES(%2)").arg(into, placeholders(rows.front().size())),
                           rows);
  }

  Result<void> readHead() {
    const auto plan_text = meta(QStringLiteral("plan"));
    const auto metadata_text = meta(QStringLiteral("metadata"));
    const auto created_text = meta(QStringLiteral("created_utc"));
    for (const auto* part : {&plan_text, &metadata_text, &created_text}) {
      if (!*part) return tl::unexpected(part->error());
    }
    const std::string name = file->path().toStdString();
    FT_TRY(const auto plan_json, parseJson(plan_text->toStdString(), name + ": plan"));
    FT_TRY(auto read_plan, planFromJson(plan_json, name + ": plan"));
    plan = std::move(read_plan);
    FT_TRY(const auto metadata_json, parseJson(metadata_text->toStdString(), name + ": metadata"));
    FT_TRY(auto read_metadata, readJson<TableMetadata>(metadata_json, name + ": metadata", metadataFrom));
    metadata = std::move(read_metadata);
    created = QDateTime::fromString(*created_text, Qt::ISODateWithMs);
    return readPlaces();
  }

  Result<void> readPlaces() {
    const auto read = file->read(QStringLiteral("SELECT %1 FROM places ORDER BY place").arg(kPlaceColumns), {},
                                 [this](const QSqlQuery& row) { places.push_back(readPlace(row, 0)); });
    if (!read) return read;
    if (places.empty()) return damaged("has no places");
    return {};
  }

  /// Adds an action that stands; what had been taken back can no longer be brought back.
  Result<qlonglong> addAction(std::size_t place, const char* kind, const std::string& reason) const {
    FT_TRY_VOID(file->run(QStringLiteral("UPDATE actions SET undone = 2 WHERE undone = 1")));
    FT_TRY(auto added,
           file->run(QStringLiteral("INSERT INTO actions(place, kind, reason, time_utc) VALUES(?, ?, ?, ?)"),
                     {static_cast<qlonglong>(place), QLatin1String(kind), text(reason), now()}));
    file->goOnAsItIs();
    return added.lastInsertId().toLongLong();
  }

  /// @param sensors the values of each one's row, the leading one first
  Result<qlonglong> addTake(std::size_t place, const std::string& suspicious, std::vector<QVariantList> sensors) const {
    FT_TRY(const auto action, addAction(place, "take", suspicious));
    for (QVariantList& values : sensors) values.prepend(action);
    const auto into = [](const char* table) { return QStringLiteral("%1(action, %2)").arg(table, kTakeColumns); };
    FT_TRY_VOID(insert(into(kTakesOfLeading), {sensors.front()}));
    FT_TRY_VOID(insert(into(kTakesOfOthers), {sensors.begin() + 1, sensors.end()}));
    return action;
  }

  /// @param rejected why some of them, by their number, are not in the mean
  Result<void> addSamples(qlonglong action, const std::vector<Sample>& samples,
                          std::map<std::size_t, QString> rejected = {}) const {
    std::vector<QVariantList> rows;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      QVariantList values{action, static_cast<qlonglong>(i)};
      values << sampleValues(samples[i]) << (rejected.contains(i) ? QVariant(rejected[i]) : QVariant());
      rows.push_back(std::move(values));
    }
    return insert(QStringLiteral("samples(action, seq, %1, rejected)").arg(kSampleColumns), rows);
  }

  Result<void> addLoose() const {
    std::vector<QVariantList> rows;
    for (const LooseSample& reading : loose) {
      QVariantList values{reading.cancelled_node ? QVariant(*reading.cancelled_node) : QVariant()};
      rows.push_back(values << sampleValues(reading.sample));
    }
    return insert(QStringLiteral("loose_samples(cancelled_node, %1)").arg(kSampleColumns), rows);
  }

  /// The body and the readings that wait, together or not at all.
  Result<void> store(const std::function<Result<void>()>& body) {
    const auto stored = file->transaction([&]() -> Result<void> {
      if (auto done = body(); !done) return done;
      return addLoose();
    });
    if (stored) loose.clear();
    return stored;
  }

  /// Moves the one action that matches from one undo state to another. @return its place
  Result<std::optional<std::size_t>> moveAction(const QString& which, int undone) {
    std::optional<std::size_t> place;
    const Result<void> moved = store([&]() -> Result<void> {
      qlonglong id = 0;
      const auto found =
          file->read(QStringLiteral("SELECT id, place FROM actions WHERE ") + which, {}, [&](const QSqlQuery& row) {
            id = row.value(0).toLongLong();
            place = static_cast<std::size_t>(row.value(1).toLongLong());
          });
      if (!found || !place) return found;
      return withoutRows(file->run(QStringLiteral("UPDATE actions SET undone = ? WHERE id = ?"), {undone, id}));
    });
    if (!moved) return tl::unexpected(moved.error());
    return place;
  }

  Result<bool> any(const QString& which) const {
    FT_TRY(const auto found, value(QStringLiteral("SELECT 1 FROM actions WHERE %1 LIMIT 1").arg(which)));
    return found.has_value();
  }

  using PlaceNode = std::pair<std::size_t, Node>;

  /// Live takes of every place, or of one: place by place, the leading sensor first.
  Result<std::vector<Node>> nodes(std::optional<std::size_t> only = {}) const {
    std::vector<PlaceNode> by_place;
    for (const char* table : {kTakesOfLeading, kTakesOfOthers}) FT_TRY_VOID(readNodes(table, only, by_place));
    std::stable_sort(by_place.begin(), by_place.end(),
                     [](const PlaceNode& a, const PlaceNode& b) { return a.first < b.first; });
    std::vector<Node> result;
    result.reserve(by_place.size());
    for (PlaceNode& one : by_place) result.push_back(std::move(one.second));
    return result;
  }

  Result<void> readNodes(const char* table, std::optional<std::size_t> only, std::vector<PlaceNode>& result) const {
    QVariantList values;
    if (only) values = {static_cast<qlonglong>(*only), static_cast<qlonglong>(*only)};
    const QString sql = QStringLiteral(
                            "SELECT live.place, last.kind, %1 FROM %2 live"
                            " JOIN %4 ON action = live.id"
                            " JOIN %3 newest ON newest.place = live.place"
                            " JOIN actions last ON last.id = newest.id ORDER BY live.place, sensor")
                            .arg(kTakeColumns, liveActions(only ? kTakesOfOnePlace : kTakesOfEveryPlace),
                                 liveActions(only ? kOnePlace : kEveryPlace), table);
    return file->read(sql, values, [&](const QSqlQuery& row) {
      const auto place = static_cast<std::size_t>(row.value(0).toLongLong());
      if (place >= places.size()) return;
      const PlannedPlace& planned = places[place];
      Node node;
      node.node = planned.node;
      node.visit = planned.visit;
      node.index = planned.index;
      node.reference_from_sensor = planned.reference_from_sensor;
      node.role = row.value(1).toString() == QLatin1String("skip") ? NodeRole::kSkipped : planned.role;
      readTake(row, 2, node);
      result.emplace_back(place, std::move(node));
    });
  }

  /// Raw samples of the live takes of every place, or of one.
  Result<std::vector<SampleRow>> sampleRows(std::optional<std::size_t> only = {}) const {
    QVariantList values;
    if (only) values << static_cast<qlonglong>(*only);
    const QString sql = QStringLiteral(
                            "SELECT live.place, %1 FROM %2 live JOIN samples ON samples.action = live.id"
                            " ORDER BY live.place, seq")
                            .arg(kSampleColumns, liveActions(only ? kTakesOfOnePlace : kTakesOfEveryPlace));
    std::vector<SampleRow> rows;
    const auto done = file->read(sql, values, [&](const QSqlQuery& row) {
      const auto place = static_cast<std::size_t>(row.value(0).toLongLong());
      if (place < places.size()) rows.push_back({places[place].node, places[place].visit, readSample(row, 1)});
    });
    if (!done) return tl::unexpected(done.error());
    return rows;
  }

  Result<void> appendLoose(std::vector<SampleRow>& rows) const {
    const QString sql = QStringLiteral("SELECT cancelled_node, %1 FROM loose_samples ORDER BY id").arg(kSampleColumns);
    const auto done = file->read(sql, {}, [&rows](const QSqlQuery& row) {
      LooseSample reading{readSample(row, 1), {}};
      if (!row.isNull(0)) reading.cancelled_node = row.value(0).toInt();
      rows.push_back(rowOf(std::move(reading)));
    });
    if (!done) return done;
    for (const LooseSample& reading : loose) rows.push_back(rowOf(reading));
    return {};
  }

  /// States of the places that the rows of liveActions name.
  Result<void> readStates(const char* which, const QVariantList& values, std::vector<PlaceState>& states) const {
    const QString sql = QStringLiteral(
                            "SELECT actions.place, kind, reason FROM actions JOIN %1 live"
                            " ON live.id = actions.id")
                            .arg(liveActions(which));
    return file->read(sql, values, [&states](const QSqlQuery& row) {
      const auto place = static_cast<std::size_t>(row.value(0).toLongLong());
      if (place >= states.size()) return;
      const bool skipped = row.value(1).toString() == QLatin1String("skip");
      const bool fine = row.value(2).toString().isEmpty();
      states[place] = skipped ? PlaceState::kSkipped : fine ? PlaceState::kDone : PlaceState::kSuspicious;
    });
  }

  Result<std::vector<std::pair<std::string, std::string>>> pairs(const QString& sql) const {
    std::vector<std::pair<std::string, std::string>> result;
    const auto done = file->read(sql, {}, [&result](const QSqlQuery& row) {
      result.emplace_back(row.value(0).toString().toStdString(), row.value(1).toString().toStdString());
    });
    if (!done) return tl::unexpected(done.error());
    return result;
  }
};

SampleRow rowOf(LooseSample reading) {
  if (reading.cancelled_node) reading.sample.status = "cancelled:" + std::to_string(*reading.cancelled_node);
  return {-1, 0, std::move(reading.sample)};
}

SessionStore::SessionStore(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SessionStore::SessionStore(SessionStore&&) noexcept = default;
SessionStore& SessionStore::operator=(SessionStore&&) noexcept = default;
SessionStore::~SessionStore() = default;

Result<SessionStore> SessionStore::create(const QString& path, const Plan& plan, const TableMetadata& metadata,
                                          const QDateTime& created) {
  auto file = SessionFile::create(path);
  if (!file) return tl::unexpected(file.error());
  auto impl = std::make_unique<Impl>();
  impl->file = *std::move(file);
  impl->plan = plan;
  impl->places = fieldtrue::acquisition::places(plan);
  impl->metadata = metadata;
  impl->created = created;
  if (auto written = impl->file->transaction([&] { return impl->writeHead(); }); !written) {
    impl.reset();
    QFile::remove(path);
    return tl::unexpected(written.error());
  }
  return SessionStore(std::move(impl));
}

Result<SessionStore> SessionStore::open(const QString& path) {
  auto file = SessionFile::open(path);
  if (!file) return tl::unexpected(file.error());
  auto impl = std::make_unique<Impl>();
  impl->file = *std::move(file);
  FT_TRY_VOID(impl->readHead());
  return SessionStore(std::move(impl));
}

const QString& SessionStore::path() const { return impl_->file->path(); }
const Plan& SessionStore::plan() const { return impl_->plan; }
const std::vector<PlannedPlace>& SessionStore::places() const { return impl_->places; }
const TableMetadata& SessionStore::metadata() const { return impl_->metadata; }
QDateTime SessionStore::created() const { return impl_->created; }

Result<void> SessionStore::setMetadata(const TableMetadata& metadata) {
  auto written = impl_->setMeta(QStringLiteral("metadata"), text(metadataText(metadata)));
  if (written) impl_->metadata = metadata;
  return written;
}

bool SessionStore::isReadOnly() const { return impl_->file->isReadOnly(); }
const std::vector<std::string>& SessionStore::remarks() const { return impl_->file->remarks(); }

Result<std::vector<PlaceState>> SessionStore::states() const {
  std::vector<PlaceState> result(places().size(), PlaceState::kPlanned);
  if (auto read = impl_->readStates(kEveryPlace, {}, result); !read) return tl::unexpected(read.error());
  return result;
}

Result<PlaceState> SessionStore::state(std::size_t place) const {
  std::vector<PlaceState> result(place + 1, PlaceState::kPlanned);
  FT_TRY_VOID(impl_->readStates(kOnePlace, {static_cast<qlonglong>(place)}, result));
  return result.back();
}

Result<void> SessionStore::storeTake(std::size_t place, const std::vector<SensorTake>& sensors,
                                     const std::string& suspicious) {
  FT_CHECK(place < places().size() && !sensors.empty());
  std::vector<QVariantList> values;
  std::vector<Sample> samples;
  std::map<std::size_t, QString> rejected;
  for (const SensorTake& take : sensors) {
    values.push_back(takeValues(take.samples, take.statistics));
    for (const Rejection& rejection : take.statistics.rejections)
      rejected[samples.size() + rejection.sample] = text(rejection.text);
    samples.insert(samples.end(), take.samples.begin(), take.samples.end());
  }
  return impl_->store([&]() -> Result<void> {
    FT_TRY(const auto action, impl_->addTake(place, suspicious, values));
    return impl_->addSamples(action, samples, rejected);
  });
}

Result<void> SessionStore::storeForeign(const std::vector<ForeignTake>& takes) {
  return impl_->store([&]() -> Result<void> {
    for (const ForeignTake& take : takes) {
      FT_CHECK(take.place < places().size() && !take.means.empty());
      std::vector<QVariantList> values;
      for (const Node& mean : take.means) values.push_back(takeValues(mean));
      FT_TRY(const auto action, impl_->addTake(take.place, {}, values));
      FT_TRY_VOID(impl_->addSamples(action, take.samples));
      if (take.means.front().role == NodeRole::kSkipped)
        FT_TRY_VOID(impl_->addAction(take.place, "skip", "skipped in the imported recording"));
    }
    return {};
  });
}

Result<void> SessionStore::skip(std::size_t place, const std::string& reason) {
  FT_CHECK(place < places().size());
  return impl_->store([&]() -> Result<void> {
    FT_TRY_VOID(impl_->addAction(place, "skip", reason));
    return {};
  });
}

Result<std::optional<std::size_t>> SessionStore::undo() {
  return impl_->moveAction(QStringLiteral("undone = 0 ORDER BY id DESC LIMIT 1"), 1);
}

Result<std::optional<std::size_t>> SessionStore::redo() {
  return impl_->moveAction(QStringLiteral("undone = 1 ORDER BY id LIMIT 1"), 0);
}

Result<bool> SessionStore::canUndo() const { return impl_->any(QStringLiteral("undone = 0")); }
Result<bool> SessionStore::canRedo() const { return impl_->any(QStringLiteral("undone = 1")); }

Result<void> SessionStore::keepLoose(const std::vector<LooseSample>& readings) {
  if (isReadOnly()) return {};
  std::vector<LooseSample>& waiting = impl_->loose;
  waiting.insert(waiting.end(), readings.begin(), readings.end());
  if (waiting.size() < kMostLoose &&
      (waiting.empty() || waiting.back().sample.time_s - waiting.front().sample.time_s < kLongestLoose_s)) {
    return {};
  }
  auto written = flush();
  if (!written && waiting.size() > kMostLooseWaiting) waiting.erase(waiting.begin(), waiting.end() - kMostLooseWaiting);
  return written;
}

Result<void> SessionStore::flush() {
  if (impl_->loose.empty()) return {};
  return impl_->store([] { return Result<void>(); });
}

Result<void> SessionStore::addEvent(const std::string& kind, const std::string& what) {
  return withoutRows(impl_->file->run(QStringLiteral("INSERT INTO events(time_utc, kind, text) VALUES(?, ?, ?)"),
                                      {now(), text(kind), text(what)}));
}

Result<std::vector<std::pair<std::string, std::string>>> SessionStore::events() const {
  return impl_->pairs(QStringLiteral("SELECT kind, text FROM events ORDER BY id"));
}

Result<void> SessionStore::storeFit(const std::string& name, const std::string& ftcal_text) {
  return withoutRows(impl_->file->run(QStringLiteral("INSERT INTO fits(time_utc, name, ftcal) VALUES(?, ?, ?)"),
                                      {now(), text(name), text(ftcal_text)}));
}

Result<std::vector<std::pair<std::string, std::string>>> SessionStore::fits() const {
  return impl_->pairs(QStringLiteral("SELECT name, ftcal FROM fits ORDER BY id DESC"));
}

Result<void> SessionStore::setState(const std::string& key, const std::string& value) {
  if (isReadOnly()) return {};  // Where the window stood is no data.
  return withoutRows(impl_->file->run(QStringLiteral("INSERT INTO state(key, value) VALUES(?, ?)"
                                                     " ON CONFLICT(key) DO UPDATE SET value = excluded.value"),
                                      {text(key), text(value)}));
}

Result<std::string> SessionStore::state(const std::string& key) const {
  FT_TRY(const auto found, impl_->value(QStringLiteral("SELECT value FROM state WHERE key = ?"), {text(key)}));
  return found ? found->toString().toStdString() : std::string();
}

Result<CalibrationTable> SessionStore::nodeTable() const {
  FT_TRY(auto nodes, impl_->nodes());
  return CalibrationTable{metadata(), std::move(nodes)};
}

Result<SampleTable> SessionStore::sampleTable() const {
  FT_TRY(auto rows, impl_->sampleRows());
  FT_TRY_VOID(impl_->appendLoose(rows));
  return SampleTable{metadata(), std::move(rows)};
}

Result<std::vector<Node>> SessionStore::nodes(std::size_t place) const { return impl_->nodes(place); }

Result<std::vector<Sample>> SessionStore::samples(std::size_t place) const {
  FT_TRY(auto rows, impl_->sampleRows(place));
  std::vector<Sample> result;
  for (SampleRow& row : rows) result.push_back(std::move(row.sample));
  return result;
}

Result<std::optional<double>> SessionStore::newestSample_s() const {
  std::optional<double> newest_s;
  for (const char* sql : {"SELECT MAX(t_end_s) FROM takes", "SELECT MAX(t_end_s) FROM takes_of_others",
                          "SELECT t_s FROM loose_samples ORDER BY id DESC LIMIT 1"}) {
    FT_TRY(const auto found, impl_->value(QLatin1String(sql)));
    if (found) newest_s = std::max(newest_s.value_or(found->toDouble()), found->toDouble());
  }
  for (const LooseSample& reading : impl_->loose) {
    newest_s = std::max(newest_s.value_or(reading.sample.time_s), reading.sample.time_s);
  }
  return newest_s;
}

Result<void> SessionStore::limitSize(std::int64_t bytes) {
  FT_TRY(const auto page_size, impl_->value(QStringLiteral("PRAGMA page_size")));
  const qint64 page_bytes = page_size ? page_size->toLongLong() : 4096;
  return withoutRows(
      impl_->file->run(QStringLiteral("PRAGMA max_page_count=%1").arg(std::max<qint64>(1, bytes / page_bytes))));
}

}  // namespace fieldtrue::acquisition
