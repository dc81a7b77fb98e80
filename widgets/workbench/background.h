#pragma once

#include <QObject>
#include <QThreadPool>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <utility>

#include "calib/core/exception_barrier.h"
#include "calib/core/run_control.h"
#include "calib/core/thread_pool.h"

namespace fieldtrue::widgets {

/// Hands calls from any thread to the thread of a receiver that may go away meanwhile; calls after that are dropped.
/// To be made on the receiver's thread; copies go to the same receiver.
class Postbox {
 public:
  explicit Postbox(QObject* receiver);

  void post(std::function<void()> call) const;

 private:
  /// A pointer that guards itself (QPointer) may only be looked at on the receiver's own thread: elsewhere it can die
  /// between the look and the use. The receiver takes itself out under the lock instead, and so waits for a call that
  /// is being posted.
  struct Address {
    std::mutex mutex;
    QObject* receiver = nullptr;
    QMetaObject::Connection until_destroyed;
    ~Address() { QObject::disconnect(until_destroyed); }
  };
  std::shared_ptr<Address> address_;
};

/// Runs `work` on a pool thread and hands its result to `done` on the thread of `receiver`; nothing is called once the
/// receiver is gone. What the work throws arrives as an error.
/// @param work no arguments, returns a Result or a value; must not touch widgets
/// @param done takes the work's Result, or Result of its value
template <class Work, class Done>
void runInBackground(QObject* receiver, Work work, Done done) {
  QThreadPool::globalInstance()->start(
      [box = Postbox(receiver), work = std::move(work), done = std::move(done)]() mutable {
        auto result = std::make_shared<decltype(withBarrier("", work))>(withBarrier("nothing was changed", work));
        box.post([result, done = std::move(done)]() mutable { done(std::move(*result)); });
      });
}

/// Work of one object on pool threads. What is stopped, or is still running when its owner goes, answers nobody.
/// To be used on the owner's thread, and to be a member of the owner.
class BackgroundJobs {
 public:
  explicit BackgroundJobs(QObject* owner) : owner_(owner) {}
  BackgroundJobs(const BackgroundJobs&) = delete;
  BackgroundJobs& operator=(const BackgroundJobs&) = delete;
  ~BackgroundJobs() { stop_.request_stop(); }

  bool busy() const { return running_ > 0; }
  void stop() {
    stop_.request_stop();
    stop_ = std::stop_source();
    ++generation_;
    running_ = 0;
  }

  /// @param work takes a RunControl (all cores, stopped by stop()), returns a Result or a value; must not touch widgets
  /// @param done takes the work's Result, or Result of its value, on the owner's thread
  /// @param progress takes the fraction done, on the owner's thread
  template <class Work, class Done>
  void run(Work work, Done done, const std::function<void(double)>& progress = {}) {
    RunControl control;
    control.parallel_for = threadedFor(0);
    control.stop = stop_.get_token();
    if (progress)
      control.progress = [this, progress, generation = generation_, box = Postbox(owner_)](double fraction) {
        box.post([this, progress, generation, fraction] {
          if (generation == generation_) progress(fraction);
        });
      };
    ++running_;
    runInBackground(
        owner_, [work = std::move(work), control] { return work(control); },
        [this, done = std::move(done), generation = generation_](auto result) mutable {
          if (generation != generation_) return;
          --running_;
          done(std::move(result));
        });
  }

 private:
  QObject* owner_;
  std::stop_source stop_;
  int generation_ = 0;
  int running_ = 0;
};

}  // namespace fieldtrue::widgets
