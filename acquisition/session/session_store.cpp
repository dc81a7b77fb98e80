#include "acquisition/session/session_store.h"

#include <QFile>
#include <QStringList>
#include <algorithm>
#include <map>

#include "acquisition/session/metadata_json.h"
#include "acquisition/session/session_file.h"
#include "acquisition/session/session_rows.h"

namespace fieldtrue {

namespace {

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

/// The newest standing action of every place.
constexpr const char* kLiveActions = "(SELECT place, MAX(id) AS id FROM actions WHERE undone = 0 GROUP BY place)";
/// The newest standing take of every place, also where a skip came later.
constexpr const char* kLiveTakes =
    "(SELECT place, MAX(id) AS id FROM actions WHERE undone = 0 AND kind = 'take' GROUP BY place)";

}  // namespace

struct SessionStore::Impl {
  std::unique_ptr<SessionFile> file;
  Plan plan;
  std::vector<PlannedPlace> places;
  TableMetadata metadata;
  QDateTime created;

  Result<QString> meta(const QString& key) const {
    auto query = file->run(QStringLiteral("SELECT value FROM meta WHERE key = ?"), {key});
    if (!query) return tl::unexpected(query.error());
    if (!query->next()) return damaged("has no " + key.toStdString());
    return query->value(0).toString();
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
          std::pair{QStringLiteral("metadata"), text(toJson(metadata).dump())},
          std::pair{QStringLiteral("created_utc"), created.toString(Qt::ISODateWithMs)},
          std::pair{QStringLiteral("software"), QStringLiteral("fieldtrue " FIELDTRUE_VERSION)}}) {
      if (auto written = setMeta(key, value); !written) return written;
    }
    for (std::size_t place = 0; place < places.size(); ++place) {
      QVariantList values = placeValues(places[place]);
      values.prepend(static_cast<qlonglong>(place));
      auto written = file->run(
          QStringLiteral("INSERT INTO places(place, %1) VALUES(%2)").arg(kPlaceColumns, placeholders(values.size())),
          values);
      if (!written) return tl::unexpected(written.error());
    }
    return {};
  }

  Result<void> readHead() {
    const auto plan_text = meta(QStringLiteral("plan"));
    const auto metadata_text = meta(QStringLiteral("metadata"));
    const auto created_text = meta(QStringLiteral("created_utc"));
    for (const auto* part : {&plan_text, &metadata_text, &created_text}) {
      if (!*part) return tl::unexpected(part->error());
    }
    const auto plan_json = nlohmann::json::parse(plan_text->toStdString(), nullptr, false);
    if (plan_json.is_discarded()) return damaged("has no readable plan");
    auto read_plan = planFromJson(plan_json, file->path().toStdString() + ": plan");
    if (!read_plan) return tl::unexpected(read_plan.error());
    plan = *std::move(read_plan);
    metadata = metadataFromJson(nlohmann::json::parse(metadata_text->toStdString(), nullptr, false));
    created = QDateTime::fromString(*created_text, Qt::ISODateWithMs);
    return readPlaces();
  }

  Result<void> readPlaces() {
    auto query = file->run(QStringLiteral("SELECT %1 FROM places ORDER BY place").arg(kPlaceColumns));
    if (!query) return tl::unexpected(query.error());
    while (query->next()) places.push_back(readPlace(*query, 0));
    if (places.empty()) return damaged("has no places");
    return {};
  }

  /// Adds an action that stands; what had been taken back can no longer be brought back.
  Result<qlonglong> addAction(std::size_t place, const char* kind, const std::string& reason) const {
    auto overtaken = file->run(QStringLiteral("UPDATE actions SET undone = 2 WHERE undone = 1"));
    if (!overtaken) return tl::unexpected(overtaken.error());
    auto added = file->run(QStringLiteral("INSERT INTO actions(place, kind, reason, time_utc) VALUES(?, ?, ?, ?)"),
                           {static_cast<qlonglong>(place), QLatin1String(kind), text(reason), now()});
    if (!added) return tl::unexpected(added.error());
    return added->lastInsertId().toLongLong();
  }

  Result<void> addSamples(qlonglong action, const std::vector<Sample>& samples,
                          const NodeStatistics& statistics) const {
    std::map<std::size_t, QString> rejected;
    for (const Rejection& rejection : statistics.rejections) rejected[rejection.sample] = text(rejection.text);
    const QString sql = QStringLiteral("INSERT INTO samples(action, seq, %1, rejected) VALUES(%2)")
                            .arg(kSampleColumns, placeholders(sampleValues({}).size() + 3));
    for (std::size_t i = 0; i < samples.size(); ++i) {
      QVariantList values{action, static_cast<qlonglong>(i)};
      values << sampleValues(samples[i]) << (rejected.contains(i) ? QVariant(rejected[i]) : QVariant());
      if (auto added = file->run(sql, values); !added) return tl::unexpected(added.error());
    }
    return {};
  }

  /// Moves the one action that matches from one undo state to another. @return its place
  Result<std::optional<std::size_t>> moveAction(const QString& which, int undone) {
    std::optional<std::size_t> place;
    const Result<void> moved = file->transaction([&]() -> Result<void> {
      auto found = file->run(QStringLiteral("SELECT id, place FROM actions WHERE ") + which);
      if (!found) return tl::unexpected(found.error());
      if (!found->next()) return {};
      place = static_cast<std::size_t>(found->value(1).toLongLong());
      const qlonglong id = found->value(0).toLongLong();
      found->finish();
      return withoutRows(file->run(QStringLiteral("UPDATE actions SET undone = ? WHERE id = ?"), {undone, id}));
    });
    if (!moved) return tl::unexpected(moved.error());
    return place;
  }

  bool anyAction(int undone) const {
    auto query = file->run(QStringLiteral("SELECT 1 FROM actions WHERE undone = ? LIMIT 1"), {undone});
    return query && query->next();
  }

  std::vector<Node> nodes(const QString& where, const QVariantList& values) const {
    auto query = file->run(QStringLiteral("SELECT live.place, last.kind, %1 FROM %2 live"
                                          " JOIN takes ON takes.action = live.id"
                                          " JOIN %3 newest ON newest.place = live.place"
                                          " JOIN actions last ON last.id = newest.id %4 ORDER BY live.place")
                               .arg(kTakeColumns, kLiveTakes, kLiveActions, where),
                           values);
    std::vector<Node> result;
    while (query && query->next()) {
      const auto place = static_cast<std::size_t>(query->value(0).toLongLong());
      if (place >= places.size()) continue;
      const PlannedPlace& planned = places[place];
      Node node;
      node.node = planned.node;
      node.visit = planned.visit;
      node.index = planned.index;
      node.reference_from_sensor = planned.reference_from_sensor;
      node.role = query->value(1).toString() == QLatin1String("skip") ? NodeRole::kSkipped : planned.role;
      readTake(*query, 2, node);
      result.push_back(node);
    }
    return result;
  }

  std::vector<SampleRow> sampleRows(const QString& where, const QVariantList& values) const {
    auto query = file->run(QStringLiteral("SELECT live.place, %1 FROM %2 live JOIN samples ON samples.action = live.id"
                                          " %3 ORDER BY live.place, seq")
                               .arg(kSampleColumns, kLiveTakes, where),
                           values);
    std::vector<SampleRow> rows;
    while (query && query->next()) {
      const auto place = static_cast<std::size_t>(query->value(0).toLongLong());
      if (place >= places.size()) continue;
      rows.push_back({places[place].node, places[place].visit, readSample(*query, 1)});
    }
    return rows;
  }

  std::vector<std::pair<std::string, std::string>> pairs(const QString& sql) const {
    auto query = file->run(sql);
    std::vector<std::pair<std::string, std::string>> result;
    while (query && query->next()) {
      result.emplace_back(query->value(0).toString().toStdString(), query->value(1).toString().toStdString());
    }
    return result;
  }
};

