#include "server/skeleton/closure_choice.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "proto/base/suspicion.h"

namespace relmap::skeleton {

using storage::ClosureDigest;

std::vector<ChosenClosure> choose_closures(const std::vector<const ClosureDigest*>& closures, std::uint32_t stride,
                                           const Suspicion& suspicion) {
  std::vector<ChosenClosure> chosen;
  if (closures.empty()) return chosen;
  const auto add = [&](const ClosureDigest& closure) {
    chosen.push_back({&closure, static_cast<float>(suspicion ? suspicion(closure) : 0), 1});
  };
  if (stride == 1) {
    for (const ClosureDigest* closure : closures) add(*closure);
    return chosen;
  }
  const auto uncertainty = [](const ClosureDigest& closure) {
    const float sum = closure.translation_variance + closure.rotation_variance;
    return std::isfinite(sum) ? sum : std::numeric_limits<float>::max();
  };
  using Alike = std::tuple<SessionNumber, std::uint32_t, std::uint32_t, storage::EdgeState, bool, bool>;
  std::map<Alike, std::vector<std::size_t>> groups;
  std::vector<ChosenClosure> all;
  std::swap(all, chosen);
  std::vector<bool> told(closures.size(), false);
  for (const ClosureDigest* closure : closures) {
    groups[{closure->a.session, closure->a.index / stride, closure->id.frame.index / stride, closure->state,
            closure->carries, closure->carried}]
        .push_back(all.size());
    all.push_back({closure, static_cast<float>(suspicion ? suspicion(*closure) : 0), 1});
    told[all.size() - 1] = all.back().suspicion >= kSuspicious;
  }
  for (const auto& [key, members] : groups) {
    const std::size_t best = *std::min_element(members.begin(), members.end(), [&](std::size_t l, std::size_t r) {
      return uncertainty(*all[l].closure) < uncertainty(*all[r].closure);
    });
    told[best] = true;
    for (const std::size_t member : members) all[best].alike += member != best && !told[member];
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    if (told[i]) chosen.push_back(all[i]);
  return chosen;
}

}  // namespace relmap::skeleton
