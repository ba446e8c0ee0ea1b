// The call that this thread works for, so that whatever is logged meanwhile names it, and edits name their author.
#pragma once

#include <string>
#include <string_view>

namespace relmap::rpc {

struct RequestContext {
  std::string request_id;   // the caller's x-request-id, or one that the daemon made
  std::string traceparent;  // as the caller gave it (W3C Trace Context); empty: none
  std::string caller = {};  // the name in the caller's credentials; empty: the call is not admitted yet
  std::string role = {};    // and the role there: reader, robot or operator

  // The 32 hexadecimal digits that name the trace; empty: none.
  std::string_view trace_id() const;
};

// The traceparent if it is one, or else "".
std::string checked_traceparent(std::string_view text);

// The call that this thread works for; null if for none.
const RequestContext* current_request();

// The name of the caller of that call, as far as an edit keeps it (storage::kMaxAuthorBytes); empty if there is none.
std::string current_author();

// This thread works for the call as long as the object lives. `context` must outlive it.
class RequestScope {
 public:
  explicit RequestScope(const RequestContext& context);
  ~RequestScope();
  RequestScope(const RequestScope&) = delete;
  RequestScope& operator=(const RequestScope&) = delete;

 private:
  const RequestContext* const outer_;
};

}  // namespace relmap::rpc
