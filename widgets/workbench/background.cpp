#include "widgets/workbench/background.h"

namespace fieldtrue::widgets {

Postbox::Postbox(QObject* receiver) : address_(std::make_shared<Address>()) {
  address_->receiver = receiver;
  address_->until_destroyed = QObject::connect(receiver, &QObject::destroyed, [address = std::weak_ptr(address_)] {
    const auto known = address.lock();
    if (!known) return;
    const std::lock_guard lock(known->mutex);
    known->receiver = nullptr;
  });
}

void Postbox::post(std::function<void()> call) const {
  const std::lock_guard lock(address_->mutex);
  if (address_->receiver != nullptr)
    QMetaObject::invokeMethod(address_->receiver, std::move(call), Qt::QueuedConnection);
}

}  // namespace fieldtrue::widgets