SessionStore::SessionStore(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SessionStore::SessionStore(SessionStore&&) noexcept = default;
SessionStore& SessionStore::operator=(SessionStore&&) noexcept = default;
SessionStore::~SessionStore() = default;

Result<SessionStore> SessionStore::create(const QString& path, const Plan& plan, const TableMetadata& metadata) {
  auto file = SessionFile::create(path);
  if (!file) return tl::unexpected(file.error());
  auto impl = std::make_unique<Impl>();
  impl->file = *std::move(file);
  impl->plan = plan;
  impl->places = fieldtrue::places(plan);
  impl->metadata = metadata;
  impl->created = QDateTime::currentDateTimeUtc();
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
  if (auto read = impl->readHead(); !read) return tl::unexpected(read.error());
  return SessionStore(std::move(impl));
}

const QString& SessionStore::path() const { return impl_->file->path(); }
const Plan& SessionStore::plan() const { return impl_->plan; }
const std::vector<PlannedPlace>& SessionStore::places() const { return impl_->places; }
const TableMetadata& SessionStore::metadata() const { return impl_->metadata; }
QDateTime SessionStore::created() const { return impl_->created; }

Result<void> SessionStore::setMetadata(const TableMetadata& metadata) {
  auto written = impl_->setMeta(QStringLiteral("metadata"), text(toJson(metadata).dump()));
  if (written) impl_->metadata = metadata;
  return written;
}

std::vector<PlaceState> SessionStore::states() const {
  std::vector<PlaceState> result(places().size(), PlaceState::kPlanned);
  auto query = impl_->file->run(
      QStringLiteral("SELECT actions.place, kind, reason FROM actions JOIN %1 live ON live.id = actions.id")
          .arg(kLiveActions));
  while (query && query->next()) {
    const auto place = static_cast<std::size_t>(query->value(0).toLongLong());
    if (place >= result.size()) continue;
    const bool skipped = query->value(1).toString() == QLatin1String("skip");
    const bool fine = query->value(2).toString().isEmpty();
    result[place] = skipped ? PlaceState::kSkipped : fine ? PlaceState::kDone : PlaceState::kSuspicious;
  }
  return result;
}

std::optional<std::size_t> SessionStore::nextPlace() const {
  const std::vector<PlaceState> all = states();
  const auto next = std::find(all.begin(), all.end(), PlaceState::kPlanned);
  if (next == all.end()) return std::nullopt;
  return static_cast<std::size_t>(next - all.begin());
}

Result<void> SessionStore::storeTake(std::size_t place, const std::vector<Sample>& samples,
                                     const NodeStatistics& statistics, const std::string& suspicious) {
  FT_CHECK(place < places().size());
  return impl_->file->transaction([&]() -> Result<void> {
    const auto action = impl_->addAction(place, "take", suspicious);
    if (!action) return tl::unexpected(action.error());
    QVariantList values = takeValues(samples, statistics);
    values.prepend(*action);
    auto take = impl_->file->run(
        QStringLiteral("INSERT INTO takes(action, %1) VALUES(%2)").arg(kTakeColumns, placeholders(values.size())),
        values);
    if (!take) return tl::unexpected(take.error());
    return impl_->addSamples(*action, samples, statistics);
  });
}

Result<void> SessionStore::skip(std::size_t place, const std::string& reason) {
  FT_CHECK(place < places().size());
  return impl_->file->transaction([&]() -> Result<void> {
    const auto action = impl_->addAction(place, "skip", reason);
    if (!action) return tl::unexpected(action.error());
    return {};
  });
}

Result<std::optional<std::size_t>> SessionStore::undo() {
  return impl_->moveAction(QStringLiteral("undone = 0 ORDER BY id DESC LIMIT 1"), 1);
}

Result<std::optional<std::size_t>> SessionStore::redo() {
  return impl_->moveAction(QStringLiteral("undone = 1 ORDER BY id LIMIT 1"), 0);
}

bool SessionStore::canUndo() const { return impl_->anyAction(0); }
bool SessionStore::canRedo() const { return impl_->anyAction(1); }

Result<void> SessionStore::addEvent(const std::string& kind, const std::string& what) {
  return withoutRows(impl_->file->run(QStringLiteral("INSERT INTO events(time_utc, kind, text) VALUES(?, ?, ?)"),
                                      {now(), text(kind), text(what)}));
}

std::vector<std::pair<std::string, std::string>> SessionStore::events() const {
  return impl_->pairs(QStringLiteral("SELECT kind, text FROM events ORDER BY id"));
}

Result<void> SessionStore::storeFit(const std::string& name, const std::string& ftcal_text) {
  return withoutRows(impl_->file->run(QStringLiteral("INSERT INTO fits(time_utc, name, ftcal) VALUES(?, ?, ?)"),
                                      {now(), text(name), text(ftcal_text)}));
}

std::vector<std::pair<std::string, std::string>> SessionStore::fits() const {
  return impl_->pairs(QStringLiteral("SELECT name, ftcal FROM fits ORDER BY id DESC"));
}

Result<void> SessionStore::setState(const std::string& key, const std::string& value) {
  return withoutRows(impl_->file->run(QStringLiteral("INSERT INTO state(key, value) VALUES(?, ?)"
                                                     " ON CONFLICT(key) DO UPDATE SET value = excluded.value"),
                                      {text(key), text(value)}));
}

std::string SessionStore::state(const std::string& key) const {
  auto query = impl_->file->run(QStringLiteral("SELECT value FROM state WHERE key = ?"), {text(key)});
  return query && query->next() ? query->value(0).toString().toStdString() : std::string();
}

CalibrationTable SessionStore::nodeTable() const { return {metadata(), impl_->nodes({}, {})}; }

SampleTable SessionStore::sampleTable() const { return {metadata(), impl_->sampleRows({}, {})}; }

std::optional<Node> SessionStore::node(std::size_t place) const {
  const std::vector<Node> found = impl_->nodes(QStringLiteral("WHERE live.place = ?"), {static_cast<qlonglong>(place)});
  return found.empty() ? std::nullopt : std::optional(found.front());
}

std::vector<Sample> SessionStore::samples(std::size_t place) const {
  std::vector<Sample> result;
  for (SampleRow& row : impl_->sampleRows(QStringLiteral("WHERE live.place = ?"), {static_cast<qlonglong>(place)})) {
    result.push_back(std::move(row.sample));
  }
  return result;
}

std::optional<double> SessionStore::newestSample_s() const {
  auto query = impl_->file->run(QStringLiteral("SELECT MAX(t_end_s) FROM takes"));
  if (!query || !query->next() || query->isNull(0)) return std::nullopt;
  return query->value(0).toDouble();
}

Result<void> SessionStore::limitSize(std::int64_t bytes) {
  auto page_size = impl_->file->run(QStringLiteral("PRAGMA page_size"));
  if (!page_size) return tl::unexpected(page_size.error());
  const qint64 page_bytes = page_size->next() ? page_size->value(0).toLongLong() : 4096;
  page_size->finish();
  return withoutRows(
      impl_->file->run(QStringLiteral("PRAGMA max_page_count=%1").arg(std::max<qint64>(1, bytes / page_bytes))));
}

}  // namespace fieldtrue
