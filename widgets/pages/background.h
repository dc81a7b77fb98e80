#pragma once

#include <QObject>
#include <QPointer>
#include <QThreadPool>
#include <functional>
#include <memory>
#include <utility>

namespace fieldtrue {

/// Runs `work` on a pool thread and hands its result to `done` on the thread of `receiver`; nothing is called once the
/// receiver is gone.
/// @param work no arguments, returns a value; must not touch widgets
template <class Work, class Done>
void runInBackground(QObject* receiver, Work work, Done done) {
  QPointer<QObject> guard(receiver);
  QThreadPool::globalInstance()->start([guard, work = std::move(work), done = std::move(done)]() mutable {
    auto result = std::make_shared<decltype(work())>(work());
    if (!guard) return;
    QMetaObject::invokeMethod(
        guard.data(), [result, done = std::move(done)]() mutable { done(std::move(*result)); }, Qt::QueuedConnection);
  });
}

}  // namespace fieldtrue
