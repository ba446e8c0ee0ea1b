#include "server/intake/acknowledgement.h"

namespace relmap::intake {

SteadyTime AcknowledgementSchedule::due(bool imperfect) const {
  if (news_) return sent_ + times_.spacing;
  const SteadyTime next = sent_ + (imperfect ? times_.imperfect : times_.regular);
  return next <= heard_ + times_.active ? next : SteadyTime::max();
}

}  // namespace relmap::intake
