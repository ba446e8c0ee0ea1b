#include "proto/base/status.h"

#include <exception>
#include <new>

namespace relmap {

std::string Status::to_string() const {
  std::string text(reason_name(reason_));
  if (!message_.empty()) text += ": " + message_;
  return text;
}

Status caught_status() {
  try {
    throw;
  } catch (const StatusError& error) {
    return error.status();
  } catch (const std::bad_alloc&) {
    return {Reason::BUDGET_EXCEEDED, "out of memory"};
  } catch (const std::exception& error) {
    return {Reason::INTERNAL, error.what()};
  } catch (...) {
    return {Reason::INTERNAL, "an unknown exception"};
  }
}

}  // namespace relmap
