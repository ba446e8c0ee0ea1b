// What training pictures show: the descriptors of each, found on all cores.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "server/place/descriptor.h"

namespace relmap::vocab {

// One entry a picture, in the order of `files`; of each file at most `views` (training_views.h). Pictures that show
// next to nothing are left out: there are no such places. The same for any number of cores. NOT_A_PICTURE.
Result<std::vector<std::vector<place::Descriptor>>> describe_pictures(const std::vector<std::string>& files,
                                                                      std::size_t views,
                                                                      const std::function<void(double)>& progress);

}  // namespace relmap::vocab
