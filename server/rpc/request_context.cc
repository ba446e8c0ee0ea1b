#include "server/rpc/request_context.h"

#include <algorithm>
#include <cstddef>

#include "storage/graph/frame.h"

namespace relmap::rpc {

namespace {

// "00-", 32 digits that name the trace, "-", 16 that name the caller's part of it, "-", 2 of flags.
constexpr std::size_t kTraceAt = 3, kTraceDigits = 32, kParentAt = 36, kParentDigits = 16, kFlagsAt = 53, kLength = 55;

thread_local const RequestContext* current = nullptr;

bool is_hex(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

bool is_zero(std::string_view text) { return text.find_first_not_of('0') == text.npos; }

}  // namespace

std::string_view RequestContext::trace_id() const {
  return traceparent.empty() ? std::string_view() : std::string_view(traceparent).substr(kTraceAt, kTraceDigits);
}

std::string checked_traceparent(std::string_view text) {
  if (text.size() != kLength || !text.starts_with("00-") || text[kParentAt - 1] != '-' || text[kFlagsAt - 1] != '-')
    return "";
  const std::string_view trace = text.substr(kTraceAt, kTraceDigits), parent = text.substr(kParentAt, kParentDigits);
  if (!is_hex(trace) || !is_hex(parent) || !is_hex(text.substr(kFlagsAt)) || is_zero(trace) || is_zero(parent))
    return "";
  return std::string(text);
}

const RequestContext* current_request() { return current; }

std::string current_author() { return current ? current->caller.substr(0, storage::kMaxAuthorBytes) : std::string(); }

RequestScope::RequestScope(const RequestContext& context) : outer_(current) { current = &context; }
RequestScope::~RequestScope() { current = outer_; }

}  // namespace relmap::rpc
