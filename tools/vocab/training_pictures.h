// Computes the descriptors of training pictures, on all cores.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "server/place/descriptor.h"

namespace relmap::vocab {

// One entry for each picture, in the order of `files`; a file gives at most `views` pictures (training_views.h).
// Pictures with too few features are left out, since they show no place. The result does not depend on the number of
// cores. NOT_A_PICTURE.
Result<std::vector<std::vector<place::Descriptor>>> describe_pictures(const std::vector<std::string>& files,
                                                                      std::size_t views,
                                                                      const std::function<void(double)>& progress);

}  // namespace relmap::vocab
