#include "server/intake/known_session.h"

#include <algorithm>
#include <string>

namespace relmap::intake {

namespace {

constexpr std::uint32_t kNewest = 4096;  // refusals among so many last sequences are repeated to a robot that returns

KnownSession read_session(KeyframeSink& sink, SessionNumber number) {
  KnownSession known;
  known.held = sink.hold_session(number);
  const auto view = sink.view();
  known.session = view->session(number);
  // Whoever takes it for one that has not begun settles again what is settled.
  if (!known.session)
    throw StatusError({Reason::BUDGET_EXCEEDED, "the map does not show session " + std::to_string(number) + " yet"});
  const std::uint32_t end = known.session->next_sequence;
  view->visit_skipped(number, end - std::min(end, kNewest), [&](const storage::Skipped& settled) {
    known.skipped.push_back(settled);
    return true;
  });
  return known;
}

Judged read_judged(const KeyframeSink& sink, FrameId frame) {
  const auto view = sink.view();
  if (const auto hot = view->hot(frame); hot && hot->present) return {hot->payload_crc, Reason::OK, false};
  Judged judged{0, Reason::OK, true};
  view->visit_skipped(frame.session, frame.index, [&](const storage::Skipped& settled) {
    if (settled.from <= frame.index) judged = {settled.crc, settled.reason, !settled.refused};
    return false;
  });
  return judged;
}

}  // namespace

MapAnswer answer(KeyframeSink& sink, const MapQuestion& question) {
  MapAnswer answer;
  try {
    if (question.sequence)
      answer.judged = read_judged(sink, {question.session, *question.sequence});
    else
      answer.session = read_session(sink, question.session);
  } catch (const StatusError& error) {
    answer.failed = error.status();
  }
  return answer;
}

}  // namespace relmap::intake
