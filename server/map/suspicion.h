// How doubtful a loop closure is, from what is stored with it (docs/evidence.md). It decides nothing, and orders
// closures for those who look at them: of many closures in force, the wrong ones come first.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "storage/graph/digest.h"

namespace relmap::map {

// What may speak against a closure. The numbers are those of relmap.v1.DoubtKind.
enum class DoubtKind : std::uint8_t {
  kFewInliers = 1,     // few points agree on its transform
  kPoorSpread = 2,     // these lie in a small part of the picture
  kImprobable = 3,     // appearance alone would not have recognised the place
  kRunnerUp = 4,       // another place explains the picture nearly as well
  kChanged = 5,        // of what should be seen in both, much differs
  kContradiction = 6,  // other closures, or the robot's own motion, contradict it or once did
  kLonely = 7,         // no closure, or few, agree with it
  kTension = 8,        // refinement moved it away from what was measured
  kUnseen = 9,         // going on from it, the robot did not see what the map shows there
};

struct Doubt {
  DoubtKind kind = DoubtKind::kLonely;
  double weight = 0;    // its part of the suspicion, 0..1
  std::string message;  // in words, with the numbers
};

struct Suspicion {
  double value = 0;           // 0: nothing speaks against it; 1: it is wrong as far as the map can tell
  std::vector<Doubt> doubts;  // the heaviest first; those that weigh nothing are left out
  // What else to know: what is not known of the closure, or that an operator put it into force and has neither
  // withdrawn that nor removed it.
  std::string remark;
};

// Combines the doubts as independent reasons to be wrong: value = 1 - product of (1 - weight). How each weight follows
// from the facts is said with its curve in suspicion.cc. What is not known of a closure, such as the points of an
// imported one, weighs nothing. An operator's decision does not change the value: the facts are what they were.
// Pure, and O(1); 0 without doubts for an edge that is no loop closure, 1 where the facts are no numbers.
Suspicion suspicion_of(const storage::ClosureDigest& closure);
double suspicion_value(const storage::ClosureDigest& closure);  // its value, without the words

}  // namespace relmap::map
