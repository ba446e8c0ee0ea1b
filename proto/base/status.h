// Status and Result<T>, which every function of relmap that can fail returns. Bad input and failing disks are statuses;
// errors of our own code are assertions.
#pragma once

#include <cassert>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "proto/base/reason.h"

namespace relmap {

class [[nodiscard]] Status {
 public:
  Status() = default;
  // `message` says what exactly is wrong, with the numbers: "cx -12 outside the picture (0..512)".
  Status(Reason reason, std::string message) : reason_(reason), message_(std::move(message)) {}

  bool ok() const { return reason_ == Reason::OK; }
  Reason reason() const { return reason_; }
  const std::string& message() const { return message_; }
  // "TIME_BACKWARDS: 1200 us after 1300 us", or "OK".
  std::string to_string() const;

 private:
  Reason reason_ = Reason::OK;
  std::string message_;
};

// Carries a status through code that cannot return one, such as reads of the paged graph within a search or a solve.
// The worker and the RPC wrapper catch it and answer with its status.
class StatusError : public std::runtime_error {
 public:
  explicit StatusError(Status status) : std::runtime_error(status.to_string()), status_(std::move(status)) {}
  const Status& status() const { return status_; }

 private:
  Status status_;
};

// Within a handler of exceptions: the status of the one that is handled. A StatusError's own, BUDGET_EXCEEDED where
// memory ran out, INTERNAL for all others.
Status caught_status();

inline void throw_if(const Status& status) {
  if (!status.ok()) throw StatusError(status);
}

// A value, or the status that says why there is none.
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}  // NOLINT: implicit by design
  Result(Status status) : state_(std::move(status)) { assert(!std::get<Status>(state_).ok()); }  // NOLINT
  Result(Reason reason, std::string message) : state_(Status(reason, std::move(message))) {}

  bool ok() const { return std::holds_alternative<T>(state_); }
  explicit operator bool() const { return ok(); }
  Status status() const { return ok() ? Status() : std::get<Status>(state_); }
  Reason reason() const { return status().reason(); }

  T& value() & { return std::get<T>(state_); }
  const T& value() const& { return std::get<T>(state_); }
  T&& value() && { return std::get<T>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  // Returns the value, or throws a StatusError.
  T or_throw() && {
    if (!ok()) throw StatusError(std::get<Status>(state_));
    return std::get<T>(std::move(state_));
  }

 private:
  std::variant<T, Status> state_;
};

}  // namespace relmap
