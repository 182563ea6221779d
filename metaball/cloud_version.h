// A cloud as it was at some time: what is kept of it is checked against this.
#pragma once

#include <memory>

#include "metaball/cloud.h"

namespace sherd {

class CloudVersion {
 public:
  CloudVersion() = default;  // of none
  explicit CloudVersion(const std::shared_ptr<const Cloud>& cloud)
      : cloud_(cloud), revisions_(cloud->revisions) {}

  // Whether `cloud`, not null, is that cloud and nothing of it has changed since.
  bool Is(const std::shared_ptr<const Cloud>& cloud) const {
    return cloud_.lock() == cloud && revisions_ == cloud->revisions;
  }

 private:
  // Weak: it does not keep the cloud alive, and a new one at the same address is not taken for it.
  std::weak_ptr<const Cloud> cloud_;
  CloudRevisions revisions_;
};

}  // namespace sherd
