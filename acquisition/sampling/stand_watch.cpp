#include "acquisition/sampling/stand_watch.h"

#include "acquisition/sampling/stillness.h"

namespace fieldtrue::acquisition {

namespace {

constexpr std::size_t kRecent = 5;
constexpr double kLeaveAngle_rad = 0.35;

}  // namespace

void StandWatch::setLeaveDistance(double leave_distance_m) { leave_distance_m_ = leave_distance_m; }

void StandWatch::setTaken(const Pose& tracker_from_sensor) {
  forget();
  stand_ = tracker_from_sensor;
  taken_ = true;
}

void StandWatch::setStopped(const std::optional<Pose>& tracker_from_sensor) {
  forget();
  stand_ = tracker_from_sensor;
  taken_ = stopped_ = true;
}

void StandWatch::forget() {
  stand_.reset();
  recent_.clear();
  taken_ = left_ = stopped_ = false;
}

void StandWatch::add(const Sample& sample, bool still) {
  newest_s_ = sample.time_s;
  if (!still) still_since_s_.reset();
  if (still && !still_since_s_) still_since_s_ = sample.time_s;
  if (!isGood(sample)) return;
  recent_.push_back(sample.tracker_from_sensor);
  if (recent_.size() > kRecent) recent_.pop_front();
  if (recent_.size() < kRecent) return;
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  for (const Pose& pose : recent_) mean_m += pose.position_m / static_cast<double>(kRecent);
  const Pose& middle = recent_[kRecent / 2];
  if (!stand_) stand_ = Pose{mean_m, middle.orientation};
  const bool moved_away = (mean_m - stand_->position_m).norm() > leave_distance_m_;
  left_ = left_ || moved_away || angleBetween_rad(middle.orientation, stand_->orientation) > kLeaveAngle_rad;
}

double StandWatch::rested_s() const { return still_since_s_ ? newest_s_ - *still_since_s_ : 0.0; }

}  // namespace fieldtrue::acquisition
