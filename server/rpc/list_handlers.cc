#include <algorithm>

#include "proto/base/read_number.h"
#include "proto/wire/convert.h"
#include "server/map/label_words.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"
#include "server/rpc/pages.h"

namespace relmap::rpc {

namespace {

constexpr std::uint32_t kSessionsPerPage = 100, kMaxSessionsPerPage = 1000;
constexpr std::uint32_t kLabelsPerPage = 1000, kMaxLabelsPerPage = 5000;

}  // namespace

Result<v1::ListSessionsReply> list_sessions(const v1::ListSessionsRequest& request, const Deadline&,
                                            map::Mapper& mapper, ViewKeeper& views) {
  const auto opened = views.open(request.page_token(), mapper.view());
  if (!opened.ok()) return opened.status();
  SessionNumber after = 0;
  if (!opened->position.empty() && !read_number(opened->position, after)) return foreign_token();

  const std::uint32_t max_sessions = page_size(request.page_size(), kSessionsPerPage, kMaxSessionsPerPage);
  v1::ListSessionsReply reply;
  reply.set_map_version(opened->kept->version());
  bool more = false;
  opened->kept->visit_sessions(after + 1, [&](const storage::Session& session) {
    if (storage::is_deleted(session)) return true;
    more = static_cast<std::uint32_t>(reply.sessions_size()) == max_sessions;
    if (!more) *reply.add_sessions() = session_message(session);
    return !more;
  });
  if (more)
    reply.set_next_page_token(
        views.token(opened->kept, std::to_string(reply.sessions(reply.sessions_size() - 1).number())));
  return reply;
}

Result<v1::FindLabelsReply> find_labels(const v1::FindLabelsRequest& request, const Deadline& deadline,
                                        map::Mapper& mapper, ViewKeeper& views) {
  const auto opened = views.open(request.page_token(), mapper.view());
  if (!opened.ok()) return opened.status();
  const std::string& after = opened->position;
  const std::uint32_t max_labels = page_size(request.page_size(), kLabelsPerPage, kMaxLabelsPerPage);
  v1::FindLabelsReply reply;
  reply.set_map_version(opened->kept->version());
  std::size_t bytes = 0;
  for (const std::string& label : opened->kept->labels("")) {
    if (Status status = deadline.check(); !status.ok()) return status;
    if ((!after.empty() && label <= after) || !map::begins_with(label, request.prefix()) ||
        !map::has_words(label, request.words()))
      continue;
    if (static_cast<std::uint32_t>(reply.labels_size()) == max_labels || bytes > kMaxPageBytes) {
      reply.set_next_page_token(views.token(opened->kept, reply.labels(reply.labels_size() - 1).label()));
      break;
    }
    v1::LabelledFrames& added = *reply.add_labels();
    added.set_label(label);
    for (const FrameId frame : opened->kept->labelled(label)) *added.add_frames() = to_wire(frame);
    bytes += added.ByteSizeLong();
  }
  return reply;
}

}  // namespace relmap::rpc
