// The call that this thread works for, so that whatever is logged meanwhile names it.
#pragma once

#include <string>
#include <string_view>

namespace relmap::rpc {

struct RequestContext {
  std::string request_id;   // the caller's x-request-id, or one that the daemon made
  std::string traceparent;  // as the caller gave it (W3C Trace Context); empty: none

  // The 32 hexadecimal digits that name the trace; empty: none.
  std::string_view trace_id() const;
};

// The traceparent if it is one, or else "".
std::string checked_traceparent(std::string_view text);

// The call that this thread works for; null if for none.
const RequestContext* current_request();

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
