#pragma once

#include <QWidget>

class QVariantAnimation;

namespace fieldtrue::widgets {

/// A ring that fills with the samples of a take and flashes once when they are complete.
class SampleRing : public QWidget {
  Q_OBJECT
 public:
  enum class State { kIdle, kCollecting, kDone, kFailed };

  explicit SampleRing(QWidget* parent = nullptr);

  void setProgress(int collected, int wanted, State state);
  State state() const { return state_; }

  QSize sizeHint() const override;
  QSize minimumSizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  QColor color() const;

  int collected_ = 0;
  int wanted_ = 60;
  State state_ = State::kIdle;
  double flash_ = 0.0;
  QVariantAnimation* flashing_ = nullptr;
};

}  // namespace fieldtrue::widgets
