#include "acquisition/transports/followed_line.h"

#include <algorithm>
#include <utility>

namespace fieldtrue::acquisition {

FollowedLine::FollowedLine(std::string address, std::string system_folder)
    : path_(std::move(address)), system_folder_(std::move(system_folder)) {
  const std::size_t at = std::min(path_.rfind('@'), path_.size());
  rate_ = path_.substr(at);
  path_.resize(at);
}

std::string FollowedLine::now() {
  if (!adapter_) adapter_ = usbAdapterOf(path_, system_folder_);
  if (adapter_) path_ = portOf(*adapter_, system_folder_).value_or(path_);
  return path_ + rate_;
}

}  // namespace fieldtrue::acquisition
