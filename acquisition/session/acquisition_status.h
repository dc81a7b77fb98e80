#pragma once

#include <QElapsedTimer>
#include <QTimer>

#include "acquisition/session/acquisition_controller.h"
#include "acquisition/session/acquisition_places.h"

namespace fieldtrue::acquisition {

/// What the views were told last of what changes seldom, and when they are told again.
struct ViewUpdates {
  explicit ViewUpdates(QObject* owner) : status_timer(owner) { status_timer.setSingleShot(true); }

  void tellSoon();  ///< At most about 30 times a second.
  std::shared_ptr<const PlannedSession> session(const std::optional<SessionStore>& store) const;
  std::shared_ptr<const RecordedPlaces> recorded(const KnownPlaces& places) const;

  std::uint64_t revision = 0;
  /// As they were told last; null when what they tell has changed since.
  mutable std::shared_ptr<const PlannedSession> told_session;
  mutable std::shared_ptr<const RecordedPlaces> told_recorded;
  QTimer status_timer;
  QElapsedTimer since_status;
};

}  // namespace fieldtrue::acquisition
