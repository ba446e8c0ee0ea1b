#include "server/place/supposed_camera.h"

namespace relmap::place {

namespace {

Reason refusal_of(const Result<Localisation>& found) { return found.reason(); }
Reason refusal_of(const Result<PlaceMatches>& found) {
  return found.ok() ? found->nothing_verified.reason() : found.reason();
}

template <typename Attempt>
auto with_second_attempt(const PlaceQuestion& question, const DescribeWithoutCamera& without_camera,
                         const Attempt& attempt) -> decltype(attempt(question)) {
  const bool supposed = question.known == CameraKnown::kSupposed && without_camera;
  auto first = attempt(question);
  if (!supposed || refusal_of(first) != Reason::WRONG_CALIBRATION) return first;
  const auto other = without_camera();
  if (!other.ok()) return other.status();
  return attempt(*other);
}

}  // namespace

Result<Localisation> localise_features(const PlaceKnowledge& map, const PlaceQuestion& question,
                                       const DescribeWithoutCamera& without_camera, const Proceed& proceed) {
  return with_second_attempt(question, without_camera,
                             [&](const PlaceQuestion& asked) { return localise_features(map, asked, proceed); });
}

Result<PlaceMatches> match_features(const PlaceKnowledge& map, const PlaceQuestion& question,
                                    const DescribeWithoutCamera& without_camera, std::size_t max_verified,
                                    const Proceed& proceed) {
  return with_second_attempt(question, without_camera, [&](const PlaceQuestion& asked) {
    return match_features(map, asked, max_verified, proceed);
  });
}

}  // namespace relmap::place
