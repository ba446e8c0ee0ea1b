#include "tools/batch/recording_identity.h"

#include "proto/base/number_text.h"

namespace relmap::batch {

std::string change_text(const RecordingIdentity& then, const RecordingIdentity& now, bool photographs) {
  const std::string what = photographs ? "picture" : then.calibration.empty() ? "keyframe" : "pair";
  std::string text;
  if (then.fingerprint != now.fingerprint && (!photographs || then.count == now.count))
    text = "is made of another recording of " + counted_text(then.count, what) + " than the one of " +
           count_text(now.count) + " that is there now";
  else if (then.count != now.count)
    text = "is made of " + counted_text(then.count, what) + ", and there " + (now.count == 1 ? "is " : "are ") +
           count_text(now.count) + " now";
  else if (then.contents != now.contents)
    text = "is made of " + counted_text(then.count, what) + ", some of which are others now (by name, size or time)";
  if (then.calibration != now.calibration)
    text += std::string(text.empty() ? "" : ", and ") + "is made with another calibration (" + then.calibration +
            ") than the one that is there now (" + now.calibration + ")";
  return text;
}

}  // namespace relmap::batch
