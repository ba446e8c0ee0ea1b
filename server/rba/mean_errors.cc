#include "server/rba/mean_errors.h"

#include <algorithm>
#include <cmath>

#include "server/rba/measurement.h"

namespace relmap::rba {

void mean_errors(const Problem& problem, const std::vector<SE3>& poses, std::size_t frames,
                 std::vector<MeanError>* errors) {
  errors->assign(frames, {});
  for (const ProblemLandmark& point : problem.landmarks) {
    for (std::int32_t o = point.first_observation; o < point.end_observation; ++o) {
      const ProblemObservation& seen = problem.observations[o];
      StereoPixel h;
      double error = kMaxError;
      if (predict(problem.cameras[seen.camera], scaled_point(poses[seen.node], point.abr), point.abr.z(), &h))
        error = std::min(error, std::sqrt(seen.information * residual(seen.z, seen.mono, h).squaredNorm()));
      (*errors)[seen.frame].sum += error;
      ++(*errors)[seen.frame].terms;
    }
  }
}

}  // namespace relmap::rba
