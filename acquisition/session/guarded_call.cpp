#include "acquisition/session/guarded_call.h"

#include "calib/core/exception_barrier.h"

namespace fieldtrue::acquisition {

void guarded(AcquisitionController& controller, const std::function<void()>& call) {
  const Result<void> done = withBarrier("a take under way was given up, and what is stored stands", call);
  if (done) return;
  // What made the call throw may do so again; its first sentence is the one that tells.
  static_cast<void>(withBarrier({}, [&controller] { controller.cancelTake(); }));
  emit controller.failed(QString::fromStdString(done.error().message));
}

}  // namespace fieldtrue::acquisition
