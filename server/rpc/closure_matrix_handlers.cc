#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/base/read_number.h"
#include "proto/wire/convert.h"
#include "relmap/v1/evidence.pb.h"
#include "server/map/closure_list.h"
#include "server/rpc/charge.h"
#include "server/rpc/handlers.h"
#include "server/rpc/pages.h"

namespace relmap::rpc {

namespace {

constexpr std::uint32_t kCellsPerPage = 1000, kMaxCellsPerPage = 10'000;

}  // namespace

Result<v1::GetClosureMatrixReply> get_closure_matrix(const v1::GetClosureMatrixRequest& request,
                                                     const Deadline& deadline, map::Mapper& mapper, ViewKeeper& views) {
  const auto opened = views.open(request.page_token(), mapper.view());
  if (!opened.ok()) return opened.status();
  const storage::MapView& view = *opened->kept;
  if (request.sessions_size() > kMaxNamedSessions)
    return {Reason::INVALID_ARGUMENT, "more than " + std::to_string(kMaxNamedSessions) + " sessions"};
  std::vector<SessionNumber> sessions(request.sessions().begin(), request.sessions().end());
  std::sort(sessions.begin(), sessions.end());
  for (const SessionNumber number : sessions)
    if (const auto session = storage::existing_session(view, number); !session.ok()) return session.status();
  std::pair<SessionNumber, SessionNumber> after{0, 0};
  if (const std::string_view position = opened->position; !position.empty()) {
    const std::size_t comma = position.find(',');
    if (comma == std::string_view::npos || !read_number(position.substr(0, comma), after.first) ||
        !read_number(position.substr(comma + 1), after.second))
      return foreign_token();
  }
  const std::uint32_t max_cells = page_size(request.page_size(), kCellsPerPage, kMaxCellsPerPage);
  Charge charge(mapper.budget(), storage::Share::kReplies);
  constexpr std::size_t kBytesPerCell = 256;  // as it is counted and as it is sent
  if (Status charged = charge.grow_to(max_cells * kBytesPerCell); !charged.ok()) return charged;
  const auto cells =
      map::closure_cells(view, sessions, after, std::size_t{max_cells} + 1, [&] { return deadline.check(); });
  if (!cells.ok()) return cells.status();
  v1::GetClosureMatrixReply reply;
  reply.set_map_version(view.version());
  for (const map::ClosureCell& cell : *cells) {
    if (static_cast<std::uint32_t>(reply.cells_size()) == max_cells) {
      const v1::ClosureMatrixCell& last = reply.cells(reply.cells_size() - 1);
      reply.set_next_page_token(
          views.token(opened->kept, std::to_string(last.session_a()) + "," + std::to_string(last.session_b())));
      break;
    }
    v1::ClosureMatrixCell& added = *reply.add_cells();
    added.set_session_a(cell.session_a);
    added.set_session_b(cell.session_b);
    added.set_candidate(cell.candidate);
    added.set_accepted(cell.accepted);
    added.set_quarantined(cell.quarantined);
    added.set_removed(cell.removed);
    if (!cell.most_suspicious.valid()) continue;
    *added.mutable_most_suspicious() = to_wire(cell.most_suspicious);
    added.set_suspicion(cell.suspicion);
  }
  return reply;
}

}  // namespace relmap::rpc
